"""Heartbeat, produced and consumed (CiA 301, 7.2.8.2.2)."""

from collections.abc import Callable

from axisync_emulator.segment import Port

COB_ID = 0x700
_MS = 1_000_000


class HeartbeatProducer:
    """Sends the NMT state every 0x1017 ms.

    Attributes:
        silent: an injected fault: it does not.
    """

    def __init__(self, node_id: int, port: Port, state: Callable[[], int]) -> None:
        self._can_id = COB_ID + node_id
        self._port = port
        self._state = state
        self._timer = port.timer(self._send)
        self._period_ns = 0
        self.silent = False

    def configure(self, period_ms: int, now: int) -> None:
        """A new period begins; 0 ends it."""
        self._period_ns = period_ms * _MS
        if period_ms:
            self._timer.set(now + self._period_ns)
        else:
            self._timer.cancel()

    def boot_up(self, now: int) -> None:
        """The boot-up message: a heartbeat of state 0."""
        self._port.send(self._can_id, b"\0", now)

    def _send(self, now: int) -> None:
        if not self.silent:
            self._port.send(self._can_id, bytes((self._state(),)), now)
        self._timer.set(now + self._period_ns)


class HeartbeatConsumer:
    """Watches the node and time in 0x1016:1, from its first heartbeat on."""

    def __init__(self, port: Port, lost: Callable[[int], None], back: Callable[[int], None]) -> None:
        self._port = port
        self._back = back
        self._timer = port.timer(lost)
        self._can_id = 0
        self._time_ns = 0

    def configure(self, entry: int) -> None:
        """`entry` = node id << 16 | time ms; either 0 ends it."""
        if self._can_id:
            self._port.ignore(self._can_id, self._receive)
        self._timer.cancel()
        node_id, time_ms = entry >> 16 & 0x7F, entry & 0xFFFF
        self._can_id = COB_ID + node_id if node_id and time_ms else 0
        self._time_ns = time_ms * _MS
        if self._can_id:
            self._port.listen(self._can_id, self._receive)

    def _receive(self, _data: bytes, now: int) -> None:
        self._timer.set(now + self._time_ns)
        self._back(now)
