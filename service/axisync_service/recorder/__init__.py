"""The recorder: every tick of the ring, and requests, plans and events, into MCAP files. Nothing else writes logs."""
