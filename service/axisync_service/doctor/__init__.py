"""`axisyncd doctor`: is this machine fit for the cycle?"""
