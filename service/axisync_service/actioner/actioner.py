"""The actioner: takes commands in, decides, and leads what it accepts to its end. No IO of its own, no clock."""

from collections.abc import Callable
from typing import TypeVar

from axisync_schemas.cell import Cell
from axisync_schemas.commands import GroupRequest, JogRequest, LeaseRequest, MoveRequest, OverrideRequest, Request
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.events import EventKind
from axisync_schemas.internal import ControllerEvent, ControllerReply, GroupCommand, OverrideCommand, PlanResult
from axisync_schemas.replies import GroupReply, LeaseReply, MoveReport
from axisync_service.actioner import admission
from axisync_service.actioner.controller_calls import TIMEOUT_NS, ControllerCalls
from axisync_service.actioner.desk import Call, Desk
from axisync_service.actioner.drive_objects import DriveObjects
from axisync_service.actioner.jogger import Jogger
from axisync_service.actioner.leases import Lease, Leases
from axisync_service.actioner.mover import Mover
from axisync_service.actioner.moves import report
from axisync_service.actioner.ports import Incoming, Notice, Ports
from axisync_service.actioner.requests import Unreadable, members_of, parse
from axisync_service.actioner.world import World

Handler = Callable[[Call, World], None]
R = TypeVar("R", bound=Request)


