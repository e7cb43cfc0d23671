"""The drive's electronic data sheet (CiA 306): `drive.eds`, read by both sides, as a typed object dictionary."""

import re
import struct
from configparser import Error as ParserError
from configparser import RawConfigParser
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cache
from importlib import resources

DRIVE_EDS = "drive.eds"
_NODE_ID = "$NODEID"
_SECTION = re.compile(r"^([0-9A-Fa-f]{4})(?:sub([0-9A-Fa-f]{1,2}))?$")


class DataType(IntEnum):
    """CiA 301, table 44: the data types that drives use."""

    BOOLEAN = 0x01
    INTEGER8 = 0x02
    INTEGER16 = 0x03
    INTEGER32 = 0x04
    UNSIGNED8 = 0x05
    UNSIGNED16 = 0x06
    UNSIGNED32 = 0x07
    REAL32 = 0x08
    VISIBLE_STRING = 0x09
    OCTET_STRING = 0x0A
    DOMAIN = 0x0F
    REAL64 = 0x11
    INTEGER64 = 0x15
    UNSIGNED64 = 0x1B


_LAYOUT = {
    DataType.BOOLEAN: struct.Struct("<?"),
    DataType.INTEGER8: struct.Struct("<b"),
    DataType.INTEGER16: struct.Struct("<h"),
    DataType.INTEGER32: struct.Struct("<i"),
    DataType.INTEGER64: struct.Struct("<q"),
    DataType.UNSIGNED8: struct.Struct("<B"),
    DataType.UNSIGNED16: struct.Struct("<H"),
    DataType.UNSIGNED32: struct.Struct("<I"),
    DataType.UNSIGNED64: struct.Struct("<Q"),
    DataType.REAL32: struct.Struct("<f"),
    DataType.REAL64: struct.Struct("<d"),
}
_REAL = (DataType.REAL32, DataType.REAL64)

Value = int | float | str | bytes


class EdsError(ValueError):
    """An EDS that is none, a value that does not fit its object, or an object that the EDS does not have."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One object, or one sub-index of it.

    Attributes:
        access: ro, rw, wo, rwr, rww or const (CiA 306, 4.6.3.2).
        default: of a node with id 0 where `adds_node_id`; None where the EDS names none.
    """

    index: int
    sub: int
    name: str
    data_type: DataType
    access: str
    default: Value | None
    adds_node_id: bool
    pdo_mapping: bool

    @property
    def size(self) -> int | None:
        """Bytes, None for strings and domains."""
        layout = _LAYOUT.get(self.data_type)
        return layout.size if layout else None

    @property
    def readable(self) -> bool:
        """May be uploaded."""
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        """May be downloaded."""
        return self.access not in ("ro", "const")

    def default_of(self, node_id: int) -> Value | None:
        """The default value at the node with this id."""
        if self.adds_node_id and isinstance(self.default, int):
            return self.default + node_id
        return self.default

    def pack(self, value: Value) -> bytes:
        """`value` as the object's bytes, little-endian (CiA 301, 7.1.4).

        Raises:
            EdsError: not of the object's type, or out of its range.
        """
        layout = _LAYOUT.get(self.data_type)
        try:
            if layout:
                return layout.pack(value)
            return value.encode("ascii") if isinstance(value, str) else bytes(value)  # type: ignore[arg-type]
        except (struct.error, TypeError, UnicodeEncodeError):
            raise EdsError(f"{self}: {value!r} is no {self.data_type.name}") from None

    def unpack(self, data: bytes) -> Value:
        """The value in `data`.

        Raises:
            EdsError: not as long as the object.
        """
        layout = _LAYOUT.get(self.data_type)
        if layout is None:
            return data.decode("latin-1") if self.data_type is DataType.VISIBLE_STRING else bytes(data)
        if len(data) != layout.size:
            raise EdsError(f"{self}: {len(data)} bytes, must be {layout.size}")
        value: Value = layout.unpack(data)[0]
        return value

    def __str__(self) -> str:
        return f"0x{self.index:04X}:{self.sub} ({self.name})"


