"""`move` and `plan`: admission, planning, and handing the plan to the controller.

The life of a move: admitted -> planned -> checked again -> begun -> accepted (the reply) -> `moves`. Planning takes
time, in which a lease may be lost or a stop may come; so what was true at admission is checked again, here and by the
controller.
"""

from dataclasses import dataclass

from axisync_schemas.cell import Cell
from axisync_schemas.commands import MoveRequest
from axisync_schemas.enumerations import MoveStatus
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.events import EventKind
from axisync_schemas.internal import BeginCommand, PlanJob, Reserved
from axisync_schemas.log_models import PlanLog
from axisync_schemas.memory import PLAN_SLOTS
from axisync_schemas.replies import MoveReply
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


@dataclass(frozen=True, slots=True)
class Admitted:
    """A move on its way to a plan, with what must still be true when it has one.

    Attributes:
        slot: plan slot, or None for the verb `plan`, which is only told what would be.
        stop_counts: of each member; a stop in between ends the move before it begins.
    """

    call: Call
    request: MoveRequest
    members: tuple[int, ...]
    plan_id: int
    slot: int | None
    start: tuple[float, ...]
    stop_counts: tuple[int, ...]


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
        self._check_free(members, commit)
        axes = self._axes(members)
        start = tuple(world.setpoint[i] for i in axes)
        self._submit(call, request, members, start, world)

    def _axes(self, members: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(i for member in members for i in self._cell.axis_indices(self._cell.group_names[member]))

    def _check_free(self, members: tuple[int, ...], commit: bool) -> None:
        """One plan at a time for each group; and a move that is about to begin holds it too."""
        for member in members:
            name = self._cell.group_names[member]
            if any(member in admitted.members for admitted in self._planning.values()):
                raise Refusal(ErrorCode.BUSY, f"{name}: a move is being planned", group=name)
            move = self.moves.on_group(member) if commit else None
            if move is not None:
                busy = move_id_of(move.plan_id)
                raise Refusal(ErrorCode.BUSY, f"{name}: move {busy} has not ended", group=name, move_id=busy)

    def _submit(
        self, call: Call, request: MoveRequest, members: tuple[int, ...], start: tuple[float, ...], world: World
    ) -> None:
        slot = self._take_slot(world) if call.verb == "move" else None
        plan_id, self._next_plan_id = self._next_plan_id, self._next_plan_id + 1
        stops = tuple(self._ports.stop_count(member) for member in members)
        admitted = Admitted(call, request, members, plan_id, slot, start, stops)
        reserved = self._reserved(members)
        self._planning[plan_id] = admitted
        job = PlanJob(
            ref=plan_id,
            group=request.group,
            plan_id=plan_id,
            slot=slot,
            start=start,
            rest=world.setpoint,
            reserved=reserved,
            move=request.move,
            speed_scale=request.speed_scale,
        )
        self.planner.submit(
            job,
            done=lambda plan: self._planned(admitted, plan),
            refused=lambda refusal: self._not_planned(admitted, refusal),
            now_ns=world.now_ns,
        )

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

    def _planned(self, admitted: Admitted, plan: MoveReply) -> None:
        world = self._current()
        self._planning.pop(admitted.plan_id, None)
        reply = plan.model_copy(update={"request_id": admitted.call.request_id, "now_s": world.now_s})
        try:
            if admitted.slot is None:
                self._desk.reply(admitted.call, reply, world.now_ns)
            else:
                self._commit(admitted, reply, admitted.slot, world)
        except Refusal as refusal:
            self._desk.refuse(admitted.call, refusal, world.now_ns)
        except Exception as error:
            self._desk.fail(admitted.call, error, world.now_ns)

    def _not_planned(self, admitted: Admitted, refusal: Refusal) -> None:
        self._planning.pop(admitted.plan_id, None)
        self._desk.refuse(admitted.call, refusal, self._current().now_ns)

    def _commit(self, admitted: Admitted, reply: MoveReply, slot: int, world: World) -> None:
        """Checks again what time may have changed, and begins the move."""
        request, members = admitted.request, admitted.members
        admission.check_time(request.not_after_s, world.now_ns)
        admission.check_running(world.phase)
        lease = self._leases.verify(request.lease, members, world.now_ns)
        admission.check_controller(world)
        admission.check_movable(self._cell, members, world)
        if admitted.stop_counts != tuple(self._ports.stop_count(member) for member in members):
            raise Refusal(ErrorCode.WRONG_STATE, f"{request.group} was stopped while the move was planned")
        reply = reply.model_copy(update={"move_id": move_id_of(admitted.plan_id)})
        move = Move(admitted.plan_id, request.group, members, slot, reply.duration_s, world.now_ns)
        if reply.duration_s == 0.0:
            self._finish_at_once(admitted, move, reply, world)
            return
        command = BeginCommand(
            ref=self._calls.new_ref(),
            group=request.group,
            plan_id=admitted.plan_id,
            slot=slot,
            epochs=(lease.epoch,) * len(members),
            stop_counts=admitted.stop_counts,
        )
        self._calls.send(
            admitted.call,
            command,
            world.now_ns,
            done=lambda then: self._accepted(admitted, move, reply, then),
            refused=lambda: self._not_begun(move),
        )
        self.moves.add(move)

    def _not_begun(self, move: Move) -> None:
        self.moves.drop(move.plan_id)

    # --- begun --------------------------------------------------------------------------------------------------

    def _accepted(self, admitted: Admitted, move: Move, reply: MoveReply, world: World) -> None:
        move.accepted = True
        move.seen_ns = world.now_ns
        self._announce(admitted, move, reply, world)

    def _finish_at_once(self, admitted: Admitted, move: Move, reply: MoveReply, world: World) -> None:
        """A move to where the group already is: nothing to play, so the controller does not hear of it."""
        move.accepted, move.slot = True, None
        self.moves.add(move)
        self.moves.end(move.plan_id, MoveStatus.SUCCEEDED, None)
        self._announce(admitted, move, reply, world)
        details = {"plan_id": move.plan_id, "status": str(move.status), "reason": None, "group_name": move.group}
        what = f"move {move.plan_id} of {move.group} succeeded: it was there already"
        self._ports.notice(Notice(EventKind.MOVE_ENDED, what, details=details))

    def _announce(self, admitted: Admitted, move: Move, reply: MoveReply, world: World) -> None:
        call, request = admitted.call, admitted.request
        reply = reply.model_copy(update={"now_s": world.now_s})
        entry = PlanLog(
            plan_id=move.plan_id,
            move_id=reply.move_id,
            group=move.group,
            request_id=call.request_id,
            user=call.user,
            move=request.move.model_dump(mode="json"),
            speed_scale=request.speed_scale,
            start=admitted.start,
            reply=reply,
        )
        plan_id = move.plan_id if move.slot is not None else None
        self._ports.log(LOG_PLANS, entry.model_dump(mode="json"), slot=move.slot, plan_id=plan_id)
        details = {"move_id": reply.move_id, "plan_id": move.plan_id, "duration_s": reply.duration_s, "user": call.user}
        what = f"{reply.move_id} of {move.group} accepted, {reply.duration_s:.6g} s"
        self._ports.notice(Notice(EventKind.MOVE_ACCEPTED, what, details=details | {"group_name": move.group}))
        self._desk.reply(call, reply, world.now_ns)

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