class Actioner:
    """Everything between a command's bytes and the robot, as decisions on snapshots.

    Whoever runs it calls `observe` with a new snapshot before each of the other methods.
    """

    def __init__(self, cell: Cell, ports: Ports, epochs: tuple[int, ...], first_plan_id: int) -> None:
        self._cell = cell
        self._ports = ports
        self._desk = Desk(ports)
        self.leases = Leases(cell.group_names, epochs)
        self._calls = ControllerCalls(ports, self._desk)
        self._mover = Mover(cell, ports, self._desk, self.leases, self._calls, first_plan_id)
        self._jogger = Jogger(cell, ports, self._desk, self.leases, self._calls, self._mover)
        self._drives = DriveObjects(cell, self._desk, self.leases, self._calls)
        self._was_up = False
        self._handlers: dict[str, Handler] = {
            "move": self._move,
            "plan": self._move,
            "jog": self._jog,
            "enable": self._group,
            "disable": self._group,
            "reset": self._group,
            "home": self._group,
            "hold": self._group,
            "resume": self._group,
            "override": self._override,
            "drive": self._drives.handle,
            "lease": self._lease,
        }
        for group, epoch in enumerate(epochs):  # No lease of an earlier front holds.
            ports.set_lease(group, epoch, 0)

    # --- what happens -------------------------------------------------------------------------------------------

    def observe(self, world: World) -> None:
        """A new snapshot. Notices that the controller came or went, and moves that it plays."""
        self._mover.observe(world)
        if world.up:
            self._mover.adopt(world)
        elif self._was_up:
            self._calls.on_down(world)
            self._mover.on_controller_down()
            self._jogger.on_controller_down(world)
        self._was_up = world.up

    def on_command(self, incoming: Incoming, world: World) -> None:
        """One command. It is answered now or later, but always."""
        try:
            request = parse(incoming.verb, incoming.body)
        except Unreadable as refusal:
            self._desk.unreadable(incoming, refusal, world.now_ns)
            return
        call = self._desk.open(incoming, request, world.now_ns)
        if call is not None:
            self._carry_out(call, world)

    def _carry_out(self, call: Call, world: World) -> None:
        try:
            admission.check_time(call.request.not_after_s, world.now_ns)
            self._handlers[call.verb](call, world)
        except Refusal as refusal:
            self._desk.refuse(call, refusal, world.now_ns)
        except Exception as error:
            self._desk.fail(call, error, world.now_ns)

    def on_controller(self, message: ControllerReply | ControllerEvent, world: World) -> None:
        """A reply or an event of the controller."""
        if isinstance(message, ControllerReply):
            self._calls.on_reply(message, world)
        elif message.event.kind == EventKind.MOVE_ENDED:
            details = message.event.details
            self._mover.on_ended(details.get("plan_id"), details.get("status"), details.get("reason"))
            self._jogger.on_ended(details.get("plan_id"), details.get("reason"), world)

    def on_plan(self, result: PlanResult, world: World) -> None:
        """The planner has answered."""
        self._mover.planner.on_result(result, world.now_ns)

    def on_planner_down(self) -> None:
        """The planner is gone."""
        self._mover.planner.on_down()

    def on_time(self, world: World) -> None:
        """Leases that lapse, and what took too long. To be called every few milliseconds."""
        self._lapse(world.now_ns)
        self._calls.on_time(world)
        self._mover.planner.on_time(world.now_ns)
        self._jogger.on_time(world)

    def find_move(self, move_id: str, now_ns: int) -> MoveReport:
        """`moves/<move_id>`.

        Raises:
            Refusal: NOT_FOUND.
        """
        move = self._mover.moves.find(move_id)
        if move is None:
            raise Refusal(ErrorCode.NOT_FOUND, "no such move; the newest 1,000 since front's start are kept")
        return report(move, now_ns)

    def progress(self, plan_id: int) -> float | None:
        """How far a move is, 0..1; None for one not known."""
        move = self._mover.moves.get(plan_id)
        return move.progress if move is not None else None

    def holders(self, now_ns: int) -> dict[str, str | None]:
        """User who holds each group."""
        held = {name: self.leases.holder(i, now_ns) for i, name in enumerate(self._cell.group_names)}
        return {name: lease.user if lease is not None else None for name, lease in held.items()}

    # --- the verbs ----------------------------------------------------------------------------------------------

    def _move(self, call: Call, world: World) -> None:
        if call.verb == "move":
            admission.check_logged(world)
        self._mover.handle(call, _as(MoveRequest, call.request), world)

    def _jog(self, call: Call, world: World) -> None:
        self._jogger.handle(call, _as(JogRequest, call.request), world)

    def _group(self, call: Call, world: World) -> None:
        """enable, disable, reset, home, hold, resume: the controller decides, and answers when it is done."""
        request = _as(GroupRequest, call.request)
        members = members_of(self._cell, request.group)
        if call.verb not in ("disable", "hold"):
            admission.check_running(world.phase)
        self.leases.verify(request.lease, members, world.now_ns)
        admission.check_controller(world)
        command = GroupCommand.model_validate({"op": call.verb, "ref": self._calls.new_ref(), "group": request.group})
        timeout_ns = self._homing_ns(members) if call.verb == "home" else TIMEOUT_NS
        self._calls.send(
            call,
            command,
            world.now_ns,
            done=lambda then: self._group_done(call, members, then),
            timeout_ns=timeout_ns,
        )

    def _override(self, call: Call, world: World) -> None:
        request = _as(OverrideRequest, call.request)
        members = members_of(self._cell, request.group)
        self.leases.verify(request.lease, members, world.now_ns)
        admission.check_controller(world)
        command = OverrideCommand(ref=self._calls.new_ref(), group=request.group, value=request.value)
        self._calls.send(call, command, world.now_ns, done=lambda then: self._group_done(call, members, then))

    def _homing_ns(self, members: tuple[int, ...]) -> int:
        """As long as every drive of the groups may take, one after the other."""
        groups = [self._cell.groups[member] for member in members]
        homings = [axis.drive.homing for group in groups for axis in group.axes]
        return TIMEOUT_NS + round(sum(1e9 * homing.timeout_s + TIMEOUT_NS for homing in homings if homing is not None))

    def _group_done(self, call: Call, members: tuple[int, ...], world: World) -> None:
        labels = world.labels(self._cell.group_names, members)
        reply = GroupReply(request_id=call.request_id, now_s=world.now_s, groups=labels)
        self._desk.reply(call, reply, world.now_ns)

    def _lease(self, call: Call, world: World) -> None:
        request, now_ns = _as(LeaseRequest, call.request), world.now_ns
        self._lapse(now_ns)
        groups = self._lease_groups(request)
        ttl_ns = round(request.ttl_s * 1e9)
        match request.action:
            case "acquire":
                lease = self.leases.acquire(call.user, groups, ttl_ns, now_ns)
                self._granted(lease, EventKind.LEASE_ACQUIRED)
            case "take":
                lease, losers = self.leases.take(call.user, groups, ttl_ns, now_ns)
                self._granted(lease, EventKind.LEASE_TAKEN, losers)
            case "renew":
                lease = self.leases.renew(request.lease, groups, ttl_ns, now_ns)
                self._write(lease)
            case "release":
                lease = self.leases.release(request.lease, groups, now_ns)
                self._released(lease, groups)
        expires_in_s = request.ttl_s if request.action != "release" else 0.0
        reply = LeaseReply(
            request_id=call.request_id,
            now_s=world.now_s,
            lease=lease.token,
            epoch=lease.epoch,
            expires_in_s=expires_in_s,
        )
        self._desk.reply(call, reply, now_ns)

    def _lapse(self, now_ns: int) -> None:
        for lease in self.leases.lapse(now_ns):
            for group in lease.groups:
                self._ports.set_lease(group, lease.epoch, 0)
            what = f"{self._names(lease.groups)}: lease of {lease.user} lapsed"
            self._tell_lease(EventKind.LEASE_LAPSED, lease, lease.groups, what)

    def _lease_groups(self, request: LeaseRequest) -> tuple[int, ...]:
        named = [members_of(self._cell, name, f"groups[{i}]") for i, name in enumerate(request.groups)]
        return tuple(sorted({member for members in named for member in members}))

    def _granted(self, lease: Lease, kind: EventKind, losers: list[Lease] | None = None) -> None:
        self._write(lease)
        lost = f", taken from {', '.join(sorted({loser.user for loser in losers}))}" if losers else ""
        self._tell_lease(kind, lease, lease.groups, f"{self._names(lease.groups)}: lease of {lease.user}{lost}")

    def _released(self, lease: Lease, groups: tuple[int, ...]) -> None:
        for group in groups:
            self._ports.set_lease(group, lease.epoch, 0)
        what = f"{self._names(groups)}: lease of {lease.user} released"
        self._tell_lease(EventKind.LEASE_RELEASED, lease, groups, what)

    def _write(self, lease: Lease) -> None:
        for group in lease.groups:
            self._ports.set_lease(group, lease.epoch, lease.until_ns)

    def _tell_lease(self, kind: EventKind, lease: Lease, groups: tuple[int, ...], message: str) -> None:
        names = [self._cell.group_names[g] for g in groups]
        details = {"user": lease.user, "epoch": lease.epoch, "groups": names}
        severity = "warning" if kind is EventKind.LEASE_LAPSED else "info"
        group = names[0] if len(names) == 1 else None
        self._ports.notice(Notice(kind, message, group=group, severity=severity, details=details))

    def _names(self, groups: tuple[int, ...]) -> str:
        return ", ".join(self._cell.group_names[g] for g in groups)


def _as(model: type[R], request: Request) -> R:
    """The request as its own type; `parse` has made it one."""
    if not isinstance(request, model):
        raise TypeError(f"{type(request).__name__} is no {model.__name__}")
    return request
