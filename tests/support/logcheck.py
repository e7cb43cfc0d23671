"""What a log proves: no tick is missing, limits are kept, axes of a move start and arrive together, exactly.

Limits are judged on differences of the logged float64 positions, not on what the service says of itself. For a motion
whose k-th derivative is bounded by B, the k-th difference over T^k is a mean of that derivative, so it is bounded by B
too, without any allowance for sampling; what remains is rounding, amplified by T^-k.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisync_schemas.enumerations import GroupState
from axisync_schemas.ticks import SIGNIFICAND_BITS, Records
from support.logread import Log

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

EPSILON = float(np.finfo(np.float64).eps)
ROUNDING = 4.0
"""Errors of a position in units of eps |q|: Horner's rule, and the path parameter as a sum of periods."""
LOGGED = 1.0 + 1e-7
"""Allowance for logged derivatives, which are evaluated, not measured: a path clock finds its rate by iteration."""
WITHIN_TICK = 1.0 + 1e-3
"""While the rate changes, jerk is within its limit where a tick begins and ends; between them it may bulge by less."""
ARRIVED = 1e-12
"""Distance that counts as none when ticks of departure and arrival are compared: a millionth of a count, rad."""
SESSION_S = 86400.0
"""A log of a test is shorter."""
COMMANDED = (GroupState.STANDSTILL, GroupState.MOVING, GroupState.HELD, GroupState.STOPPING, GroupState.JOGGING)
"""States in which the setpoint is the service's own; in the others it follows the actual position."""


def problems(log: Log) -> list[str]:
    """Everything below; an empty list is a good log."""
    checks = (
        tick_problems,
        time_problems,
        limit_problems,
        derivative_problems,
        count_problems,
        rest_problems,
        move_problems,
    )
    return [problem for check in checks for problem in check(log)]


# --- ticks ----------------------------------------------------------------------------------------------------------


def tick_problems(log: Log) -> list[str]:
    """Tick numbers without a gap, instants on the grid, times of the log in order."""
    ticks = log.ticks["tick"].astype(np.int64)
    if not len(ticks):
        return ["no tick"]
    found = [] if ticks[0] >= 1 else ["a tick below 1"]
    found += [f"after tick {ticks[i]} comes {ticks[i + 1]}" for i in np.flatnonzero(np.diff(ticks) != 1)[:5]]
    instants = log.ticks["cycle_start_ns"].astype(np.int64)
    off = np.flatnonzero(instants - instants[0] != (ticks - ticks[0]) * log.cell.period_ns)
    if len(off):
        found.append(f"tick {ticks[off[0]]} is off the grid")
    if (np.diff(log.log_times_ns.astype(np.int64)) <= 0).any():
        found.append("log times do not increase")
    return found


def time_problems(log: Log) -> list[str]:
    """Events and requests lie on the log's own time, not on another clock; each event says its instant twice."""
    found = []
    offset = int(log.metadata["axisync.clocks"]["offset_ns"])
    for message in (*log.events, *log.requests):
        away = (message.log_time_ns - int(log.metadata["axisync.clocks"]["wall_ns"])) / 1e9
        if abs(away) > SESSION_S:
            found.append(f"a message at {away:.0f} s from the beginning of its log")
    for event in log.events:
        away = (event.log_time_ns - offset) / 1e9 - event.data["now_s"]
        if abs(away) > 1.0:
            found.append(f"{event.data['kind']} is logged {away:.3f} s from its now_s")
    return found[:5]


# --- limits ---------------------------------------------------------------------------------------------------------


def limit_problems(log: Log) -> list[str]:
    """V, A and J of every axis: `limits`, and A and J of `stop_limits` where a window of samples touches a slowing."""
    found = []
    period, slowing = log.cell.period, _slowing(log)
    for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        for axis, group, span in _stretches(log, order + 1):
            position = log.ticks["position"][span, axis]
            values = np.abs(np.diff(position, order)) / period**order
            bound = np.full(len(values), _bound(log, axis, name, stop=False))
            bound[_touches(slowing[span, group], order)] = _bound(log, axis, name, stop=True)
            allowed = bound + 2.0**order * ROUNDING * EPSILON * _size(position) / period**order
            found += _exceeded(log, span, axis, f"{name} by differences", values, allowed)
    return found


