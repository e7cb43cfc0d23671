"""Jogs in the cycle: they last as long as they are asked for, change their speed, and stop within the stop limits."""

import numpy as np
import pytest

from axisync_schemas.cell import parse_cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.events import EventKind
from axisync_schemas.internal import (
    JOG_LAPSED,
    JOG_RELEASED,
    BeginCommand,
    GroupCommand,
    Jog,
    JogCommand,
    OverrideCommand,
    PlanJob,
)
from axisync_schemas.memory import PLAN_SLOT_BYTES
from axisync_schemas.plan_slots import PlanReader, write_plan
from axisync_service.motion_controller.step import Core
from axisync_service.planner.jog_plan import plan_jog
from axisync_service.planner.models import Models
from support.cells import eod_text
from support.ideal_drive import Bench

TEXT = eod_text()
CELL = parse_cell(TEXT)
MODELS = Models(CELL)
PERIOD = 0.002
TTL_TICKS = 100
STOP_LIMITS = np.radians([30.0, 60.0, 240.0])
LIMITS = np.radians([30.0, 40.0, 80.0])
JOINT = (0.2, 0.1, 0.0, 0.0, 0.0, -0.1)


class Jogger:
    """KingKong, enabled; jogs are planned for real and begun as front would."""

    def __init__(self) -> None:
        self._plans = bytearray(PLAN_SLOT_BYTES)
        self.bench = Bench(CELL, Core(CELL, lambda slot, plan_id: PlanReader(self._plans, slot, plan_id)))
        self.bench.run(2)
        self.bench.commands = [GroupCommand(op="enable", ref=1, group="all")]
        self.bench.run(60)
        self.bench.rows.clear()
        self.plan_id = 10
        self._ref = 10

    @property
    def state(self) -> GroupState:
        return self.bench.core.groups[0].state

    def begin(self, velocity: tuple[float, ...] = JOINT, space: str = "joint", until: int = TTL_TICKS) -> object:
        """Plans from the setpoint, and begins; what the controller says."""
        self.plan_id += 1
        rest = tuple(self.bench.core.current.position.tolist())
        move = Jog.model_validate({"space": space, "velocity": velocity})
        job = PlanJob(
            ref=1, group="kingkong", plan_id=self.plan_id, slot=0, start=rest[:6], rest=rest, move=move, speed_scale=1.0
        )
        plan = plan_jog(MODELS, job).plan
        assert plan is not None
        write_plan(self._plans, 0, plan)
        until_ns = self.bench.now_ns + until * CELL.period_ns
        return self.send(
            BeginCommand(
                ref=self._next(), group="kingkong", plan_id=self.plan_id, slot=0, epochs=(1,),
                stop_counts=(self.bench.stops[0],), jog_until_ns=until_ns,
            )
        )  # fmt: skip

    def go_on(self, share: float = 1.0, until: int = TTL_TICKS, plan_id: int | None = None) -> object:
        until_ns = self.bench.now_ns + until * CELL.period_ns
        number = self.plan_id if plan_id is None else plan_id
        return self.send(JogCommand(ref=self._next(), group="kingkong", plan_id=number, until_ns=until_ns, share=share))

    def send(self, command: BeginCommand | JogCommand) -> object:
        self.bench.commands = [command]
        self.bench.run(2 if isinstance(command, BeginCommand) else 1)
        while command.ref not in self.bench.replies:
            self.bench.run()
        return self.bench.replies.pop(command.ref)

    def hold_key(self, ticks: int, share: float = 1.0) -> None:
        """Asked for ten times a second."""
        for _ in range(ticks // 50):
            assert self.go_on(share) is None
            self.bench.run(49)

    def rest(self, most: int = 4000) -> int:
        """Ticks until it stands."""
        for tick in range(most):
            if self.state is GroupState.STANDSTILL:
                return tick
            self.bench.run()
        raise AssertionError(f"{self.state!r} after {most} ticks")

    def check(self, limits: np.ndarray) -> None:
        """Velocity, acceleration and jerk of all ticks, as said and by differences of positions; soft limits."""
        rows = [np.array([row[k] for row in self.bench.rows])[:, :6] for k in range(4)]
        for values, bound in zip(rows[1:], limits, strict=True):
            assert np.abs(values).max() <= bound * (1 + 1e-6)
        for power, bound in enumerate(limits, start=1):
            differences = np.diff(rows[0], n=power, axis=0) / PERIOD**power
            assert np.abs(differences).max() <= bound * (1 + 1e-6) + 1e-14 / PERIOD**power
        low, high = np.array([axis.soft_limits for axis in CELL.axes[:6]]).T
        assert (rows[0] >= low).all()
        assert (rows[0] <= high).all()

    def endings(self) -> list[object]:
        return [e.details["reason"] for e in self.bench.events if e.kind is EventKind.MOVE_ENDED]

    def _next(self) -> int:
        self._ref += 1
        return self._ref


@pytest.fixture
def jogger() -> Jogger:
    return Jogger()


def test_it_moves_while_it_is_asked_for_and_stops_when_it_is_not(jogger: Jogger) -> None:
    assert jogger.begin() is None
    assert jogger.state is GroupState.JOGGING
    jogger.hold_key(600)
    assert jogger.state is GroupState.JOGGING
    np.testing.assert_allclose(jogger.bench.core.current.velocity[:6], JOINT, rtol=1e-9)
    began = len(jogger.bench.rows)
    ticks = jogger.rest()
    moving = np.abs(np.array([row[1] for row in jogger.bench.rows[began:]])[:, 0])
    cruising = int((moving > 0.2 - 1e-9).sum())
    assert TTL_TICKS - 50 <= cruising <= TTL_TICKS + 2, "the time that the last request gave"
    # From 0.2 rad/s within 60 deg/s^2 and 240 deg/s^3 by the shortest way: 0.45 s.
    assert (ticks - cruising) * PERIOD < 0.6
    assert jogger.endings() == [JOG_LAPSED]
    jogger.check(STOP_LIMITS)


def test_one_that_is_late_never_begins(jogger: Jogger) -> None:
    reply = jogger.begin(until=-1)
    assert isinstance(reply, ErrorBody)
    assert reply.code is ErrorCode.STALE
    assert jogger.state is GroupState.STANDSTILL


def test_let_go(jogger: Jogger) -> None:
    jogger.begin()
    jogger.hold_key(400)
    assert jogger.go_on(share=0.0) is None
    assert jogger.state is GroupState.STOPPING
    jogger.rest()
    assert jogger.endings() == [JOG_RELEASED]
    jogger.check(STOP_LIMITS)


def test_another_share_of_its_velocity(jogger: Jogger) -> None:
    jogger.begin()
    jogger.hold_key(500)
    jogger.hold_key(600, share=0.25)
    np.testing.assert_allclose(jogger.bench.core.current.velocity[:6], 0.25 * np.array(JOINT), rtol=1e-9)
    jogger.hold_key(600)
    np.testing.assert_allclose(jogger.bench.core.current.velocity[:6], JOINT, rtol=1e-9)
    said = [e.details["share"] for e in jogger.bench.events if e.kind is EventKind.JOG_SPEED]
    assert said == [0.25, 1.0]
    jogger.check(LIMITS)


def test_an_override_counts_for_jogs(jogger: Jogger) -> None:
    jogger.begin()
    jogger.bench.commands = [OverrideCommand(ref=5, group="kingkong", value=0.5)]
    jogger.bench.run()
    jogger.hold_key(1500, share=0.5)
    np.testing.assert_allclose(jogger.bench.core.current.velocity[:6], 0.25 * np.array(JOINT), rtol=1e-9)


def test_a_sign_of_life_for_another_jog_is_none(jogger: Jogger) -> None:
    jogger.begin()
    reply = jogger.go_on(plan_id=jogger.plan_id - 1)
    assert isinstance(reply, ErrorBody)
    assert reply.code is ErrorCode.WRONG_STATE
    jogger.rest()
    reply = jogger.go_on()
    assert isinstance(reply, ErrorBody)


@pytest.mark.parametrize("what", ["stop", "hold", "lease", "front", "disable", "end"])
def test_whatever_ends_it_ends_it_for_good(jogger: Jogger, what: str) -> None:
    jogger.begin()
    jogger.hold_key(300)
    bench = jogger.bench
    if what == "stop":
        bench.stops[0] += 1
    elif what in ("hold", "disable"):
        bench.commands = [GroupCommand.model_validate({"op": what, "ref": 5, "group": "kingkong"})]
    elif what == "lease":
        bench.leases[0] = 0
    elif what == "front":
        bench.front = False
    else:
        bench.stopping = True
    bench.run(2)
    assert jogger.state is GroupState.STOPPING
    reply = jogger.go_on()
    assert isinstance(reply, ErrorBody)
    wanted = GroupState.DISABLED if what in ("disable", "end") else GroupState.STANDSTILL
    for _ in range(2000):
        if jogger.state is wanted:
            break
        bench.run()
    assert jogger.state is wanted
    assert GroupState.HELD.label not in [e.details.get("after") for e in bench.events]
    (reason,) = jogger.endings()
    assert reason not in (None, JOG_LAPSED, JOG_RELEASED)
    rows = np.array([row[3] for row in bench.rows])[:, :6]
    assert np.abs(rows).max() <= STOP_LIMITS[2] * (1 + 1e-6)


def test_the_soft_limit_ends_it_at_rest_and_it_goes_back(jogger: Jogger) -> None:
    high = CELL.axes[5].soft_limits[1]
    jogger.begin((0.0, 0.0, 0.0, 0.0, 0.0, 2.0))
    while jogger.state is GroupState.JOGGING:
        jogger.go_on()
        jogger.bench.run(49)
    jogger.bench.run(2)
    assert jogger.bench.core.current.position[5] == high
    assert jogger.endings()[-1] is None
    jogger.begin((0.0, 0.0, 0.0, 0.0, 0.0, -0.3))
    jogger.hold_key(400)
    assert jogger.bench.core.current.position[5] < high - 0.05
    jogger.check(STOP_LIMITS)


@pytest.mark.parametrize("seed", range(2))
def test_random_velocities_at_random_instants(seed: int) -> None:
    """What an operator does who cannot make up their mind: everything within the stop limits at every tick."""
    rng = np.random.default_rng(seed)
    jogger = Jogger()
    for _ in range(6):
        jogger.rest()
        space = str(rng.choice(["joint", "base", "tool"]))
        velocity = rng.normal(0.0, 0.3, 6) if space == "joint" else rng.normal(0.0, 1.0, 6) * ([0.08] * 3 + [0.3] * 3)
        if jogger.begin(tuple(velocity.tolist()), space) is not None:
            continue
        for _ in range(int(rng.integers(1, 12))):
            if jogger.state is not GroupState.JOGGING:
                break
            jogger.go_on(float(rng.choice([1.0, rng.uniform(0.05, 1.0), 0.0], p=[0.5, 0.4, 0.1])))
            jogger.bench.run(int(rng.integers(1, 90)))
        if rng.random() < 0.3:
            jogger.bench.stops[0] += 1
    jogger.rest()
    jogger.check(STOP_LIMITS)
