"""Turns commands into robot actions: leases, admission, the life of a move. Pure: time and IO are passed in."""
