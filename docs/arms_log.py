"""The moves of arms.md's pictures: played by a client on a service of its own, and found again in a log."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from axisync_client import Client, ErrorCode, Lease, MoveStatus, Program, Refused, moves
from axisync_client import Move as Running
from axisync_client.moves import AnyMove
from axisync_client.program import load
from axisync_schemas.cell import override
from axisync_schemas.moves import Dwell, Move, SequenceMove
from axisync_service.demo import PATIENT
from support.cells import eod_text
from support.daemon import running
from support.logread import Log, logs_in, read_log

Array = NDArray[np.float64]

PROGRAMS = Path(__file__).parents[1] / "service" / "axisync_service" / "programs"
P2 = (100.0, -90.0, -60.0, -120.0, 45.0, 45.0)
START = (-90.0, -150.0, 45.0, -90.0, -90.0, -90.0)
"""Where V.B.1 ends, and where the line of V.B.2 begins, deg."""
ATTEMPTS = 3
LATE = PATIENT | {"missed_ticks_max": 30}
BRAKES = "quick_stop_deceleration_deg_s2 = "
"""A busy machine's emulated drives are allowed to be late; that they get no farther alone, they brake harder for it."""

_MOVE: TypeAdapter[AnyMove] = TypeAdapter(Move)


class NotInLog(LookupError):
    """A move is not in the log, or was not played to its end."""


def _degrees(values: tuple[float, ...]) -> list[float]:
    return [math.radians(value) for value in values]


def _paper_line(pulse: moves.Pulse) -> Program:
    move = moves.linear(
        (-0.0928, -0.2528, 0.38), euler_zyz=_degrees((120.0, 120.0, -160.0)), orientation="euler_zyz", pulse=pulse
    )
    return Program(name=f"line, {pulse}", group="kingkong", move=move)


def parabolic(program: Program) -> Program:
    """The same program with continuous jerk in every step."""
    assert isinstance(program.move, SequenceMove)
    smooth = {"pulse": "parabolic"}
    steps = [step if isinstance(step, Dwell) else step.model_copy(update=smooth) for step in program.move.steps]
    return program.model_copy(update={"name": f"{program.name}, parabolic", "move": moves.sequence(steps)})


def _joint(name: str, target: tuple[float, ...]) -> Program:
    return Program(name=name, group="kingkong", move=moves.joint(_degrees(target)))


CHANGE, POINTS = load(PROGRAMS / "tool_change.toml"), load(PROGRAMS / "wukong_points.toml")
TO_P2, LINE, LINE_PARABOLIC = _joint("P1 to P2", P2), _paper_line("constant"), _paper_line("parabolic")
CHANGE_PARABOLIC = parabolic(CHANGE)
BACK = _joint("back to where the line begins", START)
PLAYED = (TO_P2, BACK, LINE, BACK, LINE_PARABOLIC, BACK, CHANGE, BACK, CHANGE_PARABOLIC, POINTS)
"""In the order in which they are played, from where the demo's arms stand at first."""


def play(directory: Path) -> Log:
    """Plays everything on a service that logs into `directory`.

    Raises:
        AxisyncError: refused. NotInLog: a move did not arrive.
    """
    cell = override(eod_text(), LATE).replace(f"{BRAKES}90", f"{BRAKES}400")
    with running(directory, cell) as daemon:
        with Client(daemon.endpoint) as client, client.lease("both", ttl_s=30.0) as lease:
            lease.enable()
            for program in PLAYED:
                report = _run(lease, program).wait()
                if report.status is not MoveStatus.SUCCEEDED:
                    raise NotInLog(f"{program.name} was {report.status.value}: {report.reason}")
            lease.disable()
        daemon.stop()
        return read_log(*logs_in(daemon.log_dir))


def _run(lease: Lease, program: Program) -> Running:
    """On a machine that is too busy, planning may take too long: once more, then."""
    for _ in range(ATTEMPTS - 1):
        try:
            return lease.run_program(program)
        except Refused as refusal:
            if refusal.code is not ErrorCode.INTERNAL:
                raise
    return lease.run_program(program)


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """A move as the log has it, tick by tick.

    Attributes:
        times: [k] s since its first tick; states: [4, k, n] setpoints: position, velocity, acceleration, jerk; rad.
        steps: [s] s, when each step of a sequence begins; scale: as the daemon replied.
    """

    times: Array
    states: Array
    duration: float
    scale: float
    steps: tuple[float, ...]


def recorded(log: Log, program: Program) -> Recorded:
    """The newest time that the program was played.

    Raises:
        NotInLog: it is not there, or not to its end.
    """
    plan_id, plan = max(
        ((key, data) for key, data in log.plans.items() if data["group"] == program.group and _is(data, program)),
        key=lambda item: item[0], default=(0, {}),
    )  # fmt: skip
    if not plan:
        raise NotInLog(f"{program.name} is not in the log")
    reply = plan["reply"]
    rows = _rows(log, program, plan_id, float(reply["duration_s"]))
    columns = list(log.cell.axis_indices(program.group))
    names = ("position", "velocity", "acceleration", "jerk")
    states = np.stack([log.ticks[name][rows][:, columns] for name in names])
    times = (rows - rows[0]) * log.cell.period
    begins = tuple(step["begins_s"] for step in reply["steps"])
    return Recorded(times, states, float(reply["duration_s"]), float(reply["scale"]), begins)


def _is(plan: dict[str, object], program: Program) -> bool:
    try:
        return _MOVE.validate_python(plan["move"], strict=False) == program.move
    except ValidationError:
        return False


def _rows(log: Log, program: Program, plan_id: int, duration: float) -> NDArray[np.intp]:
    """Of the log's ticks, in which the move is played; the first and the last rest."""
    group = log.cell.members(program.group)[0]
    mine = np.flatnonzero(log.ticks["plan_id"][:, group] == plan_id)
    if not mine.size or log.ticks["path_s"][mine[-1], group] < duration - 2.0 * log.cell.period:
        raise NotInLog(f"{program.name} did not arrive")
    return np.arange(mine[0] - 1, mine[-1] + 2)
