"""minimise, duration_s, pulse and speed_scale of plan and move, against the planner's library called directly."""

import itertools
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from axisync_client import Client, ErrorCode, Lease, Refused, deg
from axisync_motion import SyncProfile, from_profiles, synchronise
from axisync_schemas.cell import Cell
from axisync_schemas.replies import MoveReply
from support import logcheck
from support.cells import eod_text
from support.daemon import running, unhurried
from support.logread import Log, logs_in, read_log

pytestmark = pytest.mark.unhurried

GROUP = "kingkong"
TARGET = tuple(deg(40.0, -120.0, 30.0, -75.0, -15.0, 45.0))
"""30 to 40 deg away, axis 1 farthest; axis 6 rests but for what its start is off by, less than a count."""
STEP = np.array(deg(12.0, -6.0, 4.0, -3.0, 9.0, 0.0))
SHORT_S, LONG_S = 0.5, 6.5
MOVE_S = 60.0
PLANS = tuple(
    {"minimise": minimise, "pulse": pulse, "duration_s": duration, "speed_scale": scale}
    for minimise, pulse, duration, scale in itertools.product(
        ("acceleration", "velocity", "jerk"), ("constant", "parabolic"), (None, LONG_S), (1.0, 0.5)
    )
)
MOVES: tuple[dict[str, Any], ...] = (
    {"minimise": "acceleration"},
    {"minimise": "velocity"},
    {"minimise": "jerk"},
    {"pulse": "parabolic"},
    {"pulse": "parabolic", "minimise": "jerk", "duration_s": 3.0, "speed_scale": 0.75},
    {"duration_s": 2.5},
    {"speed_scale": 0.5},
)
Options = dict[str, Any]


@dataclass(frozen=True)
class Answer:
    """A plan or a move: what was asked, from where to where, and what was answered."""

    options: Options
    start: tuple[float, ...]
    target: tuple[float, ...]
    reply: MoveReply


@dataclass
class Recorded:
    """All that one daemon was asked, and its log."""

    cell: Cell
    log: Log
    plans: list[Answer]
    moves: list[Answer]
    refusals: dict[float, Refused] = field(default_factory=dict)


def words(options: Options) -> str:
    return "-".join(f"{value:g}" if isinstance(value, float) else str(value) for value in options.values())


def expected(cell: Cell, answer: Answer) -> SyncProfile:
    """The library on the cell's limits, at speed s: V s, A s^2, J s^3."""
    options = dict(answer.options)
    scale, duration = options.pop("speed_scale", 1.0), options.pop("duration_s", None)
    limits = [cell.axes[i].limits for i in cell.axis_indices(GROUP)]
    v, a, j = (
        [getattr(axis, name) * scale**power for axis in limits]
        for power, name in enumerate(("velocity", "acceleration", "jerk"), 1)
    )
    return synchronise(np.subtract(answer.target, answer.start), v, a, j, duration=duration, **options)


def start_of(client: Client) -> tuple[float, ...]:
    return client.state().groups[GROUP].setpoint


def planned(client: Client) -> list[Answer]:
    start = start_of(client)
    return [Answer(options, start, TARGET, client.plan_joint(GROUP, TARGET, **options)) for options in PLANS]


def refused(client: Client) -> dict[float, Refused]:
    found = {}
    for scale in (1.0, 0.5):
        with pytest.raises(Refused) as error:
            client.plan_joint(GROUP, TARGET, duration_s=SHORT_S, speed_scale=scale)
        found[scale] = error.value
    return found


def played(client: Client, arm: Lease) -> list[Answer]:
    """There and back in turns."""
    answers = []
    for number, options in enumerate(MOVES):
        start = start_of(client)
        target = tuple((np.array(start) + STEP * (-1.0) ** number).tolist())
        move = arm.move_joint(target, **options)
        move.result(MOVE_S)
        answers.append(Answer(options, start, target, move.reply))
    return answers


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    with running(tmp_path_factory.mktemp("plans"), unhurried(eod_text())) as daemon:
        with Client(daemon.endpoint) as client, client.lease(GROUP) as arm:
            cell = client.config()
            arm.enable()
            plans, refusals, moves = planned(client), refused(client), played(client, arm)
        assert daemon.stop() == 0, daemon.output
        return Recorded(cell, read_log(*logs_in(daemon.log_dir)), plans, moves, refusals)


def check(cell: Cell, answer: Answer) -> None:
    """The reply is what the library says."""
    reply, profile = answer.reply, expected(cell, answer)
    names = tuple(cell.axes[i].name for i in cell.axis_indices(GROUP))
    assert reply.scalars == names
    assert np.array(reply.T) == pytest.approx(profile.T, rel=1e-12, abs=1e-15)
    assert np.array(reply.U) == pytest.approx(profile.U, rel=1e-12, abs=0)
    assert reply.duration_s == pytest.approx(profile.duration, rel=1e-15)
    assert reply.minimum_s == pytest.approx(tuple(profile.minimum_durations), rel=1e-15)
    assert reply.limiting == names[profile.limiting] == f"{GROUP}.1"


