"""The 2 ms cycle: grid clock, decisions of a tick, playing plans, and the loop around them."""
