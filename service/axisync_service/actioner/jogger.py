"""`jog`: motion for as long as it is asked for again and again, ten times a second or more.

The planner makes each jog a straight way, as far as it may go, that ends at rest; the controller plays it until the
time of the newest request is over. A slower velocity along the same way lowers the rate at once. For any other one the
group comes to rest on its way first, and goes on from there; so it does where a way was only as far as one plan goes.

Whatever else ends a jog (a stop, a hold, a fault) ends it for good: who still holds the key must let go first.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum, auto

import numpy as np

from axisync_schemas.cell import Cell
from axisync_schemas.commands import JogRequest
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.internal import JOG_LAPSED, JOG_RELEASED, Jog, JogCommand
from axisync_schemas.replies import JogAhead, JogReply, MoveReply
from axisync_service.actioner import admission
from axisync_service.actioner.controller_calls import ControllerCalls
from axisync_service.actioner.desk import Call, Desk
from axisync_service.actioner.leases import Leases
from axisync_service.actioner.mover import Asked, Mover
from axisync_service.actioner.moves import move_id_of
from axisync_service.actioner.ports import Ports
from axisync_service.actioner.requests import members_of
from axisync_service.actioner.world import World

QUIET_NS = 400_000_000
"""For so long nobody may have asked before a jog that was stopped may begin anew."""
BLOCKED_NS = 300_000_000
"""For so long a refusal of the planner is repeated instead of planned again."""
ROUNDING = 1e-9
OUR_ENDINGS = frozenset({None, JOG_RELEASED, JOG_LAPSED})
"""Reasons of the controller's after which the same client may go on."""


class Stage(Enum):
    """Where a jog is."""

    PLANNING = auto()
    MOVING = auto()
    SLOWING = auto()
    """To be ended, or to go on in another way."""


@dataclass
class Jogging:
    """One group that is jogged.

    Attributes:
        wanted: what was asked for last; planned: what is planned or under way. until_ns: when that is over.
        stops: stop counts of the members when it began.
        first: calls to be answered once it has begun; last: calls of a velocity of zero, once the group stands.
    """

    group: str
    members: tuple[int, ...]
    user: str
    request_id: str
    lease: str | None
    wanted: Jog
    until_ns: int
    stops: tuple[int, ...]
    stage: Stage = Stage.PLANNING
    planned: Jog | None = None
    plan_id: int = 0
    ahead: JogAhead | None = None
    first: list[Call] = field(default_factory=list)
    last: list[Call] = field(default_factory=list)


@dataclass(frozen=True)
class Blocked:
    """The planner's refusal of a jog from a place."""

    wanted: Jog
    setpoint: tuple[float, ...]
    refusal: Refusal
    until_ns: int


