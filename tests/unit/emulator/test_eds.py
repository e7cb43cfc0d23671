"""One EDS, two readers: the service's own parser and canopen's, and CiA 306's rules for the file itself."""

import io
from configparser import RawConfigParser

import pytest
from canopen.objectdictionary import ODVariable
from canopen.objectdictionary.eds import import_eds

from axisync_schemas.eds import DataType, EdsError, ObjectDictionary, drive_dictionary, drive_eds_text, parse_eds

NODE = 5


def sections() -> RawConfigParser:
    parser = RawConfigParser()
    parser.optionxform = str  # type: ignore[assignment]
    parser.read_string(drive_eds_text())
    return parser


def test_both_readers_agree_on_every_entry():
    other = import_eds(io.StringIO(drive_eds_text()), NODE)
    entries = drive_dictionary().entries
    for (index, sub), entry in entries.items():
        found = other[index] if isinstance(other[index], ODVariable) else other[index].subindices[sub]
        assert (found.data_type, found.access_type, found.default, found.pdo_mappable) == (
            entry.data_type, entry.access, entry.default_of(NODE), entry.pdo_mapping,
        )  # fmt: skip
        if entry.size is not None:
            value = entry.default_of(NODE)
            assert value is not None
            assert entry.pack(value) == found.encode_raw(value)
            assert entry.unpack(found.encode_raw(value)) == value
    assert len(entries) == sum(1 if isinstance(o, ODVariable) else len(o.subindices) for o in other.values())


def test_lists_of_objects_are_complete():
    parser = sections()
    listed: list[str] = []
    for name in ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects"):
        items = dict(parser.items(name))
        assert int(items.pop("SupportedObjects")) == len(items)
        listed += [value[2:].upper() for value in items.values()]
    assert sorted(listed) == sorted(name for name in parser.sections() if len(name) == 4)


def test_records_count_their_sub_indices():
    parser = sections()
    for name in parser.sections():
        if len(name) == 4 and parser.has_option(name, "SubNumber"):
            subs = [other for other in parser.sections() if other.startswith(f"{name}sub")]
            assert parser.getint(name, "SubNumber") == len(subs)


def test_defaults_are_those_of_the_node():
    dictionary = drive_dictionary()
    assert dictionary[0x1400, 1].default_of(NODE) == 0x205
    assert dictionary[0x1801, 1].default_of(NODE) == 0x80000285
    assert dictionary[0x1018, 1].default_of(NODE) == 0x41584953


@pytest.mark.parametrize(
    ("key", "value", "packed"),
    [
        ((0x6040, 0), 0x0F, "0f00"), ((0x607A, 0), -2, "feffffff"), ((0x6060, 0), 8, "08"), ((0x605A, 0), -1, "ffff"),
        ((0x1008, 0), "axis", "61786973"),
    ],
)  # fmt: skip
def test_values_and_their_bytes(key: tuple[int, int], value: int | str, packed: str):
    entry = drive_dictionary()[key]
    assert entry.pack(value).hex() == packed
    assert entry.unpack(bytes.fromhex(packed)) == value


def test_what_does_not_fit_is_refused_by_name():
    entry = drive_dictionary()[0x6040, 0]
    for value in (65536, -1, "a", 1.5):
        with pytest.raises(EdsError, match="0x6040:0 \\(Controlword\\)"):
            entry.pack(value)
    with pytest.raises(EdsError, match="3 bytes, must be 2"):
        entry.unpack(b"abc")


def test_names():
    dictionary = drive_dictionary()
    assert dictionary.find("controlword").index == 0x6040
    assert dictionary.describe(0x1018, 1) == "0x1018:1 (Identity object: Vendor-ID)"
    assert dictionary.describe(0x5FFF, 2) == "0x5FFF:2"
    with pytest.raises(EdsError, match="0x5FFF:2"):
        dictionary[0x5FFF, 2]
    with pytest.raises(EdsError, match="no object is called"):
        dictionary.find("Flux capacitor")
    twice = ObjectDictionary(dict.fromkeys(((0x6040, 0), (0x6840, 0)), dictionary[0x6040, 0]))
    with pytest.raises(EdsError, match=r"is the name of 2 objects: give the index of one \(0x6040:0, "):
        twice.find("controlword")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("no sections", "not an EDS"),
        ("[6040]\nDataType=0x0006\nAccessType=rw\n", "ParameterName is missing"),
        ("[6040]\nParameterName=a\nDataType=0x0099\nAccessType=rw\n", "6040"),
        ("[6040]\nParameterName=a\nDataType=6\nAccessType=rw\nDefaultValue=x\n", "6040"),
    ],
)
def test_broken_files(text: str, message: str):
    with pytest.raises(EdsError, match=message):
        parse_eds(text)


def test_other_types_and_notations():
    text = (
        "[2001]\nParameterName=a\nDataType=0x8\nAccessType=RO\nDefaultValue=1.5 ; comment\n"
        "[2002]\nParameterName=b\nObjectType=0x9\n"
        "[2002sub1]\nParameterName=c\nDataType=7\nAccessType=wo\nDefaultValue=0x10 + $NODEID\n"
        "[2003]\nParameterName=d\nDataType=0xA\nAccessType=rw\nDefaultValue=0A0b\n"
    )
    dictionary = parse_eds(text)
    assert (dictionary[0x2001, 0].default, dictionary[0x2001, 0].data_type) == (1.5, DataType.REAL32)
    entry = dictionary[0x2002, 1]
    assert (entry.name, entry.default_of(3), entry.readable, entry.writable) == ("b: c", 0x13, False, True)
    assert dictionary[0x2003, 0].default == b"\x0a\x0b"
