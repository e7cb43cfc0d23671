"""Where the tool goes: forward kinematics of plans against geometry computed here, and the paper's timing."""

import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_motion import synchronise
from axisync_schemas.errors import ErrorCode
from axisync_service.planner.move_plan import Planned
from support.planner_jobs import (
    FREE,
    P1,
    PAPER,
    at,
    by,
    degrees,
    dense,
    linear,
    planned,
    refused,
    tool_of,
    trajectory_of,
    usage,
)

Array = NDArray[np.float64]

MICROMETRE = 1e-6
PAPER_TARGET = at((-0.0928, -0.2528, 0.38), euler_zyz=degrees(120, 120, -160))
BASE = FREE.members("kingkong")[0].kinematics().base


def tool_at(start: tuple[float, ...], group: str = "kingkong") -> Array:
    (member,) = FREE.members(group)
    return member.kinematics().placement(start)


def turned_by(first: Array, second: Array) -> Array:
    """[...] rad, by the chord, which keeps its digits at small angles."""
    chord = np.linalg.norm(first - second, axis=(-2, -1)) / math.sqrt(8.0)
    angle: Array = 2.0 * np.arcsin(np.clip(chord, 0.0, 1.0))
    return angle


def off_line(points: Array, start: Array, end: Array) -> Array:
    """[k] how far points [k, 3] are from the segment."""
    along = (end - start) / np.linalg.norm(end - start)
    offsets = points - start
    inside = np.clip(offsets @ along, 0.0, np.linalg.norm(end - start))
    distance: Array = np.linalg.norm(offsets - inside[:, None] * along, axis=1)
    return distance


def test_the_papers_line_takes_its_times() -> None:
    """V.B.2, example: angles of 30, 45 and 20 deg take 2.30278, 2.75 and 2 s; the length by MASA itself."""
    result = planned(linear(PAPER_TARGET, orientation="euler_zyz"), start=PAPER)
    reply = result.reply
    here = (np.linalg.inv(BASE) @ tool_at(PAPER))[:3, 3]
    assert here == pytest.approx([-0.0928, -0.25277, 0.6108], abs=5e-5)
    distances = [float(np.linalg.norm(np.array(PAPER_TARGET["position"]) - here)), *degrees(30, 45, 20)]
    v, a, j = ([tool, *degrees(*(turn,) * 3)] for tool, turn in ((0.15, 30.0), (0.2, 40.0), (0.3, 80.0)))
    profile = synchronise(distances, v, a, j)
    assert reply.scalars == ("length", "alpha", "beta", "gamma")
    assert reply.minimum_s == pytest.approx(profile.minimum_durations.tolist(), rel=1e-12)
    assert reply.minimum_s[1:] == pytest.approx((2.30278, 2.75, 2.0), abs=5e-6)
    assert np.array(reply.T) == pytest.approx(profile.T * reply.scale, rel=1e-9, abs=1e-9)
    assert np.abs(reply.U) == pytest.approx(np.abs(profile.U) / reply.scale**3, rel=1e-9)
    assert reply.duration_s == pytest.approx(profile.duration * reply.scale, rel=1e-12)


def test_the_papers_line_is_straight_and_turns_each_angle_for_itself() -> None:
    result = planned(linear(PAPER_TARGET, orientation="euler_zyz"), start=PAPER)
    times, tool = tool_of(result)
    seen = np.linalg.inv(BASE) @ tool
    target = np.array(PAPER_TARGET["position"])
    assert off_line(seen[:, :3, 3], seen[0, :3, 3], target).max() < MICROMETRE
    assert np.abs(seen[-1, :3, 3] - target).max() < MICROMETRE * result.reply.duration_s
    profile = Scalars(result)
    expected = rotations_zyz(degrees(90, 75, -180) + profile.at(times)[:, 1:])
    assert turned_by(seen[:, :3, :3], expected).max() < MICROMETRE
    travelled = np.linalg.norm(seen[:, :3, 3] - seen[0, :3, 3], axis=1)
    assert np.abs(travelled - profile.at(times)[:, 0]).max() < MICROMETRE


class Scalars:
    """Length and angles by time, from T and U of the reply by sums of cubics."""

    def __init__(self, result: Planned) -> None:
        self.T, self.U = np.array(result.reply.T), np.array(result.reply.U)

    def at(self, times: Array) -> Array:
        """[k, m]."""
        found = np.zeros((len(times), len(self.T)))
        for row, (widths, jerks) in enumerate(zip(self.T, self.U, strict=True)):
            state = np.zeros(3)
            begin = 0.0
            for width, jerk in zip(widths, jerks, strict=True):
                x = times - begin
                cubic = state[0] + x * (state[1] + x * (state[2] / 2.0 + x * jerk / 6.0))
                found[:, row] = np.where(x >= 0.0, cubic, found[:, row])
                state = np.array([
                    state[0] + width * (state[1] + width * (state[2] / 2.0 + width * jerk / 6.0)),
                    state[1] + width * (state[2] + width * jerk / 2.0),
                    state[2] + width * jerk,
                ])  # fmt: skip
                begin += width
        return found


