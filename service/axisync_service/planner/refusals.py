"""Refusals of the mathematics in the words and units of the wire."""

import math

import numpy as np
from numpy.typing import NDArray

from axisync_robot.inverse_errors import BranchChange, LimitReached, PathRefused, Singular, Unreachable
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_service.planner.models import Member
from axisync_service.planner.targets import in_words

Array = NDArray[np.float64]


def refusal_of_path(refused: PathRefused, member: Member, frame: Array, time_s: float | None) -> Refusal:
    """Why this arm cannot follow; `time_s` is when, None for a single pose; `frame` [4, 4] is the request's, in O."""
    at = {} if time_s is None else {"time_s": time_s}
    name = member.group.name
    where = "" if time_s is None else f" at {time_s:.3f} s of the move"
    match refused:
        case Unreachable():
            turned = f" and {math.degrees(refused.turn):.3g} deg of turn" if refused.turn else ""
            what = "the target is" if time_s is None else "the tool would be"
            message = f"{name}: {what} out of reach by {1e3 * refused.distance:.4g} mm{turned}{where}"
            nearest = in_words(refused.nearest, frame)
            return Refusal(
                ErrorCode.UNREACHABLE, message, **at, group=name, distance_m=refused.distance, turn_rad=refused.turn,
                nearest_reachable=nearest,
            )  # fmt: skip
        case LimitReached():
            axis = member.group.axes[refused.joint].name
            value, bound = math.degrees(refused.value), math.degrees(refused.bound)
            message = f"{axis}: would go to {value:.6g} deg, beyond its soft limit {bound:.6g} deg{where}"
            return Refusal(
                ErrorCode.SOFT_LIMIT, message, **at, axis=axis, value=refused.value, bound=refused.bound,
                limits=list(member.group.axes[refused.joint].soft_limits),
            )  # fmt: skip
        case BranchChange():
            message = f"{name}: the path goes on only with the other {refused.where}{where}: it passes a singularity"
            return Refusal(ErrorCode.SINGULAR_PATH, message, **at, group=name, singularity=refused.where)
        case Singular():
            axis = member.group.axes[refused.joint].name
            jump = f"{math.degrees(refused.step):.3g} deg"
            message = f"{axis} would have to jump by {jump}{where}: a {refused.where} singularity"
            return Refusal(
                ErrorCode.SINGULAR_PATH, message, **at, axis=axis, singularity=refused.where, required=refused.step,
                allowed=refused.bound,
            )  # fmt: skip
        case _:
            return Refusal(ErrorCode.INTERNAL, f"{name}: {refused}", **at)