@dataclass(frozen=True, slots=True)
class ObjectDictionary:
    """All entries of an EDS, by (index, sub)."""

    entries: dict[tuple[int, int], Entry]

    def __getitem__(self, key: tuple[int, int]) -> Entry:
        """
        Raises:
            EdsError: the EDS does not have it.
        """
        try:
            return self.entries[key]
        except KeyError:
            raise EdsError(f"0x{key[0]:04X}:{key[1]} is not in the EDS") from None

    def __contains__(self, key: tuple[int, int]) -> bool:
        return key in self.entries

    def describe(self, index: int, sub: int = 0) -> str:
        """Index, sub-index and name, for messages; also of an object that the EDS does not have."""
        entry = self.entries.get((index, sub))
        return str(entry) if entry else f"0x{index:04X}:{sub}"

    def find(self, name: str) -> Entry:
        """The entry with this name, whatever its case.

        Raises:
            EdsError: none, or more than one.
        """
        found = [entry for entry in self.entries.values() if entry.name.lower() == name.lower()]
        if not found:
            raise EdsError(f"no object is called {name!r}: give its name in the EDS, or its index (0x6079, 0x2002:1)")
        if len(found) > 1:
            some = ", ".join(f"0x{one.index:04X}:{one.sub}" for one in found[:3])
            raise EdsError(f"{name!r} is the name of {len(found)} objects: give the index of one ({some}, ...)")
        return found[0]


def parse_eds(text: str, faults: list[str] | None = None) -> ObjectDictionary:
    """The object dictionary that an EDS describes. With `faults`, objects that cannot be understood are left out and
    named there: files of the field are often a little wrong.

    Raises:
        EdsError: not an EDS, or (without `faults`) one that lacks what CiA 306 demands of an object.
    """
    lenient = faults is not None
    parser = RawConfigParser(inline_comment_prefixes=(";",), strict=not lenient, allow_no_value=lenient)
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    try:
        parser.read_string(text)
    except ParserError as error:
        raise EdsError(f"not an EDS: {str(error).splitlines()[0]}") from None
    entries: dict[tuple[int, int], Entry] = {}
    names: dict[int, str] = {}
    for section in parser.sections():
        match = _SECTION.match(section)
        if match is None:
            continue
        index, sub = int(match[1], 16), match[2]
        fields = {key: value or "" for key, value in parser.items(section)}
        if sub is None:
            names[index] = fields.get("ParameterName", "")
        if not fields.get("DataType"):
            continue
        prefix = f"{names[index]}: " if sub is not None and index in names else ""
        try:
            found = _described(index, int(sub or "0", 16), prefix, fields, section)
        except EdsError as error:
            if faults is None:
                raise
            faults.append(str(error))
            continue
        entries.update({(entry.index, entry.sub): entry for entry in found})
    return ObjectDictionary(entries)


def _described(index: int, sub: int, prefix: str, fields: dict[str, str], section: str) -> list[Entry]:
    """The entry of a section; all of an array that is written in one (CompactSubObj, CiA 306, 4.6.4.2)."""
    entry = _entry(index, sub, prefix, fields, section)
    compact = fields.get("CompactSubObj", "")
    count = int(compact, 0) if compact.isalnum() else 0
    if not count:
        return [entry]
    length = replace(entry, name=f"{entry.name}: highest", data_type=DataType.UNSIGNED8, default=count)
    return [length, *(replace(entry, sub=n, name=f"{entry.name}: {n}") for n in range(1, count + 1))]


def _entry(index: int, sub: int, prefix: str, fields: dict[str, str], section: str) -> Entry:
    try:
        data_type = DataType(int(fields["DataType"], 0))
        default, adds_node_id = _default(fields.get("DefaultValue", ""), data_type)
        return Entry(
            index=index,
            sub=sub,
            name=prefix + fields["ParameterName"],
            data_type=data_type,
            access=fields["AccessType"].lower(),
            default=default,
            adds_node_id=adds_node_id,
            pdo_mapping=bool(int(fields.get("PDOMapping", "0") or "0", 0)),
        )
    except KeyError as error:
        raise EdsError(f"[{section}]: {error.args[0]} is missing") from None
    except ValueError as error:
        raise EdsError(f"[{section}]: {error}") from None


def _default(text: str, data_type: DataType) -> tuple[Value | None, bool]:
    if data_type is DataType.VISIBLE_STRING:
        return text, False
    if data_type not in _LAYOUT:
        return (bytes.fromhex(text) if text else None), False
    if not text:
        return None, False
    if data_type in _REAL:
        return float(text), False
    plain = text.replace(" ", "").upper()
    if _NODE_ID in plain:
        rest = plain.replace(_NODE_ID, "").strip("+")
        return (int(rest, 0) if rest else 0), True
    return int(plain, 0), False


@cache
def drive_dictionary() -> ObjectDictionary:
    """The object dictionary of the drives that this package describes."""
    return parse_eds(drive_eds_text())


def drive_eds_text() -> str:
    """The EDS file's text."""
    return resources.files("axisync_schemas").joinpath(DRIVE_EDS).read_text(encoding="ascii")
