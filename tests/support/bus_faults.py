"""Faults of buses and drives while both arms move, in lock-step: what is tolerated, what stops whom, and how smoothly.

Judged by what the drives received and sent (the candump of the emulator) and by the log's float64 positions.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from axisync_schemas.cell import Cell, parse_cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.log_models import PlanLog
from axisync_schemas.ticks import Records
from axisync_service.mapper.counts import CountMap
from support.framecheck import Frame, parse
from support.lock_step import Run, as_log, emulated, play
from support.plans import joint_plan

KINGKONG = 0
Fault = dict[str, object]
Make = Callable[[np.random.Generator, int], Fault]


@dataclass(frozen=True, slots=True)
class Stop:
    """A fault that ends the move.

    Attributes:
        make: the fault, from a generator and a node id.
        ticks: at most so many until the setpoints begin to slow.
        error: EMCY code that a drive must report.
    """

    make: Make
    ticks: int
    error: int | None = None


TOLERATED: dict[str, Make] = {
    "up_to_N_RPDOs_lost": lambda rng, n: {"kind": "lose", "id": 0x200 + n, "count": int(rng.integers(1, 6))},
    "RPDOs_after_the_window": lambda rng, n: {"kind": "delay", "id": 0x200 + n, "delay_s": 0.00175, "count": 3},
    "a_SYNC_lost": lambda rng, n: {"kind": "lose", "id": 0x080, "count": int(rng.integers(1, 3))},
    "RPDOs_twice": lambda rng, n: {"kind": "duplicate", "id": 0x200, "mask": 0x780, "probability": 0.2, "syncs": 30},
    "SYNC_twice": lambda rng, n: {"kind": "duplicate", "id": 0x080, "probability": 0.2, "syncs": 30},
    "out_of_order": lambda rng, n: {
        "kind": "delay", "id": 0x200 + n, "delay_s": 0.0003, "probability": 0.3, "syncs": 30,
    },
    "error_frames": lambda rng, n: {"kind": "corrupt", "probability": 0.003, "syncs": 30},
    "two_TPDOs_missing": lambda rng, n: {"kind": "mute", "node": n, "id": 0x180 + n, "syncs": 2},
    "buffer_full_for_a_moment": lambda rng, n: {"kind": "stall", "duration_s": 0.003},
    "clock_500_ppm_off": lambda rng, n: {"kind": "drift", "node": n, "ppm": float(rng.uniform(-500, 500))},
    "warm": lambda rng, n: {"kind": "temperature", "node": n, "celsius": 85.0, "per_s": 100.0},
}  # fmt: skip
LATCHED: dict[str, Stop] = {
    "more_than_N_RPDOs_lost": Stop(
        lambda rng, n: {"kind": "lose", "id": 0x200 + n, "count": int(rng.integers(7, 30))}, 12, 0x8250
    ),
    "SYNC_lost_for_good": Stop(lambda rng, n: {"kind": "lose", "id": 0x080}, 8, 0x8700),
    "bit_flip_in_a_target": Stop(
        lambda rng, n: {"kind": "flip", "id": 0x200 + n, "bit": int(rng.integers(16 + 12, 48)), "count": 1}, 6
    ),
    "bus-off_of_the_controller": Stop(lambda rng, n: {"kind": "bus_off", "duration_s": 0.5}, 8, 0x8700),
    "bus-off_of_a_drive": Stop(lambda rng, n: {"kind": "bus_off", "node": n, "duration_s": 0.5}, 8),
    "buffer_full": Stop(lambda rng, n: {"kind": "stall", "duration_s": 0.3}, 8, 0x8700),
    "foreign_NMT": Stop(lambda rng, n: {"kind": "babble", "id": 0, "data": "8000", "duration_s": 0.02}, 5),
    "a_twin": Stop(lambda rng, n: {"kind": "twin", "node": n}, 5),
    "emergency": Stop(
        lambda rng, n: {"kind": "emergency", "node": n, "code": int(rng.choice([0x2310, 0x7305, 0x5112]))}, 5
    ),
    "heartbeat_lost": Stop(lambda rng, n: {"kind": "no_heartbeat", "node": n}, 128),
    "jammed": Stop(lambda rng, n: {"kind": "jam", "node": n}, 100),
    "TPDOs_missing": Stop(lambda rng, n: {"kind": "mute", "node": n, "id": 0x180 + n, "syncs": 10}, 8),
    "frozen_actuals": Stop(lambda rng, n: {"kind": "freeze", "node": n}, 12),
    "reset": Stop(lambda rng, n: {"kind": "reset", "node": n}, 5),
    "power_cycle": Stop(lambda rng, n: {"kind": "power_cycle", "node": n, "duration_s": 0.3}, 8),
    "leaves_csp": Stop(lambda rng, n: {"kind": "leave_mode", "node": n}, 5),
    "safe_torque_off": Stop(lambda rng, n: {"kind": "sto", "node": n}, 5),
    "over-temperature": Stop(lambda rng, n: {"kind": "temperature", "node": n, "celsius": 95.0}, 5),
}
"""The arm has a fault, and keeps it."""
FOREIGN: dict[str, Stop] = {
    "babbling_node": Stop(lambda rng, n: {"kind": "babble", "id": 0x123, "data": "00" * 8}, 7),
    "foreign_heartbeat_of_the_controller": Stop(lambda rng, n: {"kind": "babble", "id": 0x77F, "data": "05"}, 4),
    "full_of_frames_that_matter_less": Stop(
        lambda rng, n: {"kind": "babble", "id": 0x7FE, "data": "FF" * 8, "period_s": 0.00012}, 7
    ),
}
"""Frames of others, which reach nobody's targets: the arms stop on their path, without a fault."""
FOREIGN_SYNC = Stop(lambda rng, n: {"kind": "babble", "id": 0x080, "data": "05", "period_s": 0.0017}, 7)


