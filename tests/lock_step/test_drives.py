"""The real cycle against emulated drives, without a real clock: bring-up with a foreign drive, homing, maintenance."""

import math
from pathlib import Path

import numpy as np
import pytest

from axisync_schemas.cell import parse_cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.errors import ErrorCode
from axisync_schemas.internal import ControllerReply, DriveCommand, GroupCommand
from support.cells import eod_text, small
from support.lock_step import Run, Script, Steps, conduct, emulated

TICKS_UP = 400


def wait(ticks: int) -> Steps:
    for _ in range(ticks):
        yield None


def run(directory: Path, drives: str, service: str, steps: Steps, homed: dict[str, int] | None = None) -> Run:
    """Drives by one cell file, the service by another."""
    directory.mkdir(exist_ok=True)
    cell_file = directory / "drives.toml"
    cell_file.write_text(drives, encoding="utf-8")
    cell = parse_cell(service).on_simcan(str(directory))
    with emulated(cell_file, directory):
        return conduct(cell, Script(steps), [], homed=homed)


def test_a_foreign_drive_keeps_its_group_down_and_the_other_works(tmp_path: Path) -> None:
    text = small(eod_text())
    service = text.replace(
        "drive = { node_id = 2,", "drive = { identity = { vendor_id = 1, product_code = 9 }, node_id = 2,", 1
    )
    replies: list[ControllerReply | None] = []

    def steps() -> Steps:
        yield from wait(TICKS_UP)
        replies.append((yield GroupCommand(op="enable", ref=0, group="kingkong")))
        replies.append((yield GroupCommand(op="enable", ref=0, group="wukong")))

    done = run(tmp_path, text, service, steps())
    first, second = replies
    assert first is not None
    assert first.error is not None
    assert first.error.code is ErrorCode.UNAVAILABLE
    assert first.error.message == (
        "kingkong cannot be enabled: axis kingkong.2 (bus kingkong, node 2): vendor_id is 0x41584953, "
        "the cell file says 0x00000001: stays pre-operational"
    )
    assert second is not None
    assert second.error is None
    states = done.records["group_state"]
    assert set(states[:, 0]) == {GroupState.DISABLED}
    assert GroupState.STANDSTILL in states[:, 1]
    kinds = [event.kind.value for event in done.happenings]
    assert (kinds.count("drive_ready"), kinds.count("bring_up_failed")) == (3, 1)


def test_velocity_torque_and_health_are_reported(tmp_path: Path) -> None:
    text = small(eod_text())
    seen: list[tuple[object, ...]] = []

    def look(cycle, _tick: int) -> None:  # type: ignore[no-untyped-def]
        drive = cycle.core.drives[1]
        voltage, temperature, flag = drive.health.voltage, drive.health.temperature, drive.health.safe_torque_off
        seen.append((drive.velocity, drive.torque, voltage.value, temperature.value, flag.value))

    cell_file = tmp_path / "drives.toml"
    cell_file.write_text(text, encoding="utf-8")
    with emulated(cell_file, tmp_path):
        conduct(parse_cell(text).on_simcan(str(tmp_path)), Script(wait(700)), [], look)
    velocity, torque, voltage, temperature, torque_off = seen[-1]
    assert velocity == pytest.approx(0.0, abs=1e-2)
    assert torque is not None
    assert voltage == pytest.approx(48.0, abs=5.0)
    assert temperature == pytest.approx(30.0, abs=20.0)
    assert torque_off is False


def test_drives_find_home_where_they_stand(tmp_path: Path) -> None:
    text = small(eod_text()).replace(
        "drive = { node_id = 2,", "drive = { homing = { method = 37 }, offset_deg = 12, node_id = 2,", 1
    )
    replies: list[ControllerReply | None] = []

    def steps() -> Steps:
        yield from wait(TICKS_UP)
        replies.append((yield GroupCommand(op="enable", ref=0, group="kingkong")))
        replies.append((yield GroupCommand(op="home", ref=0, group="kingkong")))
        yield from wait(50)
        replies.append((yield DriveCommand(ref=0, axis=1, index=0x6061, sub=0)))

    done = run(tmp_path, text, text, steps())
    assert [reply.error for reply in replies if reply is not None] == [None, None, None]
    assert replies[2] is not None
    assert replies[2].data == "08"
    states = done.records["group_state"][:, 0]
    assert GroupState.HOMING in states
    after = done.records[np.flatnonzero(states == GroupState.HOMING)[-1] + 1 :]
    standing = after[after["group_state"][:, 0] == GroupState.STANDSTILL]
    assert np.allclose(standing["position"][:, 1], math.radians(12), atol=1e-4)
    assert np.allclose(standing["position_actual"][:, 1], math.radians(12), atol=1e-4)
    assert "axis_homed" in [event.kind.value for event in done.happenings]
    assert "drive_fault" not in [event.kind.value for event in done.happenings]


def test_maintenance_of_a_real_drive(tmp_path: Path) -> None:
    text = small(eod_text())
    replies: list[ControllerReply | None] = []

    def steps() -> Steps:
        yield from wait(TICKS_UP)
        replies.append((yield DriveCommand(ref=0, axis=0, index=0x1008, sub=0)))
        replies.append((yield DriveCommand(ref=0, axis=0, index=0x6073, sub=0, value=1234)))
        replies.append((yield DriveCommand(ref=0, axis=0, index=0x6041, sub=0, data="0000")))

    run(tmp_path, text, text, steps())
    name, written, refused = replies
    assert name is not None
    assert "axisync" in bytes.fromhex(name.data or "").decode()
    assert written is not None
    assert written.data == "d204"
    assert refused is not None
    assert refused.error is not None
    assert "abort 0x06010002: attempt to write a read-only object" in refused.error.message
