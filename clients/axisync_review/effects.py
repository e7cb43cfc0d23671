"""What took effect on a plan, and at which tick: the commands that a replay gives to the controller's own `Motion`."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from axisync_review.story import Story
from axisync_schemas.events import EventKind
from axisync_schemas.replies import Event
from axisync_service.motion_controller.player import Ending, Motion

Apply = Callable[[Motion, Event], object]

EFFECTS: dict[EventKind, Apply] = {
    # A stop slows as a hold does; that nothing resumes it shows in the log.
    EventKind.MOVE_STOPPING: lambda motion, event: motion.slow(Ending.HELD, str(event.details.get("reason"))),
    EventKind.MOVE_RESUMED: lambda motion, event: motion.resume(),
    EventKind.OVERRIDE_SET: lambda motion, event: motion.set_override(_rate(event, motion.plan_id) or 0.0),
    EventKind.JOG_SPEED: lambda motion, event: motion.set_override(_rate(event, motion.plan_id) or 0.0),
}
"""Events that changed a motion under way, and how. An effect at tick k first shows in the setpoint of tick k + 1."""
WITHOUT_EFFECT = frozenset({EventKind.MOVE_ACCEPTED, EventKind.MOVE_HELD, EventKind.RATE_RELAXED})
"""Events that name a plan and change nothing about how it is played."""


@dataclass(slots=True)
class Effects:
    """Of one plan.

    Attributes:
        started, ended: ticks, None where the log does not say.
        started_s, override: the instant of its start, and the rate that it was started with.
        later: (tick, event), by tick.
        unknown: the first event that names the plan and that nobody here knows how to replay.
    """

    started: int | None = None
    ended: int | None = None
    started_s: float = 0.0
    override: float = 1.0
    later: list[tuple[int, Event]] = field(default_factory=list)
    unknown: Event | None = None

    def note(self, tick: int, plan_id: int, event: Event) -> None:
        """Takes an event in."""
        rate = _rate(event, plan_id)
        if event.kind == EventKind.MOVE_ENDED:
            self.ended = tick
        elif event.kind == EventKind.MOVE_STARTED and rate is not None:
            self.started, self.started_s, self.override = tick, event.now_s, rate
        elif event.kind in EFFECTS and rate is not None:
            self.later.append((tick, event))
        elif event.kind not in WITHOUT_EFFECT and self.unknown is None:
            self.unknown = event


def effects_of(story: Story) -> dict[int, Effects]:
    """By plan id."""
    found: dict[int, Effects] = {}
    for event in story.controllers():
        if event.tick is not None:
            for plan_id in _plans(event):
                found.setdefault(plan_id, Effects()).note(event.tick, plan_id, event)
    for effects in found.values():
        effects.later.sort(key=lambda pair: pair[0])
    return found


def apply(motion: Motion, effects: Effects, tick: int) -> None:
    """Everything that took effect at `tick`."""
    if tick == effects.started:
        motion.set_override(effects.override)
    for at, event in effects.later:
        if at == tick:
            EFFECTS[EventKind(event.kind)](motion, event)


def _plans(event: Event) -> Iterator[int]:
    """Ids of the plans that an event is about."""
    plan_id, rates = event.details.get("plan_id"), event.details.get("rates")
    if isinstance(plan_id, int):
        yield plan_id
    if isinstance(rates, dict):
        yield from (int(key) for key in rates if str(key).isdecimal())


def _rate(event: Event, plan_id: int) -> float | None:
    """What an event says of the plan's rate, 1 where it says nothing; None where that is not a number from 0 to 1."""
    rates = event.details.get("rates")
    named = event.details.get("rate" if event.kind == EventKind.JOG_SPEED else "override", 1.0)
    rate = rates.get(str(plan_id)) if isinstance(rates, dict) else named
    return float(rate) if isinstance(rate, int | float) and 0.0 <= rate <= 1.0 else None
