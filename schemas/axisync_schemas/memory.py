"""Shared memory between the service's processes: memfds made by the supervisor and inherited by descriptor.

Python has no memory barriers. So a record is either one aligned 8-byte word, which x86-64 and arm64 store whole, or
carries a sequence number and a crc32 that its reader verifies. No numpy here: the supervisor imports this module.
"""

import math
import mmap
import os
import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum

RING_SECONDS = 10.0
"""How long the recorder may be away before ticks are lost."""
PLAN_SLOTS = 32
PLAN_SLOT_BYTES = 4 * 1024 * 1024
STATUS_BYTES = 64 * 1024
RECORDER_BYTES = 32 * 1024
TIMING_SLOTS = 4096

REGIONS = ("control", "ticks", "timings", "status", "recorder", "plans")
"""Names of the memfds, in the order in which they are passed."""


def slots_for(period_s: float) -> int:
    """Slots of the tick ring that hold at least `RING_SECONDS`: a power of two."""
    return 1 << max(1, math.ceil(math.log2(RING_SECONDS / period_s)))


def region_sizes(period_s: float, axes: int, groups: int) -> dict[str, int]:
    """Bytes of each region. Untouched pages of a memfd cost nothing, so the tick ring is sized from above."""
    tick_bytes = 256 + 64 * axes + 48 * groups
    return {
        "control": Control.size(groups),
        "ticks": slots_for(period_s) * tick_bytes,
        "timings": TimingRing.size(),
        "status": STATUS_BYTES,
        "recorder": RECORDER_BYTES,
        "plans": PLAN_SLOTS * PLAN_SLOT_BYTES,
    }


class Word(IntEnum):
    """Words of the control region that exist once. One writer each."""

    PHASE = 0  # supervisor
    SUPERVISOR_NS = 1  # supervisor
    CONTROLLER_NS = 2  # controller: monotonic time of its last cycle, the watchdog's food
    CONTROLLER_TICK = 3  # controller: newest tick in the ring
    CONTROLLER_DONE = 4  # controller: 1 when its drives are disabled and no tick will follow
    FRONT_NS = 5  # front
    RECORDER_NS = 6  # recorder
    RECORDER_CURSOR = 7  # recorder: every tick below it has reached the kernel
    RECORDER_LOST = 8  # recorder: ticks that the ring no longer held
    RECORDER_STATE = 9  # recorder: enumerations.RecorderState
    REALTIME = 10  # controller: 1 when it runs under SCHED_FIFO with locked memory
    PLANNER_NS = 11  # planner
    FRONT_READY = 12  # front: 1 while it sees a running controller, so that commands can be carried out
    HOMED_CHANGES = 13  # controller: grows whenever an axis was homed, or is no longer
    PLANNER_PID = 14  # planner: its process id, so that front can end it when it hangs


class GroupWord(IntEnum):
    """Words of the control region that exist for each elementary group."""

    STOP_COUNT = 0  # front's stop callback: grows with each stop
    LEASE_UNTIL_NS = 1  # actioner: monotonic time at which the lease lapses, 0 without a lease
    LEASE_EPOCH = 2  # actioner: grows whenever the group changes hands


_WORDS, _GROUP_WORDS = len(Word), len(GroupWord)


class Control:
    """The words through which the processes see each other; every one has a single writer."""

    def __init__(self, buffer: mmap.mmap | bytearray, groups: int) -> None:
        self._words = memoryview(buffer).cast("Q")
        self._groups = groups

    @staticmethod
    def size(groups: int) -> int:
        """Bytes needed."""
        return 8 * (_WORDS + groups * _GROUP_WORDS)

    def __getitem__(self, word: Word) -> int:
        return self._words[word]

    def __setitem__(self, word: Word, value: int) -> None:
        self._words[word] = value

    def group(self, group: int, word: GroupWord) -> int:
        """A word of elementary group `group`."""
        return self._words[_WORDS + group * _GROUP_WORDS + word]

    def of_groups(self, word: GroupWord) -> list[int]:
        """A word of each elementary group."""
        end = _WORDS + self._groups * _GROUP_WORDS
        return self._words[_WORDS + word : end : _GROUP_WORDS].tolist()

    def set_group(self, group: int, word: GroupWord, value: int) -> None:
        """Stores a word of elementary group `group`."""
        self._words[_WORDS + group * _GROUP_WORDS + word] = value

    def close(self) -> None:
        """Lets the mapping be closed."""
        self._words.release()


