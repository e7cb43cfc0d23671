"""Commands sent to the controller, and what to do when they are answered, or not."""

from collections.abc import Callable
from dataclasses import dataclass

from axisync_schemas.errors import ErrorBody, ErrorCode, Refusal
from axisync_schemas.internal import Command, ControllerReply
from axisync_service.actioner.desk import Call, Desk
from axisync_service.actioner.ports import Ports
from axisync_service.actioner.world import World

TIMEOUT_NS = 8 * 10**9
"""Enabling releases brakes, and bring-up may be going on."""


@dataclass(frozen=True, slots=True)
class Pending:
    """A command on its way; without a call, `refused` is all that hears of a refusal."""

    call: Call | None
    until_ns: int
    done: Callable[[World], None]
    refused: Callable[[Refusal], None]
    heard: Callable[[ControllerReply], None]
    timeout_ns: int


class ControllerCalls:
    """Matches the controller's replies to the commands they answer."""

    def __init__(self, ports: Ports, desk: Desk) -> None:
        self._ports = ports
        self._desk = desk
        self._next_ref = 1
        self._pending: dict[int, Pending] = {}

    def new_ref(self) -> int:
        """A number for the next command."""
        self._next_ref += 1
        return self._next_ref

    def send(
        self,
        call: Call | None,
        command: Command,
        now_ns: int,
        done: Callable[[World], None],
        refused: Callable[[Refusal], None] = lambda _: None,
        heard: Callable[[ControllerReply], None] = lambda _: None,
        timeout_ns: int = TIMEOUT_NS,
    ) -> None:
        """Sends a command; then `heard` (the reply itself) and `done`, or `refused` and the call is refused.

        Raises:
            Refusal: UNAVAILABLE, the controller cannot be reached.
        """
        if not self._ports.to_controller(command):
            raise Refusal(ErrorCode.UNAVAILABLE, "the controller cannot be reached")
        self._pending[command.ref] = Pending(call, now_ns + timeout_ns, done, refused, heard, timeout_ns)

    def on_reply(self, reply: ControllerReply, world: World) -> None:
        """The controller has answered."""
        pending = self._pending.pop(reply.ref, None)
        if pending is None:
            return
        if reply.error is None:
            pending.heard(reply)
            pending.done(world)
        else:
            self._refuse(pending, _refusal(reply.error), world)

    def on_down(self, world: World) -> None:
        """The controller is gone: what was sent is lost."""
        lost, self._pending = self._pending, {}
        for pending in lost.values():
            self._refuse(pending, Refusal(ErrorCode.UNAVAILABLE, "the controller went down"), world)

    def on_time(self, world: World) -> None:
        """Gives up on what was not answered. What a late answer then says shows in `state` and `moves`."""
        for ref in [ref for ref, pending in self._pending.items() if pending.until_ns <= world.now_ns]:
            pending = self._pending.pop(ref)
            message = f"the controller did not answer within {pending.timeout_ns / 1e9:g} s"
            self._refuse(pending, Refusal(ErrorCode.UNAVAILABLE, message), world)

    def _refuse(self, pending: Pending, refusal: Refusal, world: World) -> None:
        pending.refused(refusal)
        if pending.call is not None:
            self._desk.refuse(pending.call, refusal, world.now_ns)


def _refusal(error: ErrorBody) -> Refusal:
    refusal = Refusal(error.code, error.message)
    refusal.details = error.details
    return refusal
