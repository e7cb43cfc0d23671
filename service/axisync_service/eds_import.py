"""`axisyncd import-eds`: from a drive's EDS (CiA 306) to the cell file's drive section, with what the drive lacks."""

import configparser
from dataclasses import dataclass
from pathlib import Path

from axisync_schemas.eds import DataType, EdsError, Entry, ObjectDictionary, drive_dictionary, parse_eds
from axisync_service.canopen import pdo
from axisync_service.drives.configuration import CSP_SUPPORTED

_MODES, _RESOLUTION, _VOLTAGE, _INPUTS = (0x6502, 0), (0x608F, 1), (0x6079, 0), (0x60FD, 0)
_HOMING_SUPPORTED = 1 << 5
_NEEDED = (
    (0x1016, 1), (0x1017, 0), (0x1018, 1), (0x1018, 2), (0x1400, 1), (0x1400, 2), (0x1600, 0), (0x1600, 1), (0x1600, 2),
    (0x1800, 1), (0x1800, 2), (0x1A00, 0), (0x1A00, 1), (0x1A00, 2), (0x6040, 0), (0x6041, 0), (0x605A, 0), (0x6060, 0),
    (0x6064, 0), (0x607A, 0), (0x6085, 0), (0x60C2, 1), (0x60C2, 2),
)  # fmt: skip
"""Without one of these the drive cannot be brought up."""
_WANTED = {
    (0x1006, 0): "the drive does not know the SYNC period: it cannot notice a lost SYNC",
    (0x1019, 0): "no SYNC counter: a skipped cycle is not seen as one",
    (0x1029, 1): "after an error of communication the drive may leave NMT operational",
    (0x1400, 5): "no time-out of RPDOs",
    (0x1801, 6): "TPDO2 is not staggered",
    (0x6007, 0): "the drive's answer to a lost controller cannot be set",
    (0x605E, 0): "the drive's reaction to a fault cannot be set",
    (0x6065, 0): "no following error window in the drive",
    (0x6061, 0): "the mode cannot be read back: no homing",
    (0x6084, 0): "the deceleration of a shut-down cannot be set",
    (0x607D, 1): "no position limits in the drive",
}
"""Optional objects, and what is missed without them."""
_TEMPERATURE, _TORQUE_OFF = ("temperature",), ("safe torque", "sto ", "sto state")


@dataclass(frozen=True, slots=True)
class Imported:
    """What came of an EDS.

    Attributes:
        section: text for the cell file. warnings: one sentence each. unusable: the service cannot work with this drive.
    """

    section: str
    warnings: tuple[str, ...]
    unusable: bool


def import_section(path: Path, bus: str, node: int) -> Imported:
    """Reads an EDS.

    Raises:
        EdsError: it cannot be read, or is none.
    """
    try:
        text = path.read_text(encoding="latin-1")
    except OSError as error:
        raise EdsError(f"cannot be read: {error.strerror}") from None
    faults: list[str] = []
    dictionary = parse_eds(text, faults)
    if not dictionary.entries:
        raise EdsError("not an EDS: it has no objects")
    fatal = [*_missing(dictionary), *_no_csp(dictionary), *_not_mappable(dictionary)]
    warnings = [*fatal, *_wrong_types(dictionary), *_lacks(dictionary), *faults]
    return Imported(_section(dictionary, _device(text), bus, node), tuple(warnings), bool(fatal))


# --- the section --------------------------------------------------------------------------------------------------


def _section(dictionary: ObjectDictionary, device: dict[str, str], bus: str, node: int) -> str:
    counts = _number(dictionary, _RESOLUTION)
    lines = [
        f"# {device.get('vendorname', 'unknown vendor')}: {device.get('productname', 'unknown product')}",
        "[groups.defaults.drive] # or in an axis: drive = { ... }",
        f'bus = "{bus}"',
        f"node_id = {node} # each axis has its own",
        f"counts_per_turn = {counts}" if counts else "counts_per_turn = 1048576 # a guess: see the drive's manual",
        "gear_ratio = 1.0 # turns of the encoder for one turn of the axis",
        "direction = 1",
        "offset_deg = 0.0 # position of the axis where the drive's counts are 0",
        'on_missed = "extrapolate" # "hold" where the drive does not interpolate on over a missed target',
        "following_error_max_deg = 2.0",
        "quick_stop_deceleration_deg_s2 = 90",
        "brake_release_ms = 60 # 0 is not allowed: without a brake, 1",
        f"identity = {{ vendor_id = {_identity(dictionary, device, 1, 'vendornumber')}, "
        f"product_code = {_identity(dictionary, device, 2, 'productnumber')} }}",
        'encoder = "absolute" # "incremental" needs homing',
        *_monitor(dictionary),
    ]
    return "\n".join(lines)