@dataclass(frozen=True, slots=True)
class Setup:
    """A cell, and SYNCs in which the move of both arms is at work."""

    text: str
    under_way: range


@dataclass(slots=True)
class Played:
    """One run. `axis`: of the drive that had the fault, which came right after SYNC `since`."""

    cell: Cell
    run: Run
    frames: list[Frame]
    far: np.ndarray
    axis: int
    since: int

    @property
    def states(self) -> np.ndarray:
        """[ticks, 2]"""
        states: np.ndarray = self.run.records["group_state"]
        return states


def plan(cell: Cell, rng: np.random.Generator) -> tuple[PlanLog, np.ndarray]:
    """A long move of both arms; and where it ends."""
    counts = CountMap(cell.axes)
    start = counts.to_position(counts.to_counts(np.array([axis.drive.start for axis in cell.axes])))
    low, high = np.array([axis.soft_limits for axis in cell.axes]).T
    sign = np.where(start > (low + high) / 2, -1.0, 1.0)
    far = start + sign * rng.uniform(0.25, 0.4, len(start))
    return as_log(joint_plan(cell, "both", list(start), list(far)), "both"), far


def wrapping(text: str) -> str:
    """The cell with an offset of axis 0 that lets its counts run over 2^31 within the move."""
    axis = parse_cell(text).axes[0]
    turns = 2**31 / axis.drive.counts_per_rad
    to_positive = 1.0 if axis.drive.start <= sum(axis.soft_limits) / 2 else -1.0
    offset = math.degrees(axis.drive.start + 0.1 * to_positive - turns)
    return text.replace("drive = { node_id = 1,", f"drive = {{ offset_deg = {offset!r}, node_id = 1,", 1)


