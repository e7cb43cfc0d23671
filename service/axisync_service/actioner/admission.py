"""What may be done now. Each check refuses with the value, the bound and, where there is one, the fix."""

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import GroupState, Phase
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_service.actioner.world import World

_MOVING = "{name} is {state}: one move at a time; wait for its end or stop it"
NOT_MOVABLE: dict[GroupState, tuple[ErrorCode, str]] = {
    GroupState.DISABLED: (ErrorCode.NOT_ENABLED, "{name} is disabled: enable it first"),
    GroupState.MOVING: (ErrorCode.BUSY, _MOVING),
    GroupState.HELD: (ErrorCode.WRONG_STATE, "{name} is held on the path of its last move: stop ends that move"),
    GroupState.STOPPING: (ErrorCode.BUSY, _MOVING),
    GroupState.HOMING: (ErrorCode.BUSY, _MOVING),
    GroupState.JOGGING: (ErrorCode.BUSY, _MOVING),
    GroupState.FAULT: (ErrorCode.FAULTED, "{name} has a fault: {reason}; reset acknowledges it"),
}
"""Why a group in a state cannot begin a move; STANDSTILL, the only one not here, can."""

NOT_AT_REST = frozenset({GroupState.MOVING, GroupState.STOPPING, GroupState.HOMING, GroupState.JOGGING})
"""States in which there is no start to plan from."""


def check_time(not_after_s: float | None, now_ns: int) -> None:
    """Refuses a command whose time has passed: STALE."""
    if not_after_s is not None and now_ns > not_after_s * 1e9:
        late = now_ns / 1e9 - not_after_s
        raise Refusal(ErrorCode.STALE, f"{late:.3f} s too late", not_after_s=not_after_s, now_s=now_ns / 1e9)


def check_running(phase: Phase) -> None:
    """Refuses while the service is stopping: UNAVAILABLE."""
    if phase is not Phase.RUNNING:
        raise Refusal(ErrorCode.UNAVAILABLE, "the service is stopping")


def check_controller(world: World) -> None:
    """Refuses while no cycle runs: UNAVAILABLE."""
    if not world.up or world.tick == 0:
        raise Refusal(ErrorCode.UNAVAILABLE, "the controller is down or starting; its drives stop by themselves")


def check_logged(world: World) -> None:
    """Refuses while the log cannot be written, so that no move begins of which nobody can say later what it was."""
    if world.unlogged:
        raise Refusal(
            ErrorCode.UNAVAILABLE,
            "the log cannot be written, so no move begins: make room on its disk, or mend it (see the events)",
        )


def check_movable(cell: Cell, members: tuple[int, ...], world: World) -> None:
    """Refuses unless every group stands still, enabled: NOT_ENABLED, BUSY, WRONG_STATE, FAULTED."""
    for member in members:
        _check_state(cell.group_names[member], world, member, NOT_MOVABLE)


def check_homed(cell: Cell, members: tuple[int, ...], world: World) -> None:
    """Refuses where an axis must be homed before it may move: NOT_HOMED."""
    drives = world.status.drives if world.status is not None else ()
    for member in members:
        name = cell.group_names[member]
        missing = [cell.axes[i].name for i in cell.axis_indices(name) if drives and drives[i].homed is False]
        if missing:
            message = f"{name}: {', '.join(missing)} must be homed first: `home {name}`"
            raise Refusal(ErrorCode.NOT_HOMED, message, group=name, axes=missing)


def check_at_rest(cell: Cell, members: tuple[int, ...], world: World) -> None:
    """Refuses while a group moves, for a plan that is only looked at: BUSY."""
    table = {state: why for state, why in NOT_MOVABLE.items() if state in NOT_AT_REST}
    for member in members:
        _check_state(cell.group_names[member], world, member, table)


def _check_state(name: str, world: World, member: int, table: dict[GroupState, tuple[ErrorCode, str]]) -> None:
    view = world.groups[member]
    if view.state not in table:
        return
    code, text = table[view.state]
    reason = view.reason or "the newest events say which"
    message = text.format(name=name, state=view.state.label, reason=reason)
    details = {"group": name, "state": view.state.label}
    raise Refusal(code, message, **details, **({"reason": reason} if code is ErrorCode.FAULTED else {}))
