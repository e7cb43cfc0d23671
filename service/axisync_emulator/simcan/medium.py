"""The wire: who sends next, and how long it takes. Pure; all times are ns of bus time."""

from collections import deque
from heapq import heapify, heappop, heappush

from axisync_emulator.simcan.wire import EXTENDED, EXTENDED_MASK, INTERFRAME_BITS, REMOTE, STANDARD_MASK, frame_bits
from axisync_emulator.timers import NEVER

Pending = tuple[int, int, bytes]
"""When it was handed over ns, can_id, data."""
_BITS_MAX = 200
"""More than the longest frame has: 160 with an extended identifier."""
ERROR_FRAME_BITS = 20
"""Error flag, the others' flags behind it, and the delimiter: at most 6 + 6 + 8 (ISO 11898-1, 10.4.4)."""


def arbitration_key(can_id: int) -> int:
    """Lower wins: the bits of the arbitration field in the order in which they are sent (ISO 11898-1, 10.4.2)."""
    if can_id <= STANDARD_MASK:
        return can_id << 21
    remote = 1 if can_id & REMOTE else 0
    if not can_id & EXTENDED:
        return (can_id & STANDARD_MASK) << 21 | remote << 20
    identifier = can_id & EXTENDED_MASK
    return (identifier >> 18) << 21 | 3 << 19 | (identifier & 0x3FFFF) << 1 | remote


class Medium:
    """One bus: transmit queues of its nodes, arbitration between their heads, and the frame on the wire.

    Each source's own frames leave in the order in which they were handed over, as from a controller with one transmit
    queue; among the sources the lowest identifier wins whenever the bus is free.
    """

    def __init__(self, bitrate: float) -> None:
        self._bit_ns = 1e9 / bitrate
        self._durations = [round(bits * self._bit_ns) for bits in range(_BITS_MAX)]
        self._queues: list[deque[Pending]] = []
        self._waiting: list[tuple[int, int, int]] = []  # heads not yet handed over at `now`: time, source, key
        self._contending: list[tuple[int, int]] = []  # heads that want the bus: key, source
        self._free_at = 0
        self.now = 0
        self.completion = NEVER
        self.frame: Pending = (0, 0, b"")
        self.source = -1
        self.failed = False
        self._frame_bits = 0
        self._off: set[int] = set()
        self._began = NEVER
        self.bits = 0
        """Sent so far, with stuffing and interframe space."""
        self.frames = 0

    def attach(self) -> int:
        """A new source. Sources with the same identifier win in the order in which they were attached."""
        self._queues.append(deque())
        return len(self._queues) - 1

    def queue(self, source: int, can_id: int, data: bytes, at: int) -> None:
        """Hands a frame over at time `at`; in the past means as soon as what has happened allows."""
        if source in self._off:
            return
        if at < self.now:
            at = self.now
        queue = self._queues[source]
        queue.append((at, can_id, data))
        if len(queue) == 1:
            heappush(self._waiting, (at, source, can_id << 21 if can_id <= STANDARD_MASK else arbitration_key(can_id)))

    def pending(self, source: int) -> int:
        """How many frames of a source wait."""
        return len(self._queues[source])

    def newest(self, source: int) -> int:
        """When the last of the frames that wait was handed over."""
        return self._queues[source][-1][0]

    def flush(self, source: int) -> None:
        """Forgets what a source still wanted to send: it has left the bus."""
        self._queues[source].clear()
        self._withdraw(source)

    def _withdraw(self, source: int) -> None:
        self._waiting = [entry for entry in self._waiting if entry[1] != source]
        self._contending = [entry for entry in self._contending if entry[1] != source]
        heapify(self._waiting)
        heapify(self._contending)

    def disconnect(self, source: int) -> None:
        """Nothing of it is sent any more, until `connect`."""
        self.flush(source)
        self._off.add(source)

    def connect(self, source: int) -> None:
        """Undoes `disconnect`."""
        self._off.discard(source)

    @property
    def next_start(self) -> int:
        """When the next frame begins; meaningful while none is on the wire."""
        if self._contending:
            return max(self._free_at, self.now)
        if self._waiting:
            return max(self._free_at, self._waiting[0][0])
        return NEVER

    def start(self, now: int) -> None:
        """Puts the winner of the arbitration at `now`, which is `next_start`, on the wire."""
        self.now = now
        if not self.frames:
            self._began = now
        waiting, contending = self._waiting, self._contending
        while waiting and waiting[0][0] <= now:
            _, source, key = heappop(waiting)
            heappush(contending, (key, source))
        self.source = source = heappop(contending)[1]
        queue = self._queues[source]
        self.frame = queue.popleft()
        if queue:
            following = queue[0]
            heappush(waiting, (following[0], source, arbitration_key(following[1])))
        self.frames += 1
        self._occupy(frame_bits(self.frame[1], self.frame[2]))

    def _occupy(self, bits: int) -> None:
        now, durations = self.now, self._durations
        self.completion = now + durations[bits]
        self._frame_bits = bits = bits + INTERFRAME_BITS
        self._free_at = now + durations[bits]
        self.bits += bits
        self.failed = False

    # What can happen to a frame that has just started.

    def abandon(self) -> None:
        """It is taken off the wire as if it had never been there."""
        self.bits -= self._frame_bits
        self.frames -= 1
        self.completion = NEVER
        self._free_at = self.now

    def replace(self, data: bytes) -> None:
        """It carries other data."""
        self.bits -= self._frame_bits
        self.frame = (self.frame[0], self.frame[1], data)
        self._occupy(frame_bits(self.frame[1], data))

    def corrupt(self, bit: int) -> None:
        """At this bit everyone sees an error: an error frame ends it, and it has `failed`."""
        self.bits -= self._frame_bits
        self._occupy(min(bit, self._frame_bits - INTERFRAME_BITS) + ERROR_FRAME_BITS)
        self.failed = True

    def retry(self) -> None:
        """The frame that has failed is sent again, before anything else of its source."""
        queue = self._queues[self.source]
        queue.appendleft((self.now, *self.frame[1:]))
        self._withdraw(self.source)
        heappush(self._waiting, (self.now, self.source, arbitration_key(self.frame[1])))

    @property
    def load(self) -> float:
        """Share of the time since the first frame in which the bus was busy."""
        elapsed = max(self.now, self._free_at) - self._began
        return self.bits * self._bit_ns / elapsed if elapsed > 0 else 0.0

    def finish(self) -> None:
        """Takes the frame, complete now, off the wire; it stays in `frame` until the next one starts."""
        self.now = self.completion
        self.completion = NEVER
