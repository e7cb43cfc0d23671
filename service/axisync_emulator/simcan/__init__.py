"""A CAN bus in software: wire time with bit stuffing, arbitration by identifier, lock-step time."""
