"""SYNC with counter (CiA 301, 7.2.5): the counter is tied to the tick, so that a skipped tick shows as a gap."""

SYNC_ID = 0x080
COUNTER_OVERFLOW = 240
"""Object 0x1019: the counter runs 1..240."""


def counter(tick: int) -> int:
    """Counter value of a tick."""
    return (tick - 1) % COUNTER_OVERFLOW + 1


FRAMES = tuple(bytes((value,)) for value in range(COUNTER_OVERFLOW + 1))
"""SYNC data by counter value, made once."""
