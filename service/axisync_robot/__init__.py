"""Models of arms. pinocchio is used here only."""
