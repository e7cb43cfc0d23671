"""Inverse kinematics of any serial arm by pinocchio's Jacobians.

Damped least squares (Levenberg and Marquardt) find a solution; undamped Newton steps make it exact to rounding, since
polynomials are fitted to paths of solutions and their third derivatives count.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio
from numpy.typing import ArrayLike, NDArray

from axisync_robot.arm import Arm
from axisync_robot.inverse_errors import LimitReached, Singular, StartsElsewhere, Unreachable
from axisync_robot.inverse_path import START_TOLERANCE, STEP_MAX, Followed
from axisync_robot.poses import distances

Array = NDArray[np.float64]

TOLERANCE = 1e-10
"""m and rad: what counts as reached, a tenth of what solutions must keep."""
POLISHED = 1e-13
"""m and rad: what solutions are brought to where the arm is not near a singularity."""
_GAIN = 1e4
"""rad for each m and rad of error: Newton steps that would turn joints further are not taken."""
_NEWTON_STEPS = 8
_ITERATIONS = 200
_DAMPING = (1e-3, 1e-14, 1e6)
"""First, least and largest damping."""
_EASED, _STIFFENED = 0.1, 10.0
_AT_LIMIT = 1e-9


@dataclass(frozen=True, slots=True)
class NumericSolution:
    """Joint angles [n] (rad) as near the pose as the search came; `distance` (m) and `turn` (rad) that remain."""

    angles: Array
    reached: bool
    distance: float
    turn: float
    iterations: int


class NumericInverse:
    """The solver of one arm within its joint limits."""

    def __init__(self, arm: Arm, low: ArrayLike, high: ArrayLike) -> None:
        """Limits low, high [n], rad."""
        self.arm = arm
        self.low = np.asarray(low, dtype=np.float64)
        self.high = np.asarray(high, dtype=np.float64)

    def solve(self, pose: ArrayLike, seed: ArrayLike) -> NumericSolution:
        """The solution near seed [n], rad, of pose [4, 4] in O; where there is none, the nearest that was found.

        It descends from the seed alone: what is out of its valley is not found.
        """
        target = np.asarray(pose, dtype=np.float64)
        q = self._clipped(np.asarray(seed, dtype=np.float64))
        damping, least, largest = _DAMPING
        error, jacobian = self._error(target, q)
        iterations = 0
        while iterations < _ITERATIONS and damping <= largest and not _reached(error):
            iterations += 1
            trial = self._clipped(q + self._step(q, error, jacobian, damping))
            after, slope = self._error(target, trial)
            if after @ after < error @ error:
                q, error, jacobian, damping = trial, after, slope, max(least, damping * _EASED)
            else:
                damping *= _STIFFENED
        polished = self._polished(target, q)
        if polished.distance + polished.turn < np.linalg.norm(error):
            return replace(polished, iterations=iterations)
        return _solution(q, error, iterations)

    def follow(self, poses: ArrayLike, start: ArrayLike, step_max: float = STEP_MAX) -> Followed:
        """Joint angles along poses [k, 4, 4] in O from start [n], each sample seeded by the one before.

        Raises:
            StartsElsewhere: the start is not at the first pose.
            LimitReached: the start is outside the limits, or a pose is not reached because a joint is at its limit.
            Unreachable: a pose is not reached. Singular: a joint would jump.
        """
        targets, before = np.asarray(poses, dtype=np.float64), np.asarray(start, dtype=np.float64)
        self._check_start(targets[0], before)
        angles = np.empty((len(targets), self.arm.joints))
        for sample, target in enumerate(targets):
            found = self._tracked(target, self._continued(angles[:sample], before), before)
            if not found.reached:
                raise self.refusal(sample, target, found)
            step = found.angles - before
            joint = int(np.abs(step).argmax())
            if abs(step[joint]) > step_max:
                raise Singular(sample, joint, float(step[joint]), step_max, "arm")
            angles[sample] = before = found.angles
        return Followed(angles, None)

    def _continued(self, angles: Array, before: Array) -> Array:
        """[n]: where the joints would be next if they went on as in the samples before, by a parabola.

        Only where the pose leaves nothing free: what is free would go on forever.
        """
        if self.arm.joints > 6 or len(angles) < 2:
            return before
        if len(angles) == 2:
            return self._clipped(2.0 * angles[-1] - angles[-2])
        return self._clipped(3.0 * (angles[-1] - angles[-2]) + angles[-3])

    def _tracked(self, target: Array, seed: Array, before: Array) -> NumericSolution:
        """The solution near the seed: at once by Newton steps, damped where these fail, and from the sample before."""
        found = self._polished(target, seed)
        if not found.reached:
            found = self.solve(target, seed)
        return found if found.reached or seed is before else self.solve(target, before)

    def _polished(self, target: Array, q: Array) -> NumericSolution:
        """As near as undamped Newton steps bring q [n] to the pose, each nearer than the one before."""
        error, jacobian = self._error(target, q)
        size, steps = float(error @ error), 0
        while steps < _NEWTON_STEPS and not _within(error, POLISHED):
            step = _undamped(jacobian, error)
            if step is None or not step @ step <= _GAIN**2 * size:
                break
            trial = self._clipped(q + step)
            after, slope = self._error(target, trial)
            if not after @ after < size:
                break
            q, error, jacobian, size, steps = trial, after, slope, float(after @ after), steps + 1
        return _solution(q, error, steps)

    def _clipped(self, q: Array) -> Array:
        clipped: Array = np.minimum(np.maximum(q, self.low), self.high)
        return clipped

    def _check_start(self, pose: Array, start: Array) -> None:
        excess = np.maximum(self.low - start, start - self.high)
        joint = int(excess.argmax())
        if excess[joint] > _AT_LIMIT:
            bound = self.low[joint] if start[joint] < self.low[joint] else self.high[joint]
            raise LimitReached(0, joint, float(start[joint]), float(bound))
        apart, turn = (float(x) for x in distances(self.arm.placement(start), pose))
        if max(apart, turn) > START_TOLERANCE:
            raise StartsElsewhere(apart, turn, START_TOLERANCE)

    def refusal(self, sample: int, target: Array, found: NumericSolution) -> Unreachable | LimitReached:
        """A joint at its limit is to blame when the pose is reached, from there, without the limits."""
        at_limit = np.flatnonzero(self._held(found.angles, np.sign(found.angles - (self.low + self.high) / 2.0)))
        free = NumericInverse(self.arm, np.full(self.arm.joints, -np.inf), np.full(self.arm.joints, np.inf))
        beyond = free.solve(target, found.angles)
        excess = np.maximum(self.low - beyond.angles, beyond.angles - self.high)
        joint = int(excess.argmax())
        if at_limit.size and beyond.reached and excess[joint] > 0.0:
            bound = self.low[joint] if beyond.angles[joint] < self.low[joint] else self.high[joint]
            return LimitReached(sample, joint, float(beyond.angles[joint]), float(bound))
        return Unreachable(sample, found.distance, self.arm.placement(found.angles), found.turn)

    def _error(self, target: Array, q: Array) -> tuple[Array, Array]:
        """[6] position (m) and turn (rad) still to go, along the axes of O, and the Jacobian [6, n]."""
        pose, jacobian = self.arm.jacobian(q)
        error = np.empty(6)
        error[:3] = target[:3, 3] - pose[:3, 3]
        error[3:] = pinocchio.log3(target[:3, :3] @ pose[:3, :3].T)
        return error, jacobian

    def _step(self, q: Array, error: Array, jacobian: Array, damping: float) -> Array:
        """J^T (J J^T + damping I)^-1 error, with the joints that would leave their limits held."""
        step = _damped(jacobian, error, damping)
        held = self._held(q, step)
        if held.any():
            step = _damped(np.where(held, 0.0, jacobian), error, damping)
        return step

    def _held(self, q: Array, step: Array) -> NDArray[np.bool_]:
        """[n]: at a limit, and moving on outwards."""
        held: NDArray[np.bool_] = ((q <= self.low + _AT_LIMIT) & (step < 0.0)) | (
            (q >= self.high - _AT_LIMIT) & (step > 0.0)
        )
        return held


def _damped(jacobian: Array, error: Array, damping: float) -> Array:
    step: Array = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + damping * np.eye(6), error)
    return step


def _undamped(jacobian: Array, error: Array) -> Array | None:
    """The least step that brings the error to zero, to first order; None where there is none."""
    joints = jacobian.shape[1]
    try:
        if joints < 6:
            step = np.linalg.lstsq(jacobian, error, rcond=None)[0]
        elif joints == 6:
            step = np.linalg.solve(jacobian, error)
        else:
            step = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T, error)
    except np.linalg.LinAlgError:
        return None
    return np.asarray(step, dtype=np.float64)


def _solution(q: Array, error: Array, iterations: int) -> NumericSolution:
    apart, turn = float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))
    return NumericSolution(q, _reached(error), apart, turn, iterations)


def _reached(error: Array) -> bool:
    return _within(error, TOLERANCE)


def _within(error: Array, bound: float) -> bool:
    return bool(max(error[:3] @ error[:3], error[3:] @ error[3:]) <= bound * bound)