def rotations_zyz(angles: Array) -> Array:
    """[k, 3, 3] = Rz(a) Ry(b) Rz(g)."""
    return about(2, angles[:, 0]) @ about(1, angles[:, 1]) @ about(2, angles[:, 2])


def about(axis: int, angle: Array) -> Array:
    """[k, 3, 3] about one coordinate axis."""
    first, second = [(1, 2), (2, 0), (0, 1)][axis]
    found = np.zeros((len(angle), 3, 3))
    found[:, axis, axis] = 1.0
    found[:, first, first] = found[:, second, second] = np.cos(angle)
    found[:, first, second], found[:, second, first] = -np.sin(angle), np.sin(angle)
    return found


@pytest.mark.parametrize("pulse", ["constant", "parabolic"])
@pytest.mark.parametrize("minimise", ["acceleration", "velocity", "jerk"])
def test_a_line_keeps_to_its_line_and_its_orientation(pulse: str, minimise: str) -> None:
    result = planned(by(0.02, 0.03, -0.05, pulse=pulse, minimise=minimise), start=PAPER)
    _, tool = tool_of(result)
    start = tool_at(PAPER)
    end = start[:3, 3] + BASE[:3, :3] @ [0.02, 0.03, -0.05]
    assert off_line(tool[:, :3, 3], start[:3, 3], end).max() < MICROMETRE
    assert turned_by(tool[:, :3, :3], start[:3, :3]).max() < MICROMETRE
    at_end = FREE.members("kingkong")[0].kinematics().placement(result.reply.end)
    assert np.abs(at_end[:3, 3] - end).max() < 1e-9


def test_a_turn_on_the_spot_is_about_one_axis() -> None:
    turn = degrees(25)[0]
    quaternion = (0.0, math.sin(turn / 2), 0.0, math.cos(turn / 2))
    result = planned(linear(at((0, 0, 0), quaternion=quaternion), relative=True, frame="tool"))
    times, tool = tool_of(result)
    start = tool_at(P1)
    assert np.abs(tool[:, :3, 3] - start[:3, 3]).max() < MICROMETRE
    assert result.reply.scalars == ("length", "rotation")
    angles = Scalars(result).at(times)[:, 1]
    assert turned_by(tool[:, :3, :3], start[:3, :3] @ about(1, angles)).max() < MICROMETRE


RADIUS = 0.03


def test_an_arc_is_on_its_circle_and_passes_via() -> None:
    start = tool_at(P1)
    local = np.array([[RADIUS, RADIUS, 0.0], [2.0 * RADIUS, 0.0, 0.0]])
    via, target = local @ start[:3, :3].T + start[:3, 3]
    result = planned({"kind": "circular", "frame": "body", "via": at(via), "target": at(target)})
    _, tool = tool_of(result)
    points = (tool[:, :3, 3] - start[:3, 3]) @ start[:3, :3]
    offsets = points - [RADIUS, 0.0, 0.0]
    assert np.abs(np.hypot(offsets[:, 0], offsets[:, 1]) - RADIUS).max() < MICROMETRE
    assert np.abs(points[:, 2]).max() < MICROMETRE
    assert points[:, 1].min() > -MICROMETRE
    assert result.reply.scalars[0] == "length"
    assert np.linalg.norm(points - local[0], axis=1).min() < 1e-3
    assert np.abs(points[-1] - local[1]).max() < 1e-5


@pytest.mark.parametrize(("turns", "pitch"), [(1.0, 0.0), (-2.5, 0.0), (2.0, 0.01)])
def test_circles_and_helices(turns: float, pitch: float) -> None:
    start = tool_at(P1)
    kind = "helix" if pitch else "circle"
    curve = {"type": kind, "centre": (0.0, RADIUS, 0.0), "angle": turns * math.tau, "pitch": pitch}
    result = planned({"kind": "path", "frame": "tool", "curve": curve})
    _, tool = tool_of(result)
    points = (tool[:, :3, 3] - start[:3, 3]) @ start[:3, :3]
    around = np.unwrap(np.arctan2(points[:, 0], RADIUS - points[:, 1]))
    assert np.abs(np.hypot(points[:, 0], points[:, 1] - RADIUS) - RADIUS).max() < MICROMETRE
    assert np.abs(points[:, 2] - pitch * around / math.tau).max() < MICROMETRE
    assert around[-1] == pytest.approx(turns * math.tau, abs=1e-3)
    assert turned_by(tool[:, :3, :3], start[:3, :3]).max() < MICROMETRE
    assert result.reply.scale >= 1.0


