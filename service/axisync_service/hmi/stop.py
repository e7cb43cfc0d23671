"""`stop`, handled in its own callback thread: nothing queues before it, and the actor need not be free."""

import time
from collections.abc import Callable

from axisync_schemas.cell import Cell
from axisync_schemas.commands import StopRequest
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.memory import Control, GroupWord
from axisync_schemas.replies import GroupReply
from axisync_service.actioner.ports import Answer
from axisync_service.actioner.requests import Unreadable, members_of, parse_as
from axisync_service.actioner.world import World


class StopHandler:
    """Grows the stop counters of the groups named; the cycle compares them every tick and stops compounds whole.

    Anyone connected may stop, without a lease, at any time. Not idempotent by request_id: a stop is harmless twice.
    """

    def __init__(self, cell: Cell, control: Control, look: Callable[[], World]) -> None:
        """`look`: the robot now, from a reader of this thread's own."""
        self._cell = cell
        self._control = control
        self._look = look

    def __call__(self, body: bytes) -> Answer:
        """Stops, then says in which states the groups are. An empty body stops all."""
        request_id = None
        try:
            request = parse_as(StopRequest, body or b"{}")
            request_id = str(request.request_id)
            members = members_of(self._cell, request.group)
            for member in members:
                count = self._control.group(member, GroupWord.STOP_COUNT)
                self._control.set_group(member, GroupWord.STOP_COUNT, count + 1)
            return Answer(self._reply(request_id, members).model_dump_json().encode(), is_error=False)
        except Unreadable as refusal:
            return Answer(refusal.body(refusal.request_id).model_dump_json().encode(), is_error=True)
        except Refusal as refusal:
            return Answer(refusal.body(request_id).model_dump_json().encode(), is_error=True)

    def _reply(self, request_id: str, members: tuple[int, ...]) -> GroupReply:
        world = self._look()
        if not world.up:
            raise Refusal(ErrorCode.UNAVAILABLE, "the controller is down; its drives stop by themselves")
        labels = world.labels(self._cell.group_names, members)
        return GroupReply(request_id=request_id, now_s=time.monotonic_ns() / 1e9, groups=labels)
