"""How fast poses, paths and moves of arms are planned, each beside what it is compared with: no service is needed."""

from collections.abc import Callable
from pathlib import Path
from time import perf_counter_ns, thread_time_ns

import numpy as np
from numpy.typing import NDArray
from percentiles import Distribution
from report import Report
from retimed import (
    FIRST,
    GROUP,
    Line,
    durations,
    plan_of_request,
    planned,
    toppra_of,
    waypoints,
)

from axisync_robot.arm import Arm
from axisync_robot.collision import CollisionModel
from axisync_robot.inverse import Inverse, follow, inverse_of
from axisync_robot.numeric_inverse import NumericInverse
from axisync_robot.poses import pose_of
from axisync_schemas.cell import read_cell
from axisync_service.planner.models import Models

Array = NDArray[np.float64]

CELL = Path(__file__).parents[2] / "service" / "axisync_service" / "cells" / "eod.toml"
POSES, FEW = 2_500, 250
"""Of a 5 s path at 2 ms; the numeric solver gets a tenth of them, and its times are multiplied by ten."""
START, SHIFT = np.radians([10.0, -70.0, 80.0, -20.0, 50.0, 30.0]), np.array([0.05, -0.04, 0.06])
LONG = Line("5 s line", FIRST, {"kind": "linear", "frame": "tool", "relative": True,
                                "target": {"position": [0.0, 0.0, 0.05]}, "duration_s": 5.0})  # fmt: skip
BOTH = {"kind": "joint", "target": np.radians([100, -90, -60, -120, 45, 45, 20, -40, -40, -40, 90, 20]).tolist()}
STEP_S = 0.01
"""How far apart poses of a path are checked one by one."""


def measure(report: Report, rounds: int = 40) -> None:
    """Measures and prints."""
    models = Models(read_cell(CELL)[0])
    _show(report, "arms poses", f"Inverse and forward kinematics of {POSES:,} poses", poses(models, rounds))
    _show(report, "arms plans", "`plan`, everything included, and beside it", plans(models, rounds))
    lines = [
        [found.name, *map(_seconds, (found.planned, found.joints, found.no_jerk, found.toppra))]
        for found in durations(models)
    ]
    headings = [f"line of {GROUP}", "as asked", "V, A, J of joints", "V, A of joints", "TOPP-RA, V, A"]
    report.table("arms durations", "Durations, s", headings, lines)


def _show(report: Report, name: str, title: str, measured: dict[str, Array]) -> None:
    rows = {row: Distribution.of(times[0].tolist()) for row, times in measured.items()}
    cpu = {row: f"{np.median(times[1]):.3g}" for row, times in measured.items()}
    report.distributions(name, title, "ms", rows, (50, 99), {"of CPU, p50": cpu})


def _seconds(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def poses(models: Models, rounds: int) -> dict[str, Array]:
    """By solver; see `_by_turns`."""
    (member,) = models.members(GROUP)
    arm = member.kinematics()
    closed = inverse_of(arm, [-3.0] * arm.joints, [3.0] * arm.joints)
    numeric = NumericInverse(arm, [-3.0] * arm.joints, [3.0] * arm.joints)
    path, fewer = _path(arm, POSES), _path(arm, FEW)
    return _by_turns(
        {
            "closed form": (rounds, 1.0, lambda: _there_and_back(closed, arm, path)),
            "pinocchio, damped least squares": (3, POSES / FEW, lambda: _there_and_back(numeric, arm, fewer)),
        }
    )


def _path(arm: Arm, count: int) -> Array:
    start = arm.placement(START)
    return pose_of(start[:3, 3] + np.linspace(0.0, 1.0, count)[:, np.newaxis] * SHIFT, start[:3, :3])


def _there_and_back(inverse: Inverse, arm: Arm, path: Array) -> Array:
    return arm.placements(follow(inverse, path, START).angles)


def plans(models: Models, rounds: int) -> dict[str, Array]:
    """Of whole plans, with what stops need, and of what others do for the same path."""
    _, line = planned(models, LONG)
    _, both = plan_of_request(models, "both", BOTH, None)
    calls: dict[str, tuple[int, float, Callable[[], object]]] = {
        "a line of 5 s": (rounds, 1.0, lambda: planned(models, LONG)),
        "12 axes, joint move": (rounds, 1.0, lambda: plan_of_request(models, "both", BOTH, None)),
    }
    retime = toppra_of(models.cell)
    if retime is not None:
        path = waypoints(line)
        calls["TOPP-RA, timing of that line alone"] = (rounds, 1.0, lambda: retime(path))
    q = both.sample(np.arange(0.0, both.duration, STEP_S))[0]
    calls[f"coal, {len(q)} poses of that joint move"] = (rounds // 4 + 1, 1.0, lambda: _each(models.collision, q))
    return _by_turns(calls)


def _each(model: CollisionModel, q: Array) -> None:
    for pose in q:
        model.clearance(pose)


def _by_turns(calls: dict[str, tuple[int, float, Callable[[], object]]]) -> dict[str, Array]:
    """[2, count] milliseconds on the clock and of CPU, by name, of `count` calls each, times a factor."""
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in calls}
    for _, _, call in calls.values():
        call()  # unmeasured: first calls compile and fill caches
    for turn in range(max(count for count, _, _ in calls.values())):
        for name, (count, factor, call) in calls.items():
            if turn < count:
                begin, used = perf_counter_ns(), thread_time_ns()
                call()
                spent = perf_counter_ns() - begin, thread_time_ns() - used
                times[name].append((factor * spent[0] / 1e6, factor * spent[1] / 1e6))
    return {name: np.array(pairs).T for name, pairs in times.items()}