def play_with(directory: Path, setup: Setup, makes: Sequence[Make], seed: int) -> Played:
    """Plays the move with faults in one drive of kingkong: one at a random instant, or several in turn."""
    rng = np.random.default_rng(seed)
    cell_file = directory / "cell.toml"
    cell_file.write_text(setup.text, encoding="utf-8")
    cell = parse_cell(setup.text).on_simcan(str(directory))
    log, far = plan(cell, rng)
    node = int(rng.integers(1, len(cell.axis_indices("kingkong")) + 1))
    window = setup.under_way
    instants = [int(rng.choice(window))] if len(makes) == 1 else window[:: len(window) // len(makes)]
    faults = [{"bus": "kingkong", "at_sync": at, **make(rng, node)} for at, make in zip(instants, makes, strict=False)]
    with emulated(cell_file, directory, faults, seed):
        done = play(cell, [log])
    played = Played(cell, done, list(parse(directory / "frames.log")), far, node - 1, instants[0])
    assert (played.states[instants[0] - 3] == GroupState.MOVING).all(), "the fault came too early"
    return played


# --- verdicts ---------------------------------------------------------------------------------------------------------


def goes_on(played: Played) -> None:
    """As if nothing had been."""
    assert played.run.failure is None
    standing = (played.states == GroupState.STANDSTILL).all(axis=1)
    assert (played.run.records["position"][standing][-1] == played.far).all()
    keeps_limits(played, range(len(played.cell.axes)), "limits")
    assert not errors(played)


def stops_and_latches(played: Played, stop: Stop) -> None:
    """The drive and its arm are out; the healthy axes come to rest within their limits, and nothing begins again."""
    _stops(played, stop.ticks)
    assert GroupState.FAULT in played.states[:, KINGKONG]
    healthy = [i for i in range(len(played.cell.axes)) if i != played.axis]
    keeps_limits(played, healthy, "stop_limits")
    stays_disabled(played)
    if stop.error is not None:
        assert stop.error in errors(played)


def stops_on_its_path(played: Played, stop: Stop) -> None:
    """Every axis comes to rest within its limits; no drive complains, nobody has a fault."""
    _stops(played, stop.ticks)
    assert GroupState.FAULT not in played.states
    keeps_limits(played, range(len(played.cell.axes)), "stop_limits")
    assert [event.kind.value for event in played.run.happenings].count("foreign_frames") == 1
    assert not errors(played)


def _stops(played: Played, ticks: int) -> None:
    assert played.run.failure is not None
    stopping = np.flatnonzero((played.states == GroupState.STOPPING).any(axis=1))
    assert stopping.size
    # Record i is of tick i + 1; the state of a tick is in the record of the next.
    assert played.since < stopping[0] + 1 <= played.since + ticks + 1
    assert not (played.states[stopping[-1] + 1 :] == GroupState.MOVING).any()
    assert not (played.run.records["position"][-1] == played.far).any()


def keeps_limits(played: Played, axes: Sequence[int], which: str) -> None:
    """V, A and J of the setpoints, for each arm while it is enabled."""
    arms = (played.cell.axis_indices("kingkong"), played.cell.axis_indices("wukong"))
    records: Records = played.run.records
    for group, members in enumerate(arms):
        enabled = ~np.isin(records["group_state"][:, group], (GroupState.DISABLED, GroupState.FAULT))
        ticks = np.flatnonzero(enabled)
        assert (np.diff(ticks) == 1).all()
        within(played.cell, records["position"][ticks], [i for i in axes if i in members], which)


def within(cell: Cell, positions: np.ndarray, axes: list[int], which: str) -> None:
    """Differences of these columns against the limits; rounding as in float64."""
    q = positions[:, axes]
    for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        of = "limits" if name == "velocity" else which
        bound = np.array([getattr(getattr(cell.axes[i], of), name) for i in axes])
        rounding = 2**order * 4 * np.finfo(float).eps * np.maximum(np.abs(q).max(axis=0), 1.0) / cell.period**order
        most = np.abs(np.diff(q, n=order, axis=0)).max(axis=0) / cell.period**order
        assert (most <= bound * (1 + 1e-9) + rounding).all(), (name, most / bound)


def errors(played: Played) -> list[int]:
    """Error codes that drives of either bus have reported."""
    codes = [int.from_bytes(frame.data[:2], "little") for frame in played.frames if 0x080 < frame.can_id < 0x100]
    return [code for code in codes if code]


def stays_disabled(played: Played) -> None:
    """Once out of operation enabled, the drive is not enabled again."""
    can_id = 0x180 + played.axis + 1
    words = [f.data[0] & 0x6F for f in played.frames if f.interface == "kingkong" and f.can_id == can_id]
    enabled = np.array([word == 0x27 for word in words])
    assert np.count_nonzero(np.diff(enabled.astype(int)) == 1) == 1
