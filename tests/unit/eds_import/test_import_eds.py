"""From an EDS to the cell file's drive section, and what is said about drives that lack something."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from axisync_schemas.cell import parse_cell
from axisync_schemas.eds import drive_eds_text, parse_eds
from axisync_service.eds_import import Imported, import_section
from axisync_service.main import app
from support.cells import eod_text

CELL = eod_text()
EDS = drive_eds_text()


def imported(directory: Path, text: str) -> Imported:
    path = directory / "drive.eds"
    path.write_text(text, encoding="latin-1")
    return import_section(path, "kingkong", 3)


def without(index: str) -> str:
    """Our own EDS, an object left out."""
    return re.sub(rf"\n\[{index}[^\]]*\]\n(?:[^\[\n].*\n|\n)*", "\n", EDS)


def test_our_own_drive_makes_a_section_that_the_cell_file_takes(tmp_path: Path) -> None:
    found = imported(tmp_path, EDS)
    assert not found.unusable
    head, _, rest = CELL.partition("[groups.defaults.drive]\n")
    _, _, tail = rest.partition("[[groups.axes]]")
    section = found.section.replace("node_id = 3 # each axis has its own\n", "")
    cell = parse_cell(f"{head}{section}\n\n[[groups.axes]]{tail}")
    identity = cell.axes[0].drive.identity
    assert (identity.vendor_id, identity.product_code) == (0x41584953, 1)
    assert '# monitor.temperature = { object = "0x2003:0"' in found.section
    assert '# monitor.safe_torque_off = { object = "0x2001:0"' in found.section


@pytest.mark.parametrize("index", ["60C2", "1600", "6085", "607A"])
def test_a_drive_without_what_is_needed_is_unusable(tmp_path: Path, index: str) -> None:
    found = imported(tmp_path, without(index))
    assert found.unusable
    assert f"0x{index}" in found.warnings[0]
    assert "is missing: the drive cannot be brought up" in found.warnings[0]


def test_a_drive_without_csp_is_unusable(tmp_path: Path) -> None:
    found = imported(tmp_path, EDS.replace("DefaultValue=0x000000A0", "DefaultValue=0x00000021"))
    assert found.unusable
    assert "cyclic synchronous position" in found.warnings[0]


def test_an_object_that_cannot_be_mapped_is_said(tmp_path: Path) -> None:
    section = re.search(r"\n\[6064\]\n(?:[^\[\n].*\n)*", EDS)
    assert section is not None
    found = imported(tmp_path, EDS.replace(section[0], section[0].replace("PDOMapping=1", "PDOMapping=0")))
    assert found.unusable
    assert "0x6064:0 (Position actual value) cannot be mapped into a PDO" in found.warnings


@pytest.mark.parametrize(
    ("index", "words"), [("1019", "no SYNC counter"), ("6007", "lost controller"), ("606C", "TPDO2")]
)
def test_what_is_only_missed_is_a_warning(tmp_path: Path, index: str, words: str) -> None:
    found = imported(tmp_path, without(index))
    assert not found.unusable
    assert any(words in warning for warning in found.warnings)


def test_files_of_the_field_are_a_little_wrong(tmp_path: Path) -> None:
    """An unknown type, a duplicate, a line that is none, and arrays written in one section."""
    text = without("1600") + (
        "\n[2100]\nParameterName=Odd\nDataType=0x0010\nAccessType=ro\n\n[2100]\nParameterName=Odd\nnonsense\n"
        "[1600]\nParameterName=RPDO mapping\nObjectType=0x9\nDataType=0x0007\nAccessType=rw\nCompactSubObj=8\n"
        "[608F]\nParameterName=Resolution\nSubNumber=3\n"
        "[608Fsub1]\nParameterName=Encoder increments\nDataType=0x0007\nAccessType=ro\nDefaultValue=0x80000\n"
    )
    found = imported(tmp_path, text)
    assert not found.unusable, found.warnings
    assert "counts_per_turn = 524288\n" in found.section
    assert any("[2100]" in warning for warning in found.warnings)


def test_compact_arrays() -> None:
    text = "[1600]\nParameterName=Map\nDataType=0x0007\nAccessType=rw\nCompactSubObj=2\n"
    entries = parse_eds(text).entries
    assert [(sub, entry.size) for (_, sub), entry in entries.items()] == [(0, 1), (1, 4), (2, 4)]


def test_the_command(tmp_path: Path) -> None:
    path = tmp_path / "drive.eds"
    path.write_text(EDS, encoding="ascii")
    result = CliRunner().invoke(app, ["import-eds", str(path), "--bus", "left", "--node", "7"])
    assert result.exit_code == 0
    assert 'bus = "left"\nnode_id = 7' in result.output
    path.write_text(without("60C2"), encoding="ascii")
    assert CliRunner().invoke(app, ["import-eds", str(path)]).exit_code == 1
    for broken in ("", "no ini file", "[nothing]\nhere=1\n"):
        path.write_text(broken, encoding="ascii")
        result = CliRunner().invoke(app, ["import-eds", str(path)])
        assert result.exit_code == 1
        assert "not an EDS" in result.output
    assert "cannot be read" in CliRunner().invoke(app, ["import-eds", str(tmp_path / "none.eds")]).output
