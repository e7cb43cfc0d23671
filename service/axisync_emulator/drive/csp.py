"""Cyclic synchronous position (CiA 402-2): targets in, a plausible demand out."""

import math
from collections.abc import Callable

from axisync_emulator.drive.motor import Motor
from axisync_emulator.drive.specification import DriveSpecification

_WRAP, _HALF = 1 << 32, 1 << 31


class CyclicPosition:
    """Takes one target a cycle.

    Attributes:
        target: as written, INTEGER32.
        limited: it lies outside of 0x607D.
        waiting: the mode was chosen under torque, and no target has been near the axis since.
    """

    def __init__(self, specification: DriveSpecification, motor: Motor) -> None:
        self._specification = specification
        self._motor = motor
        self._approaching = False
        self._step_max = self._approach_speed = self._approach_acceleration = self._braking = 0.0
        self._range = (-_HALF, _HALF - 1)
        self.period_ns = 1
        self.restart()

    def configure(self, number: Callable[[int, int], int]) -> None:
        """Takes over 0x60C2, 0x607D, 0x6080, 0x6081, 0x6083, 0x6085."""
        self.period_ns = max(1, round(number(0x60C2, 1) * 10.0 ** (9 + number(0x60C2, 2))))
        motor_speed = number(0x6080, 0) / 60.0 * self._specification.counts_per_turn
        speed = min(self._specification.speed_limit, motor_speed)
        self._step_max = speed * self.period_ns * 1e-9 + 0.5
        self._approach_speed = min(float(number(0x6081, 0)), speed)
        self._approach_acceleration = float(number(0x6083, 0))
        self._braking = float(number(0x6085, 0))
        self._range = number(0x607D, 1), number(0x607D, 2)

    def restart(self) -> None:
        """As after power-on."""
        self.target = 0
        self.limited = False
        self.waiting = False

    def begin(self, waiting: bool) -> None:
        """The next targets are where the axis is sent from rest."""
        self._approaching = True
        self.waiting = waiting

    def near(self, now: int) -> bool:
        """The target is where the axis is, or nearly."""
        actual = self._motor.position(now)
        return abs(self._unwrapped(actual) - actual) <= self._specification.enable_window

    def follow(self, now: int, cycles: int | None) -> bool:
        """Sets out for the target, which one period from now is to be reached; False where that is implausible.

        `cycles`: SYNCs since the last target; None where it came without one.
        """
        motor = self._motor
        demand = motor.demand
        start = demand.at(now)
        target = self.target
        low, high = self._range
        if low <= target <= high and -_HALF < target - start < _HALF:
            self.limited = False
        else:
            target = self._clamped(self._unwrapped(round(start)))
        reached: float | None = target
        if self._approaching:
            reached = self._approach(start, target, demand.velocity_at(now))
        elif abs(target - demand.next_target(now, self.period_ns, cycles)) > self._allowed(cycles or 1):
            reached = None
        if reached is None:
            return self.waiting
        self.waiting = False
        if now >= motor.released_at:
            motor.follow(reached, now, self.period_ns, self._specification.hold_on_missed, cycles)
        return True

    def _approach(self, start: float, target: float, velocity: float) -> float | None:
        """The first targets may be anywhere in the enable window; the axis goes there at 0x6081, by 0x6083."""
        distance = target - start
        if abs(distance) > self._specification.enable_window:
            return None
        period_s, acceleration = self.period_ns * 1e-9, self._approach_acceleration
        braking = math.sqrt(2.0 * acceleration * abs(distance))
        step = period_s * min(self._approach_speed, abs(velocity) + acceleration * period_s, braking)
        self._approaching = abs(distance) > step
        return start + min(max(distance, -step), step)

    def _allowed(self, cycles: int) -> float:
        """How far a target may be from the extrapolated one: a step of one period at the highest speed, and what
        the axis can have gained or lost by 0x6085 in SYNCs without a target."""
        gap_s = (cycles - 1) * self.period_ns * 1e-9
        return self._step_max + 0.5 * self._braking * gap_s * gap_s

    def _unwrapped(self, near: int) -> int:
        """The target's turn of the INTEGER32 range that is nearest to `near`: positions wrap without a jump."""
        return near + (self.target - near + _HALF) % _WRAP - _HALF

    def _clamped(self, target: int) -> int:
        low, high = self._range
        self.limited = not low <= self.target <= high
        return target + min(max(self.target, low), high) - self.target
