"""A drive's object dictionary: canopen's local node on the common EDS, with live process data and checked writes."""

import io
import logging
import struct
from collections.abc import Callable
from functools import cache

import canopen
from canopen.objectdictionary import ODVariable
from canopen.objectdictionary.eds import import_eds

from axisync_schemas.eds import drive_eds_text

Key = tuple[int, int]
"""Index and sub-index."""
Reader = Callable[[int], int]
"""The value at this instant (ns)."""
Writer = Callable[[int, int], None]
"""Takes a value and the instant."""
Check = Callable[[int, int], None]
"""Takes sub-index and value before they are stored; raises `SdoAbortedError` to refuse them."""
Changed = Callable[[int], None]
"""Called after an object has been stored, with the instant."""

NO_OBJECT = 0x06020000
NO_SUB_INDEX = 0x06090011
VALUE_RANGE = 0x06090030
DEVICE_STATE = 0x08000022
CANNOT_STORE = 0x08000020
NOT_MAPPABLE = 0x06040041
MAPPING_LENGTH = 0x06040042
"""SDO abort codes (CiA 301, table 22)."""

_STORE, _RESTORE = 0x1010, 0x1011
_SAVE = int.from_bytes(b"save", "little")
_LOAD = int.from_bytes(b"load", "little")

# canopen reports refused requests of the other side as warnings of its own; here they are answers.
logging.getLogger("canopen").addHandler(logging.NullHandler())
logging.getLogger("canopen").propagate = False


@cache
def _dictionary() -> canopen.ObjectDictionary:
    """For node 0, shared by all drives: values live in the nodes."""
    dictionary: canopen.ObjectDictionary = import_eds(io.StringIO(drive_eds_text()), 0)  # type: ignore[no-untyped-call]
    return dictionary


class Objects(canopen.LocalNode):
    """All objects of one drive.

    Attributes:
        now: instant of the request being served, ns; set by whoever serves it.
        readers, writers: process data, by key; not stored.
        checks, changed: by index.
    """

    def __init__(self, node_id: int, factory: dict[Key, int]) -> None:
        super().__init__(node_id, _dictionary())
        self.node_id = node_id
        self.now = 0
        self.readers: dict[Key, Reader] = {}
        self.writers: dict[Key, Writer] = {}
        self.checks: dict[int, Check] = {_STORE: _expect(_SAVE), _RESTORE: _expect(_LOAD)}
        self.changed: dict[int, Changed] = {_STORE: self._save, _RESTORE: self._forget}
        self._factory = {**self._own_identifiers(), **factory}
        self._saved: dict[int, dict[int, bytes]] = {}
        self.reset()

    def _own_identifiers(self) -> dict[Key, int]:
        """Defaults that contain the node id."""
        variables = [v for entry in self.object_dictionary.values() for v in _members(entry)]
        return {(v.index, v.subindex): (v.default or 0) + self.node_id for v in variables if v.relative}

    def reset(self, first: int = 0x1000, last: int = 0xFFFF) -> None:
        """Power-on values of the objects first..last: the saved ones, else the factory's."""
        for index in [index for index in self.data_store if first <= index <= last]:
            del self.data_store[index]
        for (index, sub), value in self._factory.items():
            if first <= index <= last:
                self.put(index, sub, value)
        for index, subs in self._saved.items():
            if first <= index <= last:
                self.data_store[index] = dict(subs)

    def variable(self, index: int, sub: int = 0) -> ODVariable:
        """The description of an object.

        Raises:
            SdoAbortedError: there is none.
        """
        if index not in self.object_dictionary:
            raise canopen.SdoAbortedError(NO_OBJECT)
        entry = self.object_dictionary[index]
        if isinstance(entry, ODVariable):
            if sub == 0:
                return entry
            raise canopen.SdoAbortedError(NO_SUB_INDEX)
        # Not `sub in entry`: an array of canopen's invents the members that it lacks.
        if sub not in entry.subindices:
            raise canopen.SdoAbortedError(NO_SUB_INDEX)
        variable: ODVariable = entry.subindices[sub]
        return variable

    def number(self, index: int, sub: int = 0) -> int:
        """The stored or default value of a configuration object."""
        variable = self.variable(index, sub)
        data = self.data_store.get(index, {}).get(sub)
        return int(variable.decode_raw(data)) if data is not None else int(variable.default or 0)

    def put(self, index: int, sub: int, value: int) -> None:
        """Stores a value from within the drive, unchecked."""
        self.data_store.setdefault(index, {})[sub] = self.variable(index, sub).encode_raw(value)

    def get_data(self, index: int, subindex: int, check_readable: bool = False) -> bytes:
        """What an SDO upload reads."""
        variable = self.variable(index, subindex)
        reader = self.readers.get((index, subindex))
        if reader is not None:
            return variable.encode_raw(reader(self.now))
        return super().get_data(index, subindex, check_readable)

    def set_data(self, index: int, subindex: int, data: bytes, check_writable: bool = False) -> None:
        """What an SDO download writes."""
        variable = self.variable(index, subindex)
        if check_writable and not variable.writable:
            raise canopen.SdoAbortedError(0x06010002)
        if variable.data_type in ODVariable.STRUCT_TYPES and 8 * len(data) != len(variable):
            raise canopen.SdoAbortedError(0x06070010)
        value = int(variable.decode_raw(bytes(data)))
        if index in self.checks:
            self.checks[index](subindex, value)
        writer = self.writers.get((index, subindex))
        if writer is not None:
            writer(value, self.now)
        elif index not in (_STORE, _RESTORE):
            self.data_store.setdefault(index, {})[subindex] = bytes(data)
        if index in self.changed:
            self.changed[index](self.now)

    def _save(self, _now: int) -> None:
        self._saved = {index: dict(subs) for index, subs in self.data_store.items()}

    def _forget(self, _now: int) -> None:
        self._saved = {}


def _members(entry: object) -> list[ODVariable]:
    if isinstance(entry, ODVariable):
        return [entry]
    return list(getattr(entry, "subindices", {}).values())


def _expect(signature: int) -> Check:
    def check(sub: int, value: int) -> None:
        if sub != 1 or value != signature:
            raise canopen.SdoAbortedError(CANNOT_STORE)

    return check


def one_of(allowed: frozenset[int] | range, sub: int = 0) -> Check:
    """A check that refuses other values."""

    def check(at: int, value: int) -> None:
        if at == sub and value not in allowed:
            raise canopen.SdoAbortedError(VALUE_RANGE)

    return check


def layout(variables: list[ODVariable]) -> struct.Struct:
    """Little-endian struct of these objects, one behind the other (CiA 301, 7.3.1.4)."""
    formats = (ODVariable.STRUCT_TYPES[v.data_type or 0].format.lstrip("<") for v in variables)
    return struct.Struct("<" + "".join(formats))
