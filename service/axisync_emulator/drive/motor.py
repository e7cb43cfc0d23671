"""Power stage, brake, axis and encoder: what moves, and what is measured. Counts, counts/s, ns."""

from axisync_emulator.drive.axis_model import AxisModel
from axisync_emulator.drive.demand import Demand
from axisync_emulator.drive.specification import DriveSpecification

RATED_ACCELERATION_RATIO = 4.0
"""Rated torque accelerates the axis at this many times its quick-stop deceleration."""
FRICTION = 20.0
"""Torque that a moving axis needs, in 1/1000 of the rated torque."""


class Motor:
    """Follows the demand while it has torque; else the brake stops and holds the axis."""

    def __init__(self, specification: DriveSpecification) -> None:
        self._brake_deceleration = specification.brake_deceleration
        self._brake_release_ns = specification.brake_release_ns
        self._rated = specification.deceleration * RATED_ACCELERATION_RATIO
        self._model = AxisModel(specification.start)
        self._braking = Demand(specification.start)
        self._time = 0
        self.demand = Demand(specification.start)
        self.torque_on = False
        self.released_at = 0

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

    def follow(self, target: float, now: int, period_ns: int, hold: bool) -> None:
        """Sets the demand on its way to `target`, see `Demand.follow`."""
        self.advance(now)
        self.demand.follow(target, now, period_ns, hold)

    def ramp(self, now: int, deceleration: float) -> int:
        """Lets the demand slow down to rest; returns when it does."""
        self.advance(now)
        return self.demand.ramp(now, deceleration)

    def advance(self, now: int) -> None:
        """Brings the axis to the instant `now`."""
        if now <= self._time:
            return
        model = self._model
        if not self.torque_on:
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

    def position(self, now: int) -> int:
        """Encoder counts."""
        self.advance(now)
        return round(self._model.position)

    def velocity(self, now: int) -> int:
        """Counts/s."""
        self.advance(now)
        return round(self._model.velocity)

    def demand_position(self, now: int) -> float:
        """Where the axis is asked to be: the actual position while there is no torque."""
        if self.torque_on:
            return self.demand.at(now)
        self.advance(now)
        return self._model.position

    def demand_velocity(self, now: int) -> float:
        """Of the demand, counts/s."""
        return self.demand.velocity_at(now) if self.torque_on else 0.0

    def torque(self, now: int) -> int:
        """In 1/1000 of the rated torque."""
        if not self.can_move(now):
            return 0
        self.advance(now)
        model = self._model
        friction = FRICTION if model.velocity > 1.0 else -FRICTION if model.velocity < -1.0 else 0.0
        return round(1000.0 * model.acceleration(self.demand.at(now)) / self._rated + friction)
