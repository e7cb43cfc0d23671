"""SYNC consumer: counter, doubled and missing SYNCs (CiA 301, 7.2.5)."""


class SyncConsumer:
    """Follows the SYNC counter, 1..overflow (0x1019); without one every SYNC is the next."""

    __slots__ = ("counter", "overflow", "time")

    def __init__(self) -> None:
        self.overflow = 0
        self.restart()

    def restart(self) -> None:
        """The next SYNC is the first."""
        self.counter = 0
        self.time = -1

    def receive(self, data: bytes, now: int) -> int:
        """How many cycles this SYNC is after the last one: 1 as a rule, more where SYNCs are missing, 0 for the same
        SYNC once more, -1 where it lacks the counter or it is out of range."""
        if self.overflow == 0:
            self.time = now
            return 1
        if len(data) != 1 or not 1 <= data[0] <= self.overflow:
            return -1
        counter = data[0]
        advance = (counter - self.counter) % self.overflow if self.counter else 1
        if advance:
            self.counter = counter
            self.time = now
        return advance