def derivative_problems(log: Log) -> list[str]:
    """Logged velocity, acceleration and jerk are within limits, and are those of the logged positions.

    The mean of two velocities is the mean velocity between them but for T^2/12 of the greatest jerk (trapezoidal rule);
    the mean of two accelerations that of the acceleration but for T/4 of it, since jerk may step in between.
    """
    found = []
    period, slowing_all = log.cell.period, _slowing(log)
    for axis, group, span in _stretches(log, 2):
        ticks, slowing = log.ticks[span], slowing_all[span, group]
        for name in ("velocity", "acceleration", "jerk"):
            bound = np.where(slowing, _bound(log, axis, name, stop=True), _bound(log, axis, name, stop=False))
            found += _exceeded(log, span, axis, f"logged {name}", np.abs(ticks[name][:, axis]), bound * LOGGED)
        jerk = np.where(_touches(slowing, 1), _bound(log, axis, "jerk", True), _bound(log, axis, "jerk", False))
        for lower, upper, error in (("position", "velocity", period**2 / 12), ("velocity", "acceleration", period / 4)):
            values, rates = ticks[lower][:, axis], ticks[upper][:, axis]
            gap = np.abs(np.diff(values) / period - (rates[1:] + rates[:-1]) / 2)
            allowed = WITHIN_TICK * jerk * error + 2 * ROUNDING * EPSILON * _size(values) / period
            allowed += _cut(log, axis, upper) + _cut(log, axis, lower) / period
            found += _exceeded(log, span, axis, f"logged {upper} against {lower}", gap, allowed)
    return found


def count_problems(log: Log) -> list[str]:
    """Target counts are the positions, to one count, INT32 wrapping included."""
    return count_mismatches(log, log.ticks["target_counts"], log.ticks, "logged target")


def rest_problems(log: Log) -> list[str]:
    """A group that stands, or is held, keeps its setpoint to the bit."""
    ticks = log.ticks
    still = np.isin(ticks["group_state"], (GroupState.STANDSTILL, GroupState.HELD)) & (ticks["path_rate"] == 0.0)
    found = []
    for group, name in enumerate(log.cell.group_names):
        both = still[1:, group] & still[:-1, group] & (np.diff(ticks["tick"].astype(np.int64)) == 1)
        for axis in log.cell.axis_indices(name):
            moved = both & (ticks["position"][1:, axis] != ticks["position"][:-1, axis])
            if moved.any():
                tick = ticks["tick"][1:][moved][0]
                found.append(f"tick {tick}, {log.cell.axes[axis].name}: the setpoint moves while it should rest")
    return found


def count_mismatches(log: Log, counts: NDArray[Any], ticks: Records, what: str) -> list[str]:
    """Where counts[t, n] differ by more than one from the positions of `ticks`."""
    scale = np.array([axis.drive.counts_per_rad for axis in log.cell.axes])
    offset = np.array([axis.drive.offset for axis in log.cell.axes])
    expected = np.rint((ticks["position"] - offset) * scale).astype(np.int64)
    wrong = np.abs(_wrap(counts.astype(np.int64) - expected)) > 1
    return [
        f"tick {ticks['tick'][t]}, {log.cell.axes[n].name}: {what} {counts[t, n]}, position is {expected[t, n]} counts"
        for t, n in np.argwhere(wrong)[:5]
    ]


def _wrap(difference: NDArray[np.int64]) -> NDArray[np.int64]:
    return (difference + 2**31) % 2**32 - 2**31


