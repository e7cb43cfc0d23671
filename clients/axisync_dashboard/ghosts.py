"""The planned path as it is drawn: where the tool goes, and the arm as it will stand at the end."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_dashboard.kinematics import Arm
from axisync_schemas.moves import JointMove, LinearMove
from axisync_schemas.replies import MoveReply

Array = NDArray[np.float64]
POINTS = 60
"""Of a drawn path."""


@dataclass(frozen=True)
class Ghost:
    """Of one group: `end` [n] in rad, `path` [m][3] in m and in O; no path where the reply does not tell it."""

    end: tuple[float, ...]
    path: tuple[tuple[float, ...], ...]


def ghosts_of(
    reply: MoveReply, move: object, groups: Mapping[str, tuple[Arm | None, Array]], parabolic: bool = False
) -> dict[str, Ghost]:
    """A ghost for each group of the move.

    Args:
        groups: the move's elementary groups in order: arm, and where its setpoint is when it begins [n] in rad.
        parabolic: the jerk of each segment is a parabola with peak U, not constant.
    """
    ends = np.split(np.array(reply.end), np.cumsum([len(start) for _, start in groups.values()])[:-1])
    starts = np.concatenate([start for _, start in groups.values()])
    way = np.split(joint_way(reply, starts, parabolic), np.cumsum([len(e) for e in ends])[:-1], axis=1)
    ghosts = {}
    for (name, (arm, start)), end, positions in zip(groups.items(), ends, way, strict=True):
        path: tuple[tuple[float, ...], ...] = ()
        if arm is not None and isinstance(move, JointMove):
            path = _points(arm.tool_poses(positions))
        elif arm is not None and isinstance(move, LinearMove):
            path = _points(arm.tool_poses(np.stack([start, end])))
        ghosts[name] = Ghost(tuple(end), path)
    return ghosts


def _points(poses: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(round(float(x), 4) for x in pose[:3, 3]) for pose in poses)


def joint_way(reply: MoveReply, start: Array, parabolic: bool = False) -> Array:
    """[POINTS, n] positions of a joint move in rad, from its segment times T and jerks U.

    A path's scalars are no axes; then it is the straight way from start to end, good enough for its two ends.
    """
    end = np.array(reply.end)
    times = np.linspace(0.0, reply.duration_s, POINTS)
    if len(reply.T) != len(start) or not reply.duration_s:
        return np.linspace(start, end, POINTS)
    profiles = zip(reply.T, reply.U, strict=True)
    moved = np.stack([travelled(np.array(T), np.array(U), times, parabolic) for T, U in profiles], axis=1)
    whole = np.where(np.abs(moved[-1]) > 1e-12, moved[-1], 1.0)
    return np.asarray(start + (end - start) * moved / whole)


def travelled(T: Array, U: Array, times: Array, parabolic: bool = False) -> Array:
    """[m] distance at the instants [m] of a profile with seven segments of jerk U.

    A parabolic pulse j(t) = 4 U t (T - t) / T^2 changes a by 2/3 U T.
    """
    s = v = a = begin = 0.0
    out = np.zeros_like(times)
    for length, jerk in zip(T, U, strict=True):
        tau = np.clip(times - begin, 0.0, length)
        inside = times >= begin
        out[inside] = (s + v * tau + a * tau**2 / 2 + _thrice(tau, jerk, length, parabolic))[inside]
        s += v * length + a * length**2 / 2 + float(_thrice(np.array(length), jerk, length, parabolic))
        v += a * length + jerk * length**2 * (1 / 3 if parabolic else 1 / 2)
        a += jerk * length * (2 / 3 if parabolic else 1.0)
        begin += length
    return out


def _thrice(tau: Array, jerk: float, length: float, parabolic: bool) -> Array:
    """The jerk's threefold integral from 0 to tau."""
    if not parabolic or not length:
        return np.asarray(jerk * tau**3 / 6)
    return np.asarray(4 * jerk * (tau**4 / (24 * length) - tau**5 / (60 * length**2)))