class Jogger:
    """Leads jogs; at most one for each elementary group."""

    def __init__(
        self, cell: Cell, ports: Ports, desk: Desk, leases: Leases, calls: ControllerCalls, mover: Mover
    ) -> None:
        self._cell, self._ports, self._desk = cell, ports, desk
        self._leases, self._calls, self._mover = leases, calls, mover
        self._jogs: dict[tuple[int, ...], Jogging] = {}
        self._blocked: dict[tuple[int, ...], Blocked] = {}
        self._latched: dict[tuple[int, ...], int] = {}
        """Groups whose jog was stopped, and when somebody last asked for it."""

    # --- requests -----------------------------------------------------------------------------------------------

    def handle(self, call: Call, request: JogRequest, world: World) -> None:
        """Takes in a `jog`.

        Raises:
            Refusal: not admitted, or there is no room that way.
        """
        members = members_of(self._cell, request.group)
        self._check_velocity(request, members)
        self._leases.verify(request.lease, members, world.now_ns)
        admission.check_controller(world)
        jog = self._jogs.get(members)
        if not any(request.velocity):
            self._release(call, request.group, members, jog, world)
            return
        admission.check_running(world.phase)
        self._check_let_go(request.group, members, jog, world)
        wanted = Jog(space=request.space, velocity=request.velocity)
        until_ns = call.received_ns + round(request.ttl_s * 1e9)
        if jog is None:
            self._begin(call, request, wanted, members, until_ns, world)
        else:
            jog.lease, jog.wanted, jog.until_ns = request.lease, wanted, max(jog.until_ns, until_ns)
            self._go_on(call, jog, world)

    def _check_velocity(self, request: JogRequest, members: tuple[int, ...]) -> None:
        axes = sum(len(self._cell.groups[member].axes) for member in members)
        count, allowed = len(request.velocity), (axes,) if request.space == "joint" else (3, 6)
        if count not in allowed:
            meant = "one value for each axis" if request.space == "joint" else "along x, y, z, or also about them"
            message = f"velocity: {' or '.join(map(str, allowed))} values are expected ({meant}), not {count}"
            fault = {"path": "velocity", "message": message, "value": count}
            raise Refusal(ErrorCode.INVALID_REQUEST, message, errors=[fault])

    def _check_let_go(self, group: str, members: tuple[int, ...], jog: Jogging | None, world: World) -> None:
        """A stop counts although the key is still held."""
        if jog is not None and jog.stops != self._stops(members):
            self._latched[members] = world.now_ns
        since = self._latched.get(members)
        if since is None:
            return
        if world.now_ns - since > QUIET_NS and jog is None:
            del self._latched[members]
            return
        self._latched[members] = world.now_ns
        message = f"{group} was stopped while it was jogged"
        fix = f"let go of the jog for {QUIET_NS / 1e9:g} s, then begin anew"
        raise Refusal(ErrorCode.WRONG_STATE, message, group=group, fix=fix)

    def _begin(
        self, call: Call, request: JogRequest, wanted: Jog, members: tuple[int, ...], until_ns: int, world: World
    ) -> None:
        self._check_may_move(members, world)
        blocked = self._blocked.get(members)
        if blocked is not None and self._still(blocked, wanted, world):
            raise blocked.refusal
        jog = Jogging(
            request.group, members, call.user, call.request_id, request.lease, wanted, until_ns, self._stops(members)
        )
        jog.first.append(call)
        self._plan(jog, world)

    def _check_may_move(self, members: tuple[int, ...], world: World) -> None:
        admission.check_movable(self._cell, members, world)
        admission.check_homed(self._cell, members, world)
        self._mover.check_free(members, commit=True)

    def _still(self, blocked: Blocked, wanted: Jog, world: World) -> bool:
        return blocked.wanted == wanted and blocked.setpoint == world.setpoint and world.now_ns < blocked.until_ns

    def _stops(self, members: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(self._ports.stop_count(member) for member in members)

    def _plan(self, jog: Jogging, world: World) -> None:
        jog.stage, jog.planned, jog.ahead = Stage.PLANNING, jog.wanted, None
        asked = Asked(jog.group, jog.members, jog.wanted, jog.lease)
        jog.plan_id = self._mover.submit(_JogAsker(self, jog), asked, world)
        self._jogs[jog.members] = jog

    def _go_on(self, call: Call, jog: Jogging, world: World) -> None:
        if jog.stage is not Stage.MOVING:
            self._reply(call, jog, "starting", world)
            return
        share = share_of(jog)
        if share is None:
            jog.stage = Stage.SLOWING
        self._tell(
            jog,
            share or 0.0,
            world,
            done=lambda then: self._reply(call, jog, "starting" if share is None else "moving", then),
            refused=lambda _, then: self._reply(call, jog, "starting", then),  # It ends just now, and may go on.
        )

    def _release(self, call: Call, group: str, members: tuple[int, ...], jog: Jogging | None, world: World) -> None:
        """A velocity of zero."""
        if jog is None:
            self._desk.reply(call, self._standing(call, group, world), world.now_ns)
            return
        jog.until_ns = 0
        jog.last.append(call)
        if jog.stage is Stage.MOVING:
            jog.stage = Stage.SLOWING
            self._tell(jog, 0.0, world)

    def _tell(
        self,
        jog: Jogging,
        share: float,
        world: World,
        done: Callable[[World], None] = lambda _: None,
        refused: Callable[[Refusal, World], None] = lambda *_: None,
    ) -> None:
        command = JogCommand(
            ref=self._calls.new_ref(), group=jog.group, plan_id=jog.plan_id, until_ns=jog.until_ns, share=share
        )
        self._calls.send(None, command, world.now_ns, done, lambda refusal: refused(refusal, world))

    # --- what becomes of it -------------------------------------------------------------------------------------

    def begin_until(self, jog: Jogging, world: World) -> int:
        """It is planned: whether it is wanted still.

        Raises:
            Refusal: WRONG_STATE, STALE.
        """
        if jog.last and jog.until_ns == 0:
            raise Refusal(ErrorCode.WRONG_STATE, f"the jog of {jog.group} was let go before it began", group=jog.group)
        if jog.until_ns < world.now_ns:
            late = (world.now_ns - jog.until_ns) / 1e9
            message = f"the jog of {jog.group} was planned {late:.3f} s after its time was over"
            fix = "ask again while it is planned, ten times a second or more"
            raise Refusal(ErrorCode.STALE, message, group=jog.group, fix=fix)
        return jog.until_ns

    def begun(self, jog: Jogging, ahead: JogAhead | None, world: World) -> None:
        """It moves; what was asked for meanwhile counts now."""
        jog.stage, jog.ahead = Stage.MOVING, ahead
        share = share_of(jog) if jog.until_ns else None
        if share is None:
            jog.stage = Stage.SLOWING
        self._tell(jog, share or 0.0, world)
        for call in jog.first:
            self._reply(call, jog, "moving", world)
        jog.first.clear()

    def refused(self, jog: Jogging, refusal: Refusal, world: World) -> None:
        """It is not planned, or does not begin."""
        if self._jogs.get(jog.members) is not jog:
            return
        del self._jogs[jog.members]
        if jog.planned is not None:
            self._blocked[jog.members] = Blocked(jog.planned, world.setpoint, refusal, world.now_ns + BLOCKED_NS)
        for call in jog.first:
            self._desk.refuse(call, refusal, world.now_ns)
        self._answer_last(jog, world)

    def on_ended(self, plan_id: object, reason: object, world: World) -> None:
        """The controller says that a motion has ended."""
        jog = next((jog for jog in self._jogs.values() if jog.plan_id == plan_id), None)
        if jog is None or jog.stage is Stage.PLANNING:
            return
        self._answer_last(jog, world)
        if reason not in OUR_ENDINGS:
            self._latched[jog.members] = world.now_ns
            del self._jogs[jog.members]
        elif jog.until_ns <= world.now_ns:
            del self._jogs[jog.members]
        else:
            self._again(jog, world)

    def _again(self, jog: Jogging, world: World) -> None:
        try:
            admission.check_running(world.phase)
            self._leases.verify(jog.lease, jog.members, world.now_ns)
            self._check_may_move(jog.members, world)
            self._plan(jog, world)
        except Refusal as refusal:
            self.refused(jog, refusal, world)

    def on_time(self, world: World) -> None:
        """Jogs whose motion has ended without our hearing of it."""
        for jog in list(self._jogs.values()):
            if jog.stage is not Stage.PLANNING and self._mover.moves.is_over(jog.plan_id):
                self.on_ended(jog.plan_id, "its end was not seen", world)

    def on_controller_down(self, world: World) -> None:
        """Whatever was jogged is stopped by its drives now."""
        for jog in list(self._jogs.values()):
            if jog.stage is not Stage.PLANNING:
                self.on_ended(jog.plan_id, "the controller went down", world)

    # --- answers ------------------------------------------------------------------------------------------------

    def _reply(self, call: Call, jog: Jogging, state: str, world: World) -> None:
        moving = jog.stage is not Stage.PLANNING
        reply = JogReply.model_validate(
            {
                "request_id": call.request_id,
                "now_s": world.now_s,
                "group": jog.group,
                "state": state,
                "move_id": move_id_of(jog.plan_id) if moving else None,
                "ahead": jog.ahead,
            }
        )
        self._desk.reply(call, reply, world.now_ns)

    def _answer_last(self, jog: Jogging, world: World) -> None:
        last, jog.last = jog.last, []
        for call in last:
            self._desk.reply(call, self._standing(call, jog.group, world), world.now_ns)

    def _standing(self, call: Call, group: str, world: World) -> JogReply:
        return JogReply(request_id=call.request_id, now_s=world.now_s, group=group, state="standing")


class _JogAsker:
    """A jog as the mover sees it."""

    def __init__(self, jogger: Jogger, jog: Jogging) -> None:
        self._jogger, self._jog = jogger, jog
        self.request_id, self.user = jog.request_id, jog.user

    def begin_until(self, world: World) -> int:
        return self._jogger.begin_until(self._jog, world)

    def begun(self, reply: MoveReply, ahead: JogAhead | None, world: World) -> None:
        self._jogger.begun(self._jog, ahead, world)

    def refused(self, refusal: Refusal, world: World) -> None:
        self._jogger.refused(self._jog, refusal, world)

    def failed(self, error: Exception, world: World) -> None:
        self._jogger.refused(self._jog, Refusal(ErrorCode.INTERNAL, f"internal error: {type(error).__name__}"), world)


def share_of(jog: Jogging) -> float | None:
    """At what share of the velocity in force what is wanted now runs, or None where that needs another way."""
    planned, ahead = jog.planned, jog.ahead
    if planned is None or ahead is None or planned.space != jog.wanted.space:
        return None
    asked, wanted, force = (np.array(v) for v in (planned.velocity, jog.wanted.velocity, ahead.velocity))
    if asked.shape != wanted.shape:
        return None
    length, given, most = (float(np.linalg.norm(v)) for v in (wanted, asked, force))
    if np.abs(wanted / length - asked / given).max() > ROUNDING:
        return None
    if length <= most:
        return length / most
    limited = most < given * (1.0 - ROUNDING)
    return 1.0 if limited or length <= given * (1.0 + ROUNDING) else None