def test_a_lissajous_curve_is_on_its_curve() -> None:
    amplitude, frequency, phase = np.array([0.02, 0.015, 0.0]), np.array([1.0, 2.0, 0.0]), np.array([0.4, 1.1, 0.0])
    curve = {"type": "lissajous", "amplitude": amplitude, "frequency": frequency, "phase": phase}
    result = planned({"kind": "path", "frame": "tool", "curve": {k: v if k == "type" else tuple(v) for k, v in
                      curve.items()}})  # fmt: skip
    _, tool = tool_of(result)
    start = tool_at(P1)
    points = (tool[:, :3, 3] - start[:3, 3]) @ start[:3, :3]
    u = np.linspace(0.0, 1.0, 20_001)[:, None]
    fine = amplitude * (np.sin(math.tau * frequency * u + phase) - np.sin(phase))
    every = points[::25]
    near = np.array([off_polyline(point, fine) for point in every])
    assert near.max() < MICROMETRE
    assert np.abs(points[-1]).max() < 1e-5


def off_polyline(point: Array, corners: Array) -> float:
    """m from the two chords at the nearest corner; chords here are 1e-5 m, and off the curve by 1e-9 m."""
    nearest = int(np.linalg.norm(corners - point, axis=1).argmin())
    around = corners[max(0, nearest - 1) : nearest + 2]
    return min(float(off_line(point[None], first, second)[0]) for first, second in pairwise(around))


@pytest.mark.parametrize("segment", [1e-3, 1e-5, 1e-7])
def test_segments_that_are_very_short(segment: float) -> None:
    """A turn so small that its jerk pulses are over at once: nothing can be told of them from positions there."""
    turn = segment * np.array([0.3, 0.4, 0.2])
    pose = at((0.05, 0.0, -0.05), quaternion=(*(0.5 * turn), 1.0))
    result = planned(linear(pose, relative=True, orientation="euler_zyz"), start=PAPER)
    assert np.array(result.reply.T)[:, [0, 2]].min() < 1e-3
    assert result.reply.scale < 3.0
    _, tool = tool_of(result)
    end = tool_at(PAPER)[:3, 3] + BASE[:3, :3] @ [0.05, 0.0, -0.05]
    assert off_line(tool[:, :3, 3], tool[0, :3, 3], end).max() < MICROMETRE
    assert usage(trajectory_of(result)).max() <= 1.0 + 1e-9


@pytest.mark.parametrize("length", [1e-3, 1e-6, 1e-9, 3e-12])
@pytest.mark.parametrize("what", ["length", "turn"])
def test_moves_that_are_very_short(length: float, what: str) -> None:
    pose = at((0, 0, length)) if what == "length" else at((0, 0, 0), quaternion=(length, 0.0, 0.0, 1.0))
    result = planned(linear(pose, relative=True))
    trajectory = trajectory_of(result)
    assert result.reply.scale < 2.0
    q, *_ = trajectory.sample(dense(trajectory))
    assert np.abs(q - P1).max() < 10.0 * length + 1e-15
    assert usage(trajectory).max() <= 1.0 + 1e-9


STILL = linear(at((0, 0, 0), quaternion=(0, 0, 0, 1)), relative=True)


@pytest.mark.parametrize("move", [by(0, 0, 0), by(0, 0, 1e-15), STILL])
def test_paths_of_no_length(move: dict[str, object]) -> None:
    result = planned(move)
    assert result.plan is None
    assert (result.reply.duration_s, result.reply.limiting) == (0.0, None)
    assert result.reply.end == P1


@pytest.mark.parametrize(
    "move",
    [
        by(0.0, 0.0, 0.02, duration_s=86400.0),
        by(0.0, 0.0, 0.02, linear_limits=(1e-6, 1e-6, 1e-6)),
        by(0.0, 0.0, 0.02, linear_limits=(1.0, 1.0, 1e-12)),
    ],
)
def test_paths_that_take_hours(move: dict[str, object]) -> None:
    result = planned(move)
    assert result.reply.duration_s > 2000.0
    assert len(trajectory_of(result).knots) < 1000
    _, tool = tool_of(result)
    assert off_line(tool[:, :3, 3], tool[0, :3, 3], tool[0, :3, 3] + BASE[:3, 2] * 0.02).max() < MICROMETRE


@pytest.mark.parametrize("far", [10.0, 1e5])
def test_paths_that_leave_the_world(far: float) -> None:
    error = refused(by(far, 0.0, 0.0))
    assert error.code is ErrorCode.UNREACHABLE
    assert error.details["distance_m"] == pytest.approx(far, rel=0.2)
