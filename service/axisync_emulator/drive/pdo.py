"""PDOs as the object dictionary configures them: identifiers, types, mapping (CiA 301, 7.2.2 and 7.5.2.35 to 38)."""

import struct
from collections.abc import Callable

from canopen import SdoAbortedError
from canopen.objectdictionary import ODVariable

from axisync_emulator.drive.object_dictionary import (
    DEVICE_STATE,
    MAPPING_LENGTH,
    NO_OBJECT,
    NOT_MAPPABLE,
    VALUE_RANGE,
    Key,
    Objects,
    Reader,
    Writer,
    layout,
)

INVALID = 1 << 31
_NO_REMOTE = 1 << 30
_EXTENDED = 1 << 29
SYNC_TYPES = range(1, 241)
EVENT_TYPES = frozenset({254, 255})
RPDO_TYPES = frozenset({0, *SYNC_TYPES, *EVENT_TYPES})
TPDO_TYPES = frozenset(SYNC_TYPES)
_COB_ID, _TYPE, _INHIBIT, _EVENT, _SYNC_START = 1, 2, 3, 5, 6

# Identifiers that no PDO may have (CiA 301, table 'Restricted CAN-IDs').
_RESTRICTED = (
    range(0x080), range(0x101, 0x181), range(0x581, 0x600), range(0x601, 0x680), range(0x6E0, 0x700),
    range(0x701, 0x800),
)  # fmt: skip


class Pdo:
    """Configuration of one PDO; `communication` is 0x1400 or 0x1800 + n, its mapping 0x200 above."""

    def __init__(self, objects: Objects, communication: int, types: frozenset[int], access: str) -> None:
        self._objects = objects
        self._communication = communication
        self._mapping = communication + 0x200
        self._types = types
        self._access = access
        self.struct = struct.Struct("")
        self.keys: tuple[Key, ...] = ()
        self.cob_id = 0
        self.valid = False
        self.type = 0
        objects.checks[communication] = self._check_communication
        objects.checks[self._mapping] = self._check_mapping

    def _communicated(self, sub: int) -> int:
        return self._objects.number(self._communication, sub)

    def configure(self) -> None:
        """Takes over what the object dictionary says."""
        cob_id = self._communicated(_COB_ID)
        self.cob_id = cob_id & 0x7FF
        self.type = self._communicated(_TYPE)
        count = self._objects.number(self._mapping, 0)
        self.valid = not cob_id & INVALID and count > 0
        mapped = [self._objects.number(self._mapping, i + 1) for i in range(count)]
        self.keys = tuple((entry >> 16, entry >> 8 & 0xFF) for entry in mapped)
        self.struct = layout([self._objects.variable(*key) for key in self.keys])

    def _check_communication(self, sub: int, value: int) -> None:
        exists = not self._communicated(_COB_ID) & INVALID
        if sub == _COB_ID:
            changed = (value ^ self._communicated(_COB_ID)) & 0x3FFFFFFF
            if exists and not value & INVALID and changed:
                raise SdoAbortedError(DEVICE_STATE)
            if value & _EXTENDED or any(value & 0x7FF in ids for ids in _RESTRICTED):
                raise SdoAbortedError(VALUE_RANGE)
        elif sub == _TYPE and value not in self._types:
            raise SdoAbortedError(VALUE_RANGE)
        elif sub in (_INHIBIT, _SYNC_START) and exists and value != self._communicated(sub):
            raise SdoAbortedError(DEVICE_STATE)

    def _check_mapping(self, sub: int, value: int) -> None:
        """The order that CiA 301 demands: PDO off, count 0, entries, count, PDO on."""
        current = self._objects.number(self._mapping, sub)
        if value == current:
            return
        if not self._communicated(_COB_ID) & INVALID:
            raise SdoAbortedError(DEVICE_STATE)
        if sub:
            if self._objects.number(self._mapping, 0):
                raise SdoAbortedError(DEVICE_STATE)
            if value:
                self._mappable(value)
        else:
            self._check_count(value)

    def _check_count(self, count: int) -> None:
        if count > 8:
            raise SdoAbortedError(MAPPING_LENGTH)
        entries = [self._objects.number(self._mapping, i + 1) for i in range(count)]
        bits = sum(len(self._mappable(entry)) for entry in entries)
        if bits > 64:
            raise SdoAbortedError(MAPPING_LENGTH)

    def _mappable(self, entry: int) -> ODVariable:
        index, sub, bits = entry >> 16, entry >> 8 & 0xFF, entry & 0xFF
        if index == 0:
            raise SdoAbortedError(NO_OBJECT)
        variable = self._objects.variable(index, sub)
        if not variable.pdo_mappable or self._access not in variable.access_type or bits != len(variable):
            raise SdoAbortedError(NOT_MAPPABLE)
        return variable


class Rpdo(Pdo):
    """A PDO that the drive receives. A synchronous one waits for the next SYNC."""

    def __init__(self, objects: Objects, communication: int) -> None:
        super().__init__(objects, communication, RPDO_TYPES, "w")
        self._writers: tuple[Writer, ...] = ()
        self.buffer: bytes | None = None
        self.timeout_ns = 0

    def configure(self) -> None:
        """See `Pdo.configure`."""
        super().configure()
        self.buffer = None
        self.timeout_ns = self._communicated(_EVENT) * 1_000_000
        self._writers = tuple(self._objects.writers.get(key) or self._store(key) for key in self.keys)

    def _store(self, key: Key) -> Writer:
        return lambda value, _now: self._objects.put(*key, value)

    @property
    def synchronous(self) -> bool:
        """Valid only by the next SYNC."""
        return self.type <= 240

    def apply(self, data: bytes, now: int) -> None:
        """Writes the mapped objects, in the order of the mapping."""
        for writer, value in zip(self._writers, self.struct.unpack_from(data), strict=True):
            writer(value, now)


class Tpdo(Pdo):
    """A PDO that the drive sends, on every n-th SYNC by its transmission type n."""

    def __init__(self, objects: Objects, communication: int) -> None:
        super().__init__(objects, communication, TPDO_TYPES, "r")
        self._readers: tuple[Reader, ...] = ()
        self._start = 0
        self._cycles_left = 0
        self._started = False

    def configure(self) -> None:
        """See `Pdo.configure`."""
        super().configure()
        self._start = self._communicated(_SYNC_START)
        self.bind()
        self.restart()

    def bind(self) -> None:
        """Looks up again what the mapped objects are read from."""
        self._readers = tuple(self._objects.readers.get(key) or self._stored(key) for key in self.keys)

    def _stored(self, key: Key) -> Callable[[int], int]:
        return lambda _now: self._objects.number(*key)

    def restart(self) -> None:
        """Counting begins anew: with the SYNC whose counter is 0x1800:6, or with the next one where that is 0."""
        self._started = self._start == 0
        self._cycles_left = self.type

    def due(self, advance: int, counter: int) -> bool:
        """Whether this SYNC, `advance` cycles after the last one, triggers it."""
        if not self._started:
            # `counter - start` cycles ago, where that very SYNC was lost.
            self._started = 0 <= counter - self._start < advance
            self._cycles_left = self.type
            return self._started
        self._cycles_left -= advance
        if self._cycles_left > 0:
            return False
        self._cycles_left = self.type - (-self._cycles_left) % self.type
        return True

    def build(self, now: int) -> bytes:
        """The frame's data, sampled at `now`."""
        return self.struct.pack(*[reader(now) for reader in self._readers])
