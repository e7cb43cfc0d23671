"""docs/cell.md has every key of the cell file, and no other; its example is a cell."""

import re
from typing import Any

import pytest
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from axisync_schemas.cell import (
    Axis,
    Box,
    Bus,
    Capsule,
    Cell,
    Compound,
    DenavitHartenberg,
    Drive,
    Geometry,
    Group,
    Identity,
    JogSettings,
    Limits,
    LinearLimits,
    PathSettings,
    Pose,
    StopLimits,
    parse_cell,
)
from axisync_schemas.cell_drive import DriveUnits, Homing, Monitor, Watched, WatchedBit
from axisync_schemas.cell_recorder import Recording
from axisync_schemas.urdf import Urdf
from support.documents import ROOT

PAGE = (ROOT / "docs" / "cell.md").read_text(encoding="utf-8")
SECTIONS: dict[str, type[BaseModel]] = {
    "The file itself": Cell,
    "`[[buses]]`": Bus,
    "`[[groups]]`": Group,
    "Poses: `base`, `tool`, `pose`": Pose,
    "`[groups.urdf]`": Urdf,
    "`[groups.path]`": PathSettings,
    "`[groups.jog]`": JogSettings,
    "`[[groups.axes]]`": Axis,
    "`dh`": DenavitHartenberg,
    "`capsules`": Capsule,
    "`drive`": Drive,
    "`homing`": Homing,
    "`monitor`": Monitor,
    "`[[compounds]]`": Compound,
    "`[geometry]`": Geometry,
    "`[recorder]`": Recording,
}
NOT_WRITTEN = {"text"}
"""Filled in when the file is read."""
SMALL: dict[str, type[BaseModel]] = {
    "| `limits` |": Limits,
    "| `stop_limits` |": StopLimits,
    "| `linear_limits` |": LinearLimits,
    "| `angular_limits` |": Limits,
    "| `identity` |": Identity,
    "| `units` |": DriveUnits,
    "| `safe_torque_off` |": WatchedBit,
    "| `boxes` |": Box,
    "Values have": Watched,
}
"""Tables without a section: the line that names their keys."""


def rows(heading: str) -> dict[str, str]:
    """Default by key, of the section's table."""
    section = PAGE.split(f"### {heading}\n", 1)[1].split("\n### ", 1)[0]
    return dict(re.findall(r"^\| `(\w+)` \| (.*?) \|", section, re.MULTILINE))


def keys(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """As the file spells them."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def test_every_section_is_known() -> None:
    assert re.findall(r"^### (.*)$", PAGE, re.MULTILINE) == list(SECTIONS)


@pytest.mark.parametrize("heading", SECTIONS)
def test_a_table_has_the_keys_of_its_model(heading: str) -> None:
    assert set(rows(heading)) == set(keys(SECTIONS[heading])) - NOT_WRITTEN


@pytest.mark.parametrize("heading", SECTIONS)
def test_a_table_has_the_defaults_of_its_model(heading: str) -> None:
    table = rows(heading)
    for key, field in keys(SECTIONS[heading]).items():
        if key in NOT_WRITTEN:
            continue
        assert (table[key] == "needed") == field.is_required(), key
        if isinstance(field.default, bool | int | float | str):
            assert table[key] == _written(field.default), key
        elif isinstance(field.default, tuple) and field.default:
            assert table[key] == f"[{', '.join(map(_written, field.default))}]", key


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else f"{value:g}"


@pytest.mark.parametrize("begin", SMALL)
def test_a_line_names_the_keys_of_a_small_table(begin: str) -> None:
    (line,) = [line for line in PAGE.splitlines() if line.startswith(begin)]
    assert [key for key in keys(SMALL[begin]) if f"`{key}`" not in line] == []


def test_the_least_that_works_is_a_cell() -> None:
    (example,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    cell = parse_cell(example)
    assert (cell.name, cell.group_names, len(cell.axes)) == ("table", ("table",), 1)
