"""Reads logs: review, why, replay, recover, export, diff. Needs the extra `review`."""
