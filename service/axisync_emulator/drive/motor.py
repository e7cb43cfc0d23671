"""Power stage, brake, axis and encoder: what moves, and what is measured. Counts, counts/s, ns."""

from collections.abc import Callable

from axisync_emulator.drive.axis_model import AxisModel
from axisync_emulator.drive.demand import Demand
from axisync_emulator.drive.noise import noise
from axisync_emulator.drive.specification import DriveSpecification

VISCOUS_SPEED = 100_000.0
"""Counts/s at which the viscous friction is what 0x2002:2 says."""
_SPEED_NOISE = 20.0
"""Counts/s of noise in the measured velocity for each count of encoder noise."""
_STANDSTILL = 1.0
"""Counts/s below which the axis stands still."""
_TORQUE_NOISE = 1.0
"""In 1/1000 of the rated torque."""


class Motor:
    """Follows the demand while it has torque; else the brake stops and holds the axis.

    Attributes:
        jammed: something holds the axis where it is, whatever the torque.
        torque_limit: in 1/1000 of the rated torque.
        shift: reported minus mechanical position; the switches are where the mechanics are.
    """

    def __init__(self, specification: DriveSpecification) -> None:
        self._brake_deceleration = specification.brake_deceleration
        self._brake_release_ns = specification.brake_release_ns
        self._seed = specification.serial * 1_000_003
        self._rated = float(specification.rated_acceleration)
        self._noise = 0.0
        self._model = AxisModel(specification.start)
        self._braking = Demand(specification.start)
        self._time = 0
        self.demand = Demand(specification.start)
        self.torque_on = False
        self.jammed = False
        self.released_at = 0
        self.torque_limit = 0
        self.shift = 0.0

    def configure(self, number: Callable[[int, int], int]) -> None:
        """Takes over 0x2002, 0x6072 and 0x6073; torque and current are proportional."""
        model = self._model
        self._rated = float(max(1, number(0x2002, 3)))
        per_mille = self._rated / 1000.0
        model.coulomb = number(0x2002, 1) * per_mille
        model.viscous = number(0x2002, 2) * per_mille / VISCOUS_SPEED
        self._noise = number(0x2002, 4) / 100.0
        self.torque_limit = min(number(0x6072, 0), number(0x6073, 0))
        model.limit = self.torque_limit * per_mille

    def switch_on(self, now: int) -> None:
        """Torque on, demand at the actual position; the brake lets go after its release time."""
        self.advance(now)
        self._model.velocity = 0.0
        self.demand.rest(self._model.position, now)
        self.released_at = now + self._brake_release_ns
        self.torque_on = True

    def switch_off(self, now: int) -> None:
        """Torque off, the brake closes."""
        self.advance(now)
        if self.torque_on:
            self.torque_on = False
            self._braking.ramp_from(self._model.position, self._model.velocity, now, self._brake_deceleration)

    def refer(self, shift: float, now: int) -> None:
        """From now on the reported position is the mechanical one plus `shift`; the axis must be at rest."""
        self.advance(now)
        self._model.position += shift - self.shift
        self._model.velocity = 0.0
        self.shift = shift
        self.demand.rest(self._model.position, now)
        self._braking.rest(self._model.position, now)

    def follow(self, target: float, now: int, period_ns: int, hold: bool, cycles: int | None = None) -> None:
        """Sets the demand on its way to `target`, see `Demand.follow`."""
        if now > self._time:
            self.advance(now)
        self.demand.follow(target, now, period_ns, hold, cycles)

    def cruise(self, now: int, velocity: float, acceleration: float) -> None:
        """Lets the demand go to this velocity and keep it."""
        self.advance(now)
        self.demand.cruise(now, velocity, acceleration)

    def ramp(self, now: int, deceleration: float) -> int:
        """Lets the demand slow down to rest; returns when it does."""
        self.advance(now)
        return self.demand.ramp(now, deceleration)

    def advance(self, now: int) -> None:
        """Brings the axis to the instant `now`."""
        if now <= self._time:
            return
        model = self._model
        if self.jammed:
            model.velocity = 0.0
            self._braking.rest(model.position, now)
        elif not self.torque_on:
            model.position, model.velocity = self._braking.at(now), self._braking.velocity_at(now)
        elif now > self.released_at:
            self._move(max(self._time, self.released_at), now)
        self._time = now

    def _move(self, start: int, now: int) -> None:
        demand, step = self.demand, self._model.step
        while start < now:
            end = demand.linear_until(start, now)
            step(end - start, demand.at(start), demand.at(end))
            start = end

    def can_move(self, now: int) -> bool:
        """Torque on and brake released."""
        return self.torque_on and now >= self.released_at

    def mechanical(self, now: int) -> float:
        """Where the axis is on its way between the limit switches, counts."""
        self.advance(now)
        return self._model.position - self.shift

    def position(self, now: int) -> int:
        """Encoder counts; the encoder is noisy while it moves."""
        if now > self._time:
            self.advance(now)
        model = self._model
        if self._noise and not -_STANDSTILL < model.velocity < _STANDSTILL:
            return round(model.position + self._noise * noise(self._seed, now))
        return round(model.position)

    def velocity(self, now: int) -> int:
        """Counts/s."""
        self.advance(now)
        velocity = self._model.velocity
        if -_STANDSTILL < velocity < _STANDSTILL:
            return round(velocity)
        return round(velocity + _SPEED_NOISE * self._noise * noise(~self._seed, now))

    def demand_position(self, now: int) -> float:
        """Where the axis is asked to be: the actual position while there is no torque."""
        if self.torque_on:
            return self.demand.at(now)
        self.advance(now)
        return self._model.position

    def following_error(self, now: int) -> float:
        """Demand minus what the axis really does, counts."""
        if now > self._time:
            self.advance(now)
        return self.demand.at(now) - self._model.position if self.torque_on else 0.0

    def demand_velocity(self, now: int) -> float:
        """Of the demand, counts/s."""
        return self.demand.velocity_at(now) if self.torque_on else 0.0

    def torque(self, now: int) -> int:
        """In 1/1000 of the rated torque; the current in 1/1000 of the rated current is the same."""
        if not self.can_move(now):
            return 0
        self.advance(now)
        model = self._model
        needed = 1000.0 * (model.acceleration(self.demand.at(now)) + model.friction()) / self._rated
        limited = min(max(needed, -self.torque_limit), self.torque_limit)
        return round(limited + (_TORQUE_NOISE * noise(self._seed + 1, now) if self._noise else 0.0))
