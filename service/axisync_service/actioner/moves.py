"""The life of accepted moves: executing, held, then succeeded, stopped or failed."""

from collections import OrderedDict
from dataclasses import dataclass

from axisync_schemas.enumerations import GroupState, MoveStatus
from axisync_schemas.replies import MoveReport
from axisync_service.actioner.world import GroupView, World

KEEP_AT_MOST = 1000
UNSEEN_NS = 1_000_000_000
"""A move that the controller does not show for this long has ended without our hearing of it."""


def move_id_of(plan_id: int) -> str:
    """The name of a move on the wire."""
    return f"m-{plan_id}"


@dataclass(slots=True)
class Move:
    """One move.

    Attributes:
        slot: plan slot it is played from; None for a move of zero length, which nobody plays.
        accepted: the controller has taken it; until then nobody is told of it.
        seen_ns: when the controller last showed it.
    """

    plan_id: int
    group: str
    members: tuple[int, ...]
    slot: int | None
    duration_s: float
    seen_ns: int
    accepted: bool = False
    status: MoveStatus = MoveStatus.EXECUTING
    progress: float = 0.0
    reason: str | None = None


class Moves:
    """Active moves, and the newest 1,000 of those that have ended, by plan id."""

    def __init__(self) -> None:
        self._active: dict[int, Move] = {}
        self._ended: OrderedDict[int, Move] = OrderedDict()

    def add(self, move: Move) -> None:
        """A move that is about to begin, or was found going on."""
        self._active[move.plan_id] = move

    def drop(self, plan_id: int) -> None:
        """The controller refused it: it never was."""
        self._active.pop(plan_id, None)

    def active(self) -> list[Move]:
        """The moves that hold groups and slots: at most one for each group."""
        return list(self._active.values())

    def on_group(self, group: int) -> Move | None:
        """The active move of an elementary group."""
        return next((move for move in self._active.values() if group in move.members), None)

    def get(self, plan_id: int) -> Move | None:
        """By its number, if it is among those kept."""
        return self._active.get(plan_id) or self._ended.get(plan_id)

    def is_over(self, plan_id: int) -> bool:
        """It has ended, or is not known."""
        return plan_id not in self._active

    def find(self, move_id: str) -> Move | None:
        """By its name on the wire."""
        number = move_id.removeprefix("m-")
        if not number.isdecimal() or len(number) > 20:
            return None
        move = self.get(int(number))
        return move if move is not None and move.accepted and move_id_of(move.plan_id) == move_id else None

    def end(self, plan_id: int, status: MoveStatus, reason: str | None) -> Move | None:
        """It has ended; None where it was not active."""
        move = self._active.pop(plan_id, None)
        if move is None:
            return None
        move.status, move.reason = status, reason
        if status is MoveStatus.SUCCEEDED:
            move.progress = 1.0
        self._ended[plan_id] = move
        if len(self._ended) > KEEP_AT_MOST:
            self._ended.popitem(last=False)
        return move

    def observe(self, world: World) -> list[Move]:
        """Follows progress, held and moving, as the tick records show them; returns the moves that are held since."""
        newly_held = []
        for move in self.active():
            views = [world.groups[m] for m in move.members if world.groups[m].plan_id == move.plan_id]
            if views:
                before = move.status
                _follow(move, views, world.now_ns)
                if move.status is MoveStatus.HELD and before is not MoveStatus.HELD:
                    newly_held.append(move)
            elif world.up and world.now_ns - move.seen_ns > UNSEEN_NS:
                self.end(move.plan_id, MoveStatus.FAILED, "its end was not seen")
        return newly_held


def _follow(move: Move, views: list[GroupView], now_ns: int) -> None:
    held = any(view.state is GroupState.HELD for view in views)
    move.status = MoveStatus.HELD if held else MoveStatus.EXECUTING
    move.reason = next((view.reason for view in views if view.reason), None) if held else None
    move.progress = min(1.0, views[0].path_s / move.duration_s)
    move.seen_ns = now_ns


def report(move: Move, now_ns: int) -> MoveReport:
    """`moves/<move_id>`."""
    return MoveReport(
        move_id=move_id_of(move.plan_id),
        group=move.group,
        status=move.status,
        progress=move.progress,
        reason=move.reason,
        duration_s=move.duration_s,
        now_s=now_ns / 1e9,
    )