@pytest.mark.parametrize("number", range(len(PLANS)), ids=map(words, PLANS))
def test_a_plan_is_the_librarys(recorded: Recorded, number: int) -> None:
    answer = recorded.plans[number]
    check(recorded.cell, answer)
    assert answer.reply.move_id is None
    if answer.options["duration_s"] is not None:
        assert answer.reply.duration_s == LONG_S


def test_half_the_speed_takes_twice_as_long(recorded: Recorded) -> None:
    for full, half in itertools.pairwise(recorded.plans):
        if full.options["speed_scale"] == 1.0 and full.options["duration_s"] is None:
            assert half.reply.minimum_s == pytest.approx(tuple(2.0 * t for t in full.reply.minimum_s), rel=1e-12)


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_too_short_a_duration_is_refused_with_the_shortest(recorded: Recorded, scale: float) -> None:
    plain = {"minimise": "acceleration", "pulse": "constant", "duration_s": None, "speed_scale": scale}
    (plan,) = [answer for answer in recorded.plans if answer.options == plain]
    refusal = recorded.refusals[scale]
    assert refusal.code is ErrorCode.INFEASIBLE_DURATION
    assert refusal.details["axis"] == f"{GROUP}.1"
    assert refusal.details["shortest_duration_s"] == plan.reply.duration_s


def rows_of(recorded: Recorded, number: int) -> Any:
    """Ticks of a move, from the one before it to the one after."""
    return recorded.log.ticks[logcheck.moves(recorded.log)[number].span]


def test_the_log_keeps_every_promise(recorded: Recorded) -> None:
    """Limits of all axes, parabolic jerk included; common departure and arrival; every end on its target."""
    assert logcheck.problems(recorded.log) == []
    moves = logcheck.moves(recorded.log)
    assert [logcheck.completed(recorded.log, move) for move in moves] == [True] * len(MOVES)


@pytest.mark.parametrize("number", range(len(MOVES)), ids=map(words, MOVES))
def test_a_move_is_the_librarys(recorded: Recorded, number: int) -> None:
    """As answered, and as every tick of the log has it, to its target."""
    answer, rows = recorded.moves[number], rows_of(recorded, number)
    check(recorded.cell, answer)
    profile = expected(recorded.cell, answer)
    states = from_profiles(answer.start, profile, answer.target).sample(rows["path_s"][1:-1, 0])
    axes = list(recorded.cell.axis_indices(GROUP))
    for name, values in zip(("position", "velocity", "acceleration"), states, strict=False):
        assert rows[name][1:-1][:, axes] == pytest.approx(values, rel=2 * logcheck.cut(name), abs=1e-12)
    assert tuple(rows["position"][-1, axes].tolist()) == answer.target
    ticks = profile.duration / recorded.cell.period
    assert len(rows) - 2 == pytest.approx(ticks, abs=2.0)


@pytest.mark.parametrize("number", range(len(MOVES)), ids=map(words, MOVES))
def test_the_jerk_steps_or_does_not(recorded: Recorded, number: int) -> None:
    """Axis 1 from tick to tick: a parabola rises no faster than 4 J / tj, a constant pulse at once."""
    answer = recorded.moves[number]
    times, peak = answer.reply.T[0], abs(answer.reply.U[0][0])
    step = np.abs(np.diff(rows_of(recorded, number)["jerk"][:, 0])).max()
    digits = 2 * logcheck.cut("jerk") * peak
    if answer.options.get("pulse") == "parabolic":
        assert step <= 4.0 * peak / times[0] * recorded.cell.period * (1 + 1e-9) + digits
    else:
        assert step >= peak - digits


@pytest.mark.parametrize(("power", "name"), [(1, "velocity"), (2, "acceleration"), (3, "jerk")])
def test_speed_scale_lowers_every_limit(recorded: Recorded, power: int, name: str) -> None:
    for number, options in enumerate(MOVES):
        limits = [getattr(recorded.cell.axes[i].limits, name) for i in recorded.cell.axis_indices(GROUP)]
        allowed = np.array(limits) * options.get("speed_scale", 1.0) ** power
        peaks = np.abs(rows_of(recorded, number)[name][:, : len(limits)]).max(axis=0)
        assert (peaks <= allowed * (1 + 1e-9)).all()


@pytest.mark.parametrize("name", ["acceleration", "velocity", "jerk"])
def test_each_map_lowers_its_own(recorded: Recorded, name: str) -> None:
    """Of axis 5, which has time to spare, in the log."""
    peaks = {MOVES[i]["minimise"]: np.abs(rows_of(recorded, i)[name][:, 4]).max() for i in range(3)}
    assert peaks[name] == min(peaks.values())
    assert max(peaks.values()) > 1.1 * peaks[name]