def _stretches(log: Log, least: int) -> Iterator[tuple[int, int, slice]]:
    """(axis, group, samples): runs of at least `least` ticks in which the group is commanded and never lost its tick.

    Skipped ticks carry the setpoint of their time, so they are judged like the rest, until there are more of them in a
    row than the cell allows: then the setpoint may start anew from the actual position.
    """
    broken = _too_many_skipped(log)
    for group, name in enumerate(log.cell.group_names):
        good = np.isin(log.ticks["group_state"][:, group], [int(state) for state in COMMANDED]) & ~broken
        good[1:] &= np.diff(log.ticks["tick"].astype(np.int64)) == 1
        for span in _runs(good, least):
            for axis in log.cell.axis_indices(name):
                yield axis, group, span


def _too_many_skipped(log: Log) -> Mask:
    skipped = log.ticks["skipped"] != 0
    broken = np.zeros(len(skipped), dtype=bool)
    for span in _runs(skipped, log.cell.missed_ticks_max + 1):
        broken[span] = True
    return broken


def _runs(mask: Mask, least: int) -> Iterator[slice]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        if end - first >= least:
            yield slice(int(first), int(end))


def _slowing(log: Log) -> Mask:
    """[t, g]: samples at which a group is on its way to a stop, or has just come to it."""
    rate, plan = log.ticks["path_rate"], log.ticks["plan_id"]
    falling: Mask = np.zeros(rate.shape, dtype=bool)
    falling[1:] = (rate[1:] < rate[:-1]) & (plan[:-1] != 0) & (plan[1:] == plan[:-1])
    stopping: Mask = log.ticks["group_state"] == GroupState.STOPPING
    come: Mask = np.zeros_like(stopping)
    come[1:] = stopping[:-1]
    return falling | stopping | come


def _size(position: Array) -> float:
    """What rounding is relative to: the positions, and where they are small the path of about a radian."""
    return max(float(np.abs(position).max()), 1.0)


def _touches(flags: Mask, order: int) -> Mask:
    """For each window of order + 1 samples: does any of them have its flag set?"""
    windows = np.lib.stride_tricks.sliding_window_view(flags, order + 1)
    return np.asarray(windows.any(axis=1), dtype=np.bool_)


def _bound(log: Log, axis: int, name: str, stop: bool) -> float:
    one = log.cell.axes[axis]
    return float(getattr(one.stop_limits if stop and name != "velocity" else one.limits, name))


def cut(name: str) -> float:
    """What a logged value may lack of the true one, as a share of it."""
    return 2.0 ** -SIGNIFICAND_BITS[name] if name in SIGNIFICAND_BITS else 0.0


def _cut(log: Log, axis: int, name: str) -> float:
    """What a logged derivative may lack, as records keep not all of its bits; positions lack nothing."""
    return _bound(log, axis, name, stop=True) * cut(name) if name in SIGNIFICAND_BITS else 0.0


def _exceeded(log: Log, span: slice, axis: int, what: str, values: Array, allowed: Array) -> list[str]:
    over = values - allowed
    if not len(over) or over.max() <= 0.0:
        return []
    worst = int(over.argmax())
    tick = log.ticks["tick"][span][worst]
    return [f"tick {tick}, {log.cell.axes[axis].name}: {what} is {values[worst]:.9g}, allowed {allowed[worst]:.9g}"]


# --- moves ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class LoggedMove:
    """One plan as it was played: rows of `log.ticks` from the one before it to the first after it.

    Attributes:
        axes: all axes of its groups; span: the samples; plan: what `/plans` says of it, None where that is missing.
    """

    plan_id: int
    axes: tuple[int, ...]
    span: slice
    plan: dict[str, Any] | None


def moves(log: Log) -> list[LoggedMove]:
    """Every plan that was played, in order."""
    plan_ids = log.ticks["plan_id"]
    found = []
    for plan_id in dict.fromkeys(int(p) for p in plan_ids[plan_ids != 0]):
        rows = np.flatnonzero((plan_ids == plan_id).any(axis=1))
        groups = np.flatnonzero((plan_ids == plan_id).any(axis=0))
        axes = tuple(axis for group in groups for axis in log.cell.axis_indices(log.cell.group_names[group]))
        span = slice(max(0, int(rows[0]) - 1), min(len(plan_ids), int(rows[-1]) + 2))
        found.append(LoggedMove(plan_id, axes, span, log.plans.get(plan_id)))
    return found


