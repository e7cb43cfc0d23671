"""Snapshots from real shared memory."""

import time
from pathlib import Path
from typing import Any

import pytest

from axisync_schemas.cell import Cell, read_cell
from axisync_schemas.enumerations import GroupState, Phase
from axisync_schemas.internal import CONTROLLER_STATUS, BusStatus, ControllerStatus, DriveStatus, GroupStatus
from axisync_schemas.memory import STATUS_BYTES, Control, Mailbox, Word
from axisync_schemas.tick_ring import TickRing
from axisync_schemas.ticks import TickLayout
from axisync_service.actioner.world import World
from axisync_service.links.world_reader import STALE_NS, VELOCITY_TICKS, WorldReader

NOW = 10**12


class Rig:
    """The controller's side, by hand."""

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        self.layout = TickLayout(12, 2)
        self.ring = TickRing(bytearray(TickRing.size(self.layout, 64)), self.layout, 64)
        self.control = Control(bytearray(Control.size(2)), 2)
        self.status = Mailbox(bytearray(STATUS_BYTES))
        self.reader = WorldReader(cell, self.control, self.ring, self.status)

    def tick(self, tick: int, **fields: Any) -> None:
        record = self.layout.new()
        for name, value in fields.items():
            record[name] = value
        self.ring.write(tick, record)
        self.control[Word.CONTROLLER_TICK] = tick
        self.control[Word.CONTROLLER_NS] = NOW

    def say(self, now_ns: int = NOW, **group: Any) -> None:
        fields = {"state": 1, "plan_id": 0, "slot": -1, "reason": None, "ready": True} | group
        status = ControllerStatus(
            tick=1, now_ns=now_ns, groups=(GroupStatus(**fields),) * 2,
            drives=(DriveStatus(state=5, nmt=5, statusword=0, error_code=0, error=None),) * 12,
            buses=(BusStatus(state="up", load=0.5, sent=1, received=1, lost=0),) * 2, skipped_ticks=0,
        )  # fmt: skip
        self.status.write(CONTROLLER_STATUS.dump_json(status))

    def read(self, now_ns: int = NOW, since: int | None = NOW - 1) -> World:
        return self.reader.read(now_ns, Phase.RUNNING, since)


@pytest.fixture
def rig() -> Rig:
    cell, _ = read_cell(Path(__file__).parents[3] / "service" / "axisync_service" / "cells" / "eod.toml")
    return Rig(cell)


def test_before_the_first_tick(rig: Rig) -> None:
    world = rig.read()
    assert (world.up, world.tick, world.setpoint) == (False, 0, ())
    assert {view.state for view in world.groups} == {GroupState.DISABLED}


def test_the_newest_record_and_the_status(rig: Rig) -> None:
    for tick in range(1, 2 + VELOCITY_TICKS):
        rig.tick(tick, position=0.5, position_actual=0.1 * tick, group_state=[2, 1], plan_id=[77, 0], path_s=[0.25, 0])
    rig.say(slot=3, state=2, reason="because")
    world = rig.read()
    assert (world.up, world.tick) == (True, 1 + VELOCITY_TICKS)
    assert world.setpoint == (0.5,) * 12
    assert world.velocity == pytest.approx((0.1 / rig.cell.period,) * 12)
    moving, standing = world.groups
    assert (moving.state, moving.plan_id, moving.path_s, moving.slot) == (GroupState.MOVING, 77, 0.25, 3)
    assert (moving.reason, standing.reason) == ("because", None), "a reason counts for the state it was given for"


@pytest.mark.parametrize(
    ("now_ns", "since", "said_ns"),
    [(NOW + STALE_NS, NOW - 1, NOW), (NOW, None, NOW), (NOW, NOW, NOW - 1)],
    ids=["no cycle for too long", "not linked", "the status of an earlier controller"],
)
def test_down(rig: Rig, now_ns: int, since: int | None, said_ns: int) -> None:
    rig.tick(1, group_state=[2, 2])
    rig.say(said_ns)
    world = rig.read(now_ns, since)
    assert not world.up
    assert world.status is None
    assert {view.state for view in world.groups} == {GroupState.DISABLED}
    assert world.setpoint == (0.0,) * 12


def test_a_record_that_is_being_written_gives_way_to_the_one_before(rig: Rig) -> None:
    rig.tick(1, position=1.0)
    rig.say()
    rig.control[Word.CONTROLLER_TICK] = 2
    assert rig.read().tick == 1
    rig.tick(2, position=2.0)
    assert rig.read().setpoint[0] == 2.0


def test_a_snapshot_is_quick(rig: Rig) -> None:
    for tick in range(1, 20):
        rig.tick(tick)
    rig.say()
    best = min(_timed(rig) for _ in range(20))
    assert best < 0.001


def _timed(rig: Rig) -> float:
    before = time.perf_counter()
    rig.read()
    return time.perf_counter() - before