_BLOCK = struct.Struct("<QII")


class Mailbox:
    """One record of up to the buffer's size, rewritten in place by one writer; readers verify and retry."""

    def __init__(self, buffer: mmap.mmap | bytearray | memoryview) -> None:
        self._view = memoryview(buffer)
        self._sequence = 0

    def write(self, payload: bytes) -> None:
        """Replaces the record.

        Raises:
            ValueError: longer than the mailbox.
        """
        if len(payload) > len(self._view) - _BLOCK.size:
            raise ValueError(f"{len(payload)} bytes do not fit a mailbox of {len(self._view)}")
        self._sequence += 1
        self._view[_BLOCK.size : _BLOCK.size + len(payload)] = payload
        _BLOCK.pack_into(self._view, 0, self._sequence, len(payload), _checksum(self._sequence, payload))

    def read(self, attempts: int = 5) -> bytes | None:
        """The newest record, or None where there is none yet or the writer was faster every time."""
        for _ in range(attempts):
            sequence, length, checksum = _BLOCK.unpack_from(self._view, 0)
            if sequence == 0 or length > len(self._view) - _BLOCK.size:
                continue
            payload = bytes(self._view[_BLOCK.size : _BLOCK.size + length])
            if _checksum(sequence, payload) == checksum:
                return payload
        return None

    def close(self) -> None:
        """Lets the mapping be closed."""
        self._view.release()


def _checksum(sequence: int, payload: bytes) -> int:
    return zlib.crc32(payload, sequence & 0xFFFFFFFF)


TIMING = struct.Struct("<QqIIIIII")
"""One cycle: tick, lateness ns, then ns spent in read, decide, write, record; skipped ticks before it, LateCause."""


class TimingRing:
    """Where each cycle's time went, by stage, for the newest ticks. A torn record harms a report only."""

    def __init__(self, buffer: mmap.mmap | bytearray) -> None:
        self._view = memoryview(buffer)

    @staticmethod
    def size() -> int:
        """Bytes needed."""
        return TIMING_SLOTS * TIMING.size

    def write(
        self, tick: int, lateness: int, read: int, decide: int, write: int, record: int, skipped: int, cause: int = 0
    ) -> None:
        """Stores one cycle's times, ns, and why it was late (`LateCause`)."""
        offset = (tick % TIMING_SLOTS) * TIMING.size
        TIMING.pack_into(self._view, offset, tick, lateness, read, decide, write, record, skipped, cause)

    def read(self, first: int, last: int) -> list[tuple[int, ...]]:
        """Ticks first <= tick < last, where still there: (tick, lateness, the four stages, skipped, cause)."""
        rows = []
        for tick in range(max(first, last - TIMING_SLOTS, 1), last):
            row = TIMING.unpack_from(self._view, (tick % TIMING_SLOTS) * TIMING.size)
            if row[0] == tick:
                rows.append(row)
        return rows

    def close(self) -> None:
        """Lets the mapping be closed."""
        self._view.release()


@dataclass(frozen=True, slots=True)
class Region:
    """A named memfd."""

    name: str
    descriptor: int
    size: int

    def map(self, writable: bool = True) -> mmap.mmap:
        """Maps it into this process."""
        return mmap.mmap(self.descriptor, self.size, access=mmap.ACCESS_WRITE if writable else mmap.ACCESS_READ)


def create(sizes: dict[str, int]) -> dict[str, Region]:
    """Makes the memfds; they live as long as a process holds their descriptor."""
    regions = {}
    for name in REGIONS:
        descriptor = os.memfd_create(f"axisync-{name}", 0)
        os.ftruncate(descriptor, sizes[name])
        regions[name] = Region(name, descriptor, sizes[name])
    return regions


def inherited(descriptors: dict[str, int]) -> dict[str, Region]:
    """The regions that a parent passed, by descriptor."""
    return {name: Region(name, fd, os.fstat(fd).st_size) for name, fd in descriptors.items() if name in REGIONS}
