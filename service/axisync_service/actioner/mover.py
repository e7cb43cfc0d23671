"""`move` and `plan`: admission, planning, and handing the plan to the controller.

The life of a move: admitted -> planned -> checked again -> begun -> accepted (the reply) -> `moves`. Planning takes
time, in which a lease may be lost or a stop may come; so what was true at admission is checked again, here and by the
controller.
"""

from dataclasses import dataclass
from typing import Protocol

from axisync_schemas.cell import Cell
from axisync_schemas.commands import MoveRequest
from axisync_schemas.enumerations import MoveStatus
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.events import EventKind
from axisync_schemas.internal import BeginCommand, Jog, PlanJob, Reserved
from axisync_schemas.log_models import PlanLog
from axisync_schemas.memory import PLAN_SLOTS
from axisync_schemas.moves import Move as AnyMove
from axisync_schemas.replies import JogAhead, MoveReply
from axisync_schemas.topics import LOG_PLANS
from axisync_service.actioner import admission
from axisync_service.actioner.controller_calls import ControllerCalls
from axisync_service.actioner.desk import Call, Desk
from axisync_service.actioner.leases import Leases
from axisync_service.actioner.moves import Move, Moves, move_id_of
from axisync_service.actioner.planner_queue import PlannerQueue
from axisync_service.actioner.ports import Notice, Ports
from axisync_service.actioner.requests import members_of
from axisync_service.actioner.slots import Slots
from axisync_service.actioner.world import World


class Asker(Protocol):
    """Whoever wants a motion: is told once whether it has begun."""

    request_id: str
    user: str

    def begin_until(self, world: World) -> int | None:
        """Asked when it is planned: until when a jog goes on by itself, None for a move.

        Raises:
            Refusal: it is not wanted any longer.
        """

    def begun(self, reply: MoveReply, ahead: JogAhead | None, world: World) -> None:
        """It is accepted."""

    def refused(self, refusal: Refusal, world: World) -> None:
        """It is not, or no longer."""

    def failed(self, error: Exception, world: World) -> None:
        """A fault of ours."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What is asked for: a move, or a jog."""

    group: str
    members: tuple[int, ...]
    move: AnyMove | Jog
    lease: str | None
    speed_scale: float = 1.0
    not_after_s: float | None = None


@dataclass(frozen=True, slots=True)
class Admitted:
    """A move on its way to a plan, with what must still be true when it has one.

    Attributes:
        slot: plan slot, or None for the verb `plan`, which is only told what would be.
        stop_counts: of each member; a stop in between ends the move before it begins.
    """

    asker: Asker
    asked: Asked
    plan_id: int
    slot: int | None
    start: tuple[float, ...]
    stop_counts: tuple[int, ...]

    @property
    def members(self) -> tuple[int, ...]:
        """Elementary groups that move."""
        return self.asked.members


class CallAsker:
    """A client's `move` or `plan`."""

    def __init__(self, call: Call, desk: Desk) -> None:
        self._call, self._desk = call, desk
        self.request_id, self.user = call.request_id, call.user

    def begin_until(self, world: World) -> None:
        """It has an end of its own."""

    def begun(self, reply: MoveReply, ahead: JogAhead | None, world: World) -> None:
        """The reply."""
        self._desk.reply(self._call, reply, world.now_ns)

    def refused(self, refusal: Refusal, world: World) -> None:
        """The refusal."""
        self._desk.refuse(self._call, refusal, world.now_ns)

    def failed(self, error: Exception, world: World) -> None:
        """The user learns its kind."""
        self._desk.fail(self._call, error, world.now_ns)