def move_problems(log: Log) -> list[str]:
    """Each move's plan is in the log; its groups begin and end on the same ticks, its axes leave and arrive on the same
    ticks; one that was played to its end ends at the plan's end to the bit, and within one count of it in counts."""
    found = []
    for move in moves(log):
        label = f"plan {move.plan_id}"
        played = [log.ticks["plan_id"][:, group] == move.plan_id for group in _groups(log, move)]
        if any((played[0] != other).any() for other in played[1:]):
            found.append(f"{label}: its groups do not begin and end on the same ticks")
        found += [f"{label}: {text}" for text in (*_together(log, move), *_ends(log, move))]
    return found


def _groups(log: Log, move: LoggedMove) -> list[int]:
    return [g for g, name in enumerate(log.cell.group_names) if set(log.cell.axis_indices(name)) & set(move.axes)]


def _together(log: Log, move: LoggedMove) -> list[str]:
    """Each axis leaves between two ticks: where it is no longer at its start to the bit, and where by `ARRIVED`.

    There must be a tick that fits all; the same for arrivals, read backwards. Not of a sequence: its steps differ.
    """
    if move.plan is not None and move.plan.get("move", {}).get("kind") == "sequence":
        return []
    position = log.ticks["position"][move.span][:, list(move.axes)]
    position = position[:, np.abs(position - position[0]).max(axis=0) > 1e3 * ARRIVED]
    if position.shape[1] == 0:
        return []
    found = []
    ways = [("leave", position), ("arrive", position[::-1])]
    if not np.isin(log.ticks["group_state"][move.span][-1, _groups(log, move)], COMMANDED).all():
        ways.pop()  # It ended in a fault: the setpoint is the actual position from then on.
    for what, rows in ways:
        distance = np.abs(rows - rows[0])
        sharp, loose = (distance > 0.0).argmax(axis=0), (distance > ARRIVED).argmax(axis=0)
        if sharp.max() > loose.min():
            found.append(f"axes do not {what} on the same tick: {sharp.min()} to {loose.max()} samples in")
    return found


def _ends(log: Log, move: LoggedMove) -> list[str]:
    if move.plan is None or not move.plan.get("knots"):
        return ["its polynomials are not in the log"]
    axes, end = list(move.plan["axes"]), np.array(move.plan["end"])
    rows = log.ticks[move.span]
    if sorted(axes) != sorted(move.axes):
        return [f"played by axes {move.axes}, planned for {tuple(axes)}"]
    if not completed(log, move):
        return []
    last = rows[-1]
    found = [
        f"{log.cell.axes[axis].name} ends at {last['position'][axis]!r}, not at {float(target)!r}"
        for axis, target in zip(axes, end, strict=True)
        if last["position"][axis] != target
    ]
    scale = np.array([log.cell.axes[axis].drive.counts_per_rad for axis in axes])
    offset = np.array([log.cell.axes[axis].drive.offset for axis in axes])
    away = np.abs(_wrap(last["target_counts"][axes] - np.rint((end - offset) * scale).astype(np.int64)))
    if away.max() > 1:
        found.append(f"ends {int(away.max())} counts from its target")
    return found


def completed(log: Log, move: LoggedMove) -> bool:
    """Was it played to its end? As MOVE_ENDED says; without that event, as the path parameter shows."""
    for event in log.events:
        details = event.data.get("details", {})
        if event.data["kind"] == "move_ended" and details.get("plan_id") == move.plan_id:
            return bool(details.get("status") == "succeeded")
    assert move.plan is not None
    reached = log.ticks["path_s"][move.span][:, _groups(log, move)[0]].max()
    return bool(reached >= move.plan["knots"][-1] - log.cell.period)