def _identity(dictionary: ObjectDictionary, device: dict[str, str], sub: int, key: str) -> str:
    """The EDS's default of 0x1018, or what its DeviceInfo says; 0 where neither does."""
    text = device.get(key, "0")
    try:
        said = int(text or "0", 0)
    except ValueError:
        said = 0
    return f"0x{_number(dictionary, (0x1018, sub)) or said:08X}"


def _monitor(dictionary: ObjectDictionary) -> list[str]:
    lines = []
    if _VOLTAGE in dictionary:
        lines.append('monitor.voltage = { object = "0x6079", scale = 0.001 } # V; low and high are its bounds')
    temperature, torque_off = _named(dictionary, _TEMPERATURE), _named(dictionary, _TORQUE_OFF)
    if temperature:
        place, name = _place(temperature), temperature.name
        lines.append(f'# monitor.temperature = {{ object = "{place}", scale = 1.0 }} # {name}')
    if torque_off:
        place, name = _place(torque_off), torque_off.name
        lines.append(f'# monitor.safe_torque_off = {{ object = "{place}", mask = 1 }} # {name}')
    elif _INPUTS in dictionary:
        lines.append('# monitor.safe_torque_off = { object = "0x60FD", mask = 0x8 } # interlock, if the drive has it')
    if _number(dictionary, _MODES) & _HOMING_SUPPORTED:
        lines.append("# homing = { method = 37 }")
    return lines


def _named(dictionary: ObjectDictionary, words: tuple[str, ...]) -> Entry | None:
    """The first object that can be read and whose name has one of the words."""
    for entry in dictionary.entries.values():
        name = f"{entry.name.lower()} "
        if entry.index >= 0x2000 and entry.readable and entry.size and any(word in name for word in words):
            return entry
    return None


def _place(entry: Entry) -> str:
    return f"0x{entry.index:04X}:{entry.sub}"


def _number(dictionary: ObjectDictionary, key: tuple[int, int]) -> int:
    entry = dictionary.entries.get(key)
    return entry.default if entry is not None and isinstance(entry.default, int) else 0


def _device(text: str) -> dict[str, str]:
    parser = configparser.RawConfigParser(inline_comment_prefixes=(";",), strict=False, allow_no_value=True)
    parser.read_string(text)
    items = parser.items("DeviceInfo") if parser.has_section("DeviceInfo") else []
    return {key: value or "" for key, value in items}


# --- what is wrong ------------------------------------------------------------------------------------------------


def _missing(dictionary: ObjectDictionary) -> list[str]:
    own = drive_dictionary()
    absent = [key for key in _NEEDED if key not in dictionary]
    return [f"{own.describe(*key)} is missing: the drive cannot be brought up" for key in absent]


def _no_csp(dictionary: ObjectDictionary) -> list[str]:
    if _MODES not in dictionary:
        return []
    modes = _number(dictionary, _MODES)
    if not modes:
        return []  # Many an EDS leaves it to the drive, which is asked at bring-up.
    lacks = f"{dictionary.describe(*_MODES)} = 0x{modes:08X} does not have cyclic synchronous position (bit 7)"
    return [] if modes & CSP_SUPPORTED else [lacks]


def _not_mappable(dictionary: ObjectDictionary) -> list[str]:
    mapped = [*pdo.RPDO1_MAPPING, *pdo.TPDO1_MAPPING]
    keys = [(entry >> 16, entry >> 8 & 0xFF) for entry in mapped]
    found = [dictionary.entries[key] for key in keys if key in dictionary]
    return [f"{entry} cannot be mapped into a PDO" for entry in found if not entry.pdo_mapping]


def _wrong_types(dictionary: ObjectDictionary) -> list[str]:
    """Objects that the service writes with the type of its own EDS."""
    own, differ = drive_dictionary(), []
    for key in (*_NEEDED, *_WANTED):
        ours, theirs = own.entries.get(key), dictionary.entries.get(key)
        if ours and theirs and ours.size != theirs.size:
            differ.append(f"{theirs} is {DataType(theirs.data_type).name}, the profile says {ours.data_type.name}")
    return differ


def _lacks(dictionary: ObjectDictionary) -> list[str]:
    own = drive_dictionary()
    missing = [f"{own.describe(*key)} is missing: {why}" for key, why in _WANTED.items() if key not in dictionary]
    second = [(entry >> 16, entry >> 8 & 0xFF) for entry in pdo.TPDO2_MAPPING]
    if (0x1801, 1) not in dictionary or not all(k in dictionary and dictionary[k].pdo_mapping for k in second):
        missing.append("no TPDO2 with 0x606C and 0x6077: neither velocity nor torque is reported")
    if _RESOLUTION not in dictionary:
        missing.append("0x608F (position encoder resolution) is missing: set counts_per_turn by the drive's manual")
    return missing