class Mover:
    """Leads moves from request to motion; one at a time for each elementary group."""

    def __init__(
        self, cell: Cell, ports: Ports, desk: Desk, leases: Leases, calls: ControllerCalls, first_plan_id: int
    ) -> None:
        """`first_plan_id`: above every earlier one, those of front's earlier lives too."""
        self._cell = cell
        self._ports = ports
        self._desk = desk
        self._leases = leases
        self._calls = calls
        self._next_plan_id = first_plan_id
        self._slots = Slots()
        self._world: World | None = None
        self.moves = Moves()
        self.planner = PlannerQueue(ports)
        self._planning: dict[int, Admitted] = {}

    # --- admission ----------------------------------------------------------------------------------------------

    def handle(self, call: Call, request: MoveRequest, world: World) -> None:
        """Takes in a `move` or `plan`.

        Raises:
            Refusal: not admitted.
        """
        members = members_of(self._cell, request.group)
        commit = call.verb == "move"
        if commit:
            admission.check_running(world.phase)
            self._leases.verify(request.lease, members, world.now_ns)
        admission.check_controller(world)
        (admission.check_movable if commit else admission.check_at_rest)(self._cell, members, world)
        if commit:
            admission.check_homed(self._cell, members, world)
        self.check_free(members, commit)
        asked = Asked(
            request.group, members, request.move, request.lease, request.speed_scale, request.not_after_s
        )  # fmt: skip
        self.submit(CallAsker(call, self._desk), asked, world, commit=commit)

    def _axes(self, members: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(i for member in members for i in self._cell.axis_indices(self._cell.group_names[member]))

    def check_free(self, members: tuple[int, ...], commit: bool) -> None:
        """One plan at a time for each group; and a move that is about to begin holds it too.

        Raises:
            Refusal: BUSY.
        """
        for member in members:
            name = self._cell.group_names[member]
            if any(member in admitted.members for admitted in self._planning.values()):
                raise Refusal(ErrorCode.BUSY, f"{name}: a move is being planned", group=name)
            move = self.moves.on_group(member) if commit else None
            if move is not None:
                busy = move_id_of(move.plan_id)
                raise Refusal(ErrorCode.BUSY, f"{name}: move {busy} has not ended", group=name, move_id=busy)

    def submit(self, asker: Asker, asked: Asked, world: World, *, commit: bool = True) -> int:
        """Has it planned, and begun where it is to be committed; returns its plan id.

        Raises:
            Refusal: BUSY, no slot is free.
        """
        slot = self._take_slot(world) if commit else None
        start = tuple(world.setpoint[i] for i in self._axes(asked.members))
        plan_id, self._next_plan_id = self._next_plan_id, self._next_plan_id + 1
        stops = tuple(self._ports.stop_count(member) for member in asked.members)
        admitted = Admitted(asker, asked, plan_id, slot, start, stops)
        reserved = self._reserved(asked.members)
        self._planning[plan_id] = admitted
        job = PlanJob(
            ref=plan_id,
            group=asked.group,
            plan_id=plan_id,
            slot=slot,
            start=start,
            rest=world.setpoint,
            reserved=reserved,
            move=asked.move,
            speed_scale=asked.speed_scale,
        )
        self.planner.submit(
            job,
            done=lambda plan, ahead: self._planned(admitted, plan, ahead),
            refused=lambda refusal: self._not_planned(admitted, refusal),
            now_ns=world.now_ns,
        )
        return plan_id

    def _reserved(self, members: tuple[int, ...]) -> tuple[Reserved, ...]:
        """The plans of other groups that move, are held, or are being planned before this one."""
        begun = [(move.slot, move.plan_id, move.members) for move in self.moves.active()]
        planning = [(admitted.slot, admitted.plan_id, admitted.members) for admitted in self._planning.values()]
        return tuple(
            Reserved(slot=slot, plan_id=plan_id)
            for slot, plan_id, others in begun + planning
            if slot is not None and not set(members) & set(others)
        )

    def _take_slot(self, world: World) -> int:
        used = {move.slot for move in self.moves.active()} | {a.slot for a in self._planning.values()}
        used |= {view.slot for view in world.groups}
        slot = self._slots.take({s for s in used if s is not None})
        if slot is None:
            raise Refusal(ErrorCode.BUSY, f"all {PLAN_SLOTS} plan slots are in use")
        return slot

    # --- planned ------------------------------------------------------------------------------------------------

    def observe(self, world: World) -> None:
        """The newest snapshot, which whatever follows is decided on."""
        self._world = world
        for move in self.moves.observe(world):
            details = {"plan_id": move.plan_id, "progress": move.progress, "group_name": move.group}
            what = f"move {move.plan_id} of {move.group} is held at {move.progress:.1%} of its path"
            self._ports.notice(Notice(EventKind.MOVE_HELD, what, severity="warning", tick=world.tick, details=details))

    def _planned(self, admitted: Admitted, plan: MoveReply, ahead: JogAhead | None) -> None:
        world = self._current()
        self._planning.pop(admitted.plan_id, None)
        reply = plan.model_copy(update={"request_id": admitted.asker.request_id, "now_s": world.now_s})
        try:
            if admitted.slot is None:
                admitted.asker.begun(reply, ahead, world)
            else:
                self._commit(admitted, reply, ahead, admitted.slot, world)
        except Refusal as refusal:
            admitted.asker.refused(refusal, world)
        except Exception as error:
            admitted.asker.failed(error, world)

    def _not_planned(self, admitted: Admitted, refusal: Refusal) -> None:
        self._planning.pop(admitted.plan_id, None)
        admitted.asker.refused(refusal, self._current())

    def _commit(self, admitted: Admitted, reply: MoveReply, ahead: JogAhead | None, slot: int, world: World) -> None:
        """Checks again what time may have changed, and begins the move."""
        asked, members = admitted.asked, admitted.members
        admission.check_time(asked.not_after_s, world.now_ns)
        admission.check_running(world.phase)
        lease = self._leases.verify(asked.lease, members, world.now_ns)
        admission.check_controller(world)
        admission.check_movable(self._cell, members, world)
        if admitted.stop_counts != tuple(self._ports.stop_count(member) for member in members):
            raise Refusal(ErrorCode.WRONG_STATE, f"{asked.group} was stopped while the move was planned")
        jog_until_ns = admitted.asker.begin_until(world)
        reply = reply.model_copy(update={"move_id": move_id_of(admitted.plan_id)})
        move = Move(admitted.plan_id, asked.group, members, slot, reply.duration_s, world.now_ns)
        if reply.duration_s == 0.0:
            self._finish_at_once(admitted, move, reply, world)
            return
        command = BeginCommand(
            ref=self._calls.new_ref(),
            group=asked.group,
            plan_id=admitted.plan_id,
            slot=slot,
            epochs=(lease.epoch,) * len(members),
            stop_counts=admitted.stop_counts,
            jog_until_ns=jog_until_ns,
        )
        self._calls.send(
            None,
            command,
            world.now_ns,
            done=lambda then: self._accepted(admitted, move, reply, ahead, then),
            refused=lambda refusal: self._not_begun(admitted, move, refusal),
        )
        self.moves.add(move)

    def _not_begun(self, admitted: Admitted, move: Move, refusal: Refusal) -> None:
        self.moves.drop(move.plan_id)
        admitted.asker.refused(refusal, self._current())

    # --- begun --------------------------------------------------------------------------------------------------

    def _accepted(self, admitted: Admitted, move: Move, reply: MoveReply, ahead: JogAhead | None, world: World) -> None:
        move.accepted = True
        move.seen_ns = world.now_ns
        self._announce(admitted, move, reply, ahead, world)

    def _finish_at_once(self, admitted: Admitted, move: Move, reply: MoveReply, world: World) -> None:
        """A move to where the group already is: nothing to play, so the controller does not hear of it."""
        move.accepted, move.slot = True, None
        self.moves.add(move)
        self.moves.end(move.plan_id, MoveStatus.SUCCEEDED, None)
        self._announce(admitted, move, reply, None, world)
        details = {"plan_id": move.plan_id, "status": str(move.status), "reason": None, "group_name": move.group}
        what = f"move {move.plan_id} of {move.group} succeeded: it was there already"
        self._ports.notice(Notice(EventKind.MOVE_ENDED, what, details=details))

    def _announce(self, admitted: Admitted, move: Move, reply: MoveReply, ahead: JogAhead | None, world: World) -> None:
        """The reply first: a client waits for it."""
        asker, asked = admitted.asker, admitted.asked
        reply = reply.model_copy(update={"now_s": world.now_s})
        asker.begun(reply, ahead, world)
        entry = PlanLog(
            plan_id=move.plan_id,
            move_id=reply.move_id,
            group=move.group,
            request_id=asker.request_id,
            user=asker.user,
            move=asked.move.model_dump(mode="json"),
            speed_scale=asked.speed_scale,
            start=admitted.start,
            reply=reply,
        )
        plan_id = move.plan_id if move.slot is not None else None
        self._ports.log(LOG_PLANS, entry.model_dump(mode="json"), slot=move.slot, plan_id=plan_id)
        details = {
            "move_id": reply.move_id, "plan_id": move.plan_id, "duration_s": reply.duration_s, "user": asker.user,
            "kind": asked.move.kind,
        }  # fmt: skip
        what = f"{reply.move_id} of {move.group} accepted, {reply.duration_s:.6g} s"
        self._ports.notice(Notice(EventKind.MOVE_ACCEPTED, what, details=details | {"group_name": move.group}))

    def on_ended(self, plan_id: object, status: object, reason: object) -> None:
        """The controller says that a move has ended."""
        if isinstance(plan_id, int) and status in set(MoveStatus):
            self.moves.end(plan_id, MoveStatus(str(status)), reason if isinstance(reason, str) else None)

    def on_controller_down(self) -> None:
        """Whatever moved is stopped by its drives now."""
        for move in self.moves.active():
            self.moves.end(move.plan_id, MoveStatus.FAILED, "the controller went down")

    def adopt(self, world: World) -> None:
        """After a restart of front: moves that the controller plays or holds are ours again."""
        for view in world.groups:
            if view.plan_id == 0 or view.slot < 0 or self.moves.get(view.plan_id) is not None:
                continue
            members = tuple(i for i, other in enumerate(world.groups) if other.plan_id == view.plan_id)
            duration = self._ports.plan_duration(view.slot, view.plan_id)
            if duration is None:
                continue
            self.moves.add(
                Move(view.plan_id, self._name(members), members, view.slot, duration, world.now_ns, accepted=True)
            )
            self._next_plan_id = max(self._next_plan_id, view.plan_id + 1)

    def _name(self, members: tuple[int, ...]) -> str:
        names = [*self._cell.group_names, *(compound.name for compound in self._cell.compounds)]
        return next(
            (name for name in names if self._cell.members(name) == members), "+".join(names[m] for m in members)
        )

    def _current(self) -> World:
        assert self._world is not None, "observe() comes first"
        return self._world
