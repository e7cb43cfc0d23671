"""minimise, duration_s, pulse and speed_scale of plan and move, against the planner's library called directly."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisync_client import Client, Move, Refused, deg
from axisync_motion import SyncProfile, from_profiles, synchronise
from axisync_schemas.cell import Cell
from axisync_schemas.replies import MoveReply
from support import logcheck
from support.daemon import Daemon, running
from support.logread import Log, read_log

GROUP = "kingkong"
TARGET = tuple(deg(40.0, -120.0, 30.0, -75.0, -15.0, 45.0))
"""Distances 40, 30, -30, -30, 30, 0 deg: axis 1 limits, the others have time to spare, one rests."""
STEP = tuple(deg(12.0, -6.0, 4.0, -3.0, 9.0, 0.0))
LONGER_S = 6.5
MOVE_S = 60.0
OPTIONS: tuple[dict[str, Any], ...] = (
    {"minimise": "acceleration"},
    {"minimise": "velocity"},
    {"minimise": "jerk"},
    {"pulse": "parabolic"},
    {"minimise": "jerk", "pulse": "parabolic", "duration_s": 2.5},
    {"duration_s": 2.5},
    {"speed_scale": 0.5},
)


@dataclass(frozen=True)
class Played:
    """One move: what was asked, what it began at, what was accepted."""

    options: dict[str, Any]
    start: tuple[float, ...]
    target: tuple[float, ...]
    reply: MoveReply


@dataclass
class Session:
    """A daemon with a client; `log` and `played` once it has been ended."""

    daemon: Daemon
    client: Client
    cell: Cell

    def start(self) -> tuple[float, ...]:
        return self.client.state().groups[GROUP].setpoint


def expected(
    cell: Cell,
    start: tuple[float, ...],
    target: tuple[float, ...],
    *,
    minimise: Any = "acceleration",
    duration_s: float | None = None,
    pulse: Any = "constant",
    speed_scale: float = 1.0,
) -> SyncProfile:
    """The library on the cell's limits: V s, A s^2, J s^3."""
    limits = [cell.axes[i].limits for i in cell.axis_indices(GROUP)]
    v, a, j = (
        [getattr(one, name) * speed_scale**power for one in limits]
        for power, name in enumerate(("velocity", "acceleration", "jerk"), 1)
    )
    distances = np.subtract(target, start)
    return synchronise(distances, v, a, j, minimise=minimise, duration=duration_s, pulse=pulse)


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    """One daemon for everything; plans first, since the log needs its end."""
    with running(tmp_path_factory.mktemp("plans")) as daemon, Client(daemon.endpoint) as client:
        yield Session(daemon, client, client.config())


def check(reply: MoveReply, profile: SyncProfile, cell: Cell) -> None:
    names = tuple(cell.axes[i].name for i in cell.axis_indices(GROUP))
    assert reply.scalars == names
    assert np.array(reply.T) == pytest.approx(profile.T, rel=1e-12, abs=0)
    assert np.array(reply.U) == pytest.approx(profile.U, rel=1e-12, abs=0)
    assert reply.duration_s == pytest.approx(profile.duration, rel=1e-15)
    assert reply.minimum_s == pytest.approx(tuple(profile.minimum_durations), rel=1e-15)
    assert reply.limiting == names[profile.limiting]


@pytest.mark.parametrize("speed_scale", [1.0, 0.5])
@pytest.mark.parametrize("pulse", ["constant", "parabolic"])
@pytest.mark.parametrize("duration_s", [None, LONGER_S])
@pytest.mark.parametrize("minimise", ["acceleration", "velocity", "jerk"])
def test_plan_is_the_librarys(session: Session, **options: Any) -> None:
    reply = session.client.plan_joint(GROUP, TARGET, **options)
    profile = expected(session.cell, session.start(), TARGET, **options)
    check(reply, profile, session.cell)
    assert reply.limiting == f"{GROUP}.1"
    assert reply.move_id is None
