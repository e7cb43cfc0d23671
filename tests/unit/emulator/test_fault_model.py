"""Scripts and requests: what is accepted, and what is said about what is not."""

from pathlib import Path

import pytest

from axisync_emulator.faults.model import FaultError, Freeze, Lose, parse_fault, read_script

TOML = """
seed = 7
[[faults]]
kind = "lose"
bus = "kingkong"
id = 0x201
at_s = 2
count = 5
probability = 0.5

[[faults]]
kind = "freeze"
bus = "wukong"
node = 3
at_sync = 500
syncs = 10
"""


def test_a_script_in_toml_and_in_json(tmp_path: Path):
    toml, other = tmp_path / "a.toml", tmp_path / "a.json"
    toml.write_text(TOML)
    script = read_script(toml)
    assert script.seed == 7
    lose, freeze = script.faults
    assert isinstance(lose, Lose)
    assert (lose.id, lose.at_s, lose.count, lose.probability) == (0x201, 2.0, 5, 0.5)
    assert isinstance(freeze, Freeze)
    assert (freeze.node, freeze.at_sync, freeze.syncs) == (3, 500, 10)
    other.write_text(script.model_dump_json())
    assert read_script(other) == script


@pytest.mark.parametrize(("text", "message"), [
    ("nonsense", "a.toml: "),
    ("faults = 3", "faults: "),
    ('[[faults]]\nkind = "melt"\nbus = "kingkong"', "faults.0: .*'melt'.*'lose'"),
    ('[[faults]]\nkind = "reset"\nbus = "kingkong"', "faults.0.reset.node: Field required"),
    ('[[faults]]\nkind = "lose"\nbus = "kingkong"\nid = 0x801', "faults.0.lose.id: .*2047"),
    ('[[faults]]\nkind = "lose"\nbus = "kingkong"\nwhen = 3', "faults.0.lose.when: "),
])  # fmt: skip
def test_what_is_no_script(tmp_path: Path, text: str, message: str):
    path = tmp_path / "a.toml"
    path.write_text(text)
    with pytest.raises(FaultError, match=message) as error:
        read_script(path)
    assert all(line.startswith(str(path)) for line in str(error.value).splitlines())


def test_a_script_that_is_not_there(tmp_path: Path):
    with pytest.raises(FaultError, match=r"none\.toml"):
        read_script(tmp_path / "none.toml")


@pytest.mark.parametrize("fields", [
    {"at_s": 1.0, "at_sync": 3}, {"duration_s": 1.0, "syncs": 3}, {"probability": 0.0}, {"count": 0}, {"at_s": -1.0},
])  # fmt: skip
def test_what_contradicts_itself_or_is_out_of_range(fields: dict[str, object]):
    with pytest.raises(FaultError):
        parse_fault({"kind": "lose", "bus": "kingkong", **fields})


def test_identifiers_under_a_mask():
    every = parse_fault({"kind": "lose", "bus": "a"})
    tpdos = parse_fault({"kind": "lose", "bus": "a", "id": 0x180, "mask": 0x780})
    assert isinstance(every, Lose)
    assert isinstance(tpdos, Lose)
    assert every.meant(0x7FF)
    assert [can_id for can_id in (0x17F, 0x181, 0x1FF, 0x200) if tpdos.meant(can_id)] == [0x181, 0x1FF]
