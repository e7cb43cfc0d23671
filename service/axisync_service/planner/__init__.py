"""Turns a requested move into a timed plan: MASA, admission checks that need the path, plan slots."""
