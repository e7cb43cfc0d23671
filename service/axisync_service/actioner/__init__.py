"""Turns commands into robot actions: leases, admission, the life of a move. Pure decisions: time and IO are passed in."""
