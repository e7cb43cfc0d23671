"""Plays plans from a file, without front: enables the group, plays each plan in turn, and lets the service stop.

The file is a JSON array of plans as the log's `/plans` holds them, each beginning where the one before it ends.
"""

import mmap
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter, ValidationError

from axisync_schemas.events import EventKind
from axisync_schemas.internal import CONTROLLER_MESSAGE, BeginCommand, Command, ControllerReply, GroupCommand
from axisync_schemas.log_models import PlanLog
from axisync_schemas.memory import PLAN_SLOTS
from axisync_schemas.plan_slots import Plan, codes_of_text, write_plan

_PLANS = TypeAdapter(list[PlanLog])


class PlanFileError(Exception):
    """The file is refused, or a plan of it was; one sentence."""


def read_plans(path: Path) -> list[PlanLog]:
    """The plans of a file.

    Raises:
        PlanFileError: unreadable, no plans, or too many.
    """
    try:
        plans = _PLANS.validate_json(path.read_bytes())
    except (OSError, ValidationError) as error:
        raise PlanFileError(f"{path}: {error}") from None
    if not 1 <= len(plans) <= PLAN_SLOTS:
        raise PlanFileError(f"{path}: {len(plans)} plans, must be 1 to {PLAN_SLOTS}")
    return plans


def store(plans: list[PlanLog], buffer: mmap.mmap | bytearray) -> None:
    """Writes plan i into slot i."""
    for slot, plan in enumerate(plans):
        write_plan(buffer, slot, slot_plan(plan))


def slot_plan(plan: PlanLog) -> Plan:
    """A logged plan as the controller reads it from its slot.

    Raises:
        PlanError: its tables cannot be read.
    """
    return Plan(
        plan_id=plan.plan_id,
        axes=np.array(plan.axes, dtype=np.uint32),
        knots=np.array(plan.knots),
        coefficients=np.array(plan.coefficients),
        start=np.array(plan.start),
        end=np.array(plan.end),
        rate_codes=codes_of_text(plan.rate_codes, *plan.rate_shape),
        rate_limits=np.array(plan.rate_limits),
    )


class PlanFile:
    """Commands the controller as front would, from a script.

    Attributes:
        finished: every plan was played, or one was refused.
        failure: why it ended early.
    """

    leases_needed = False
    malformed = 0
    connected = True

    def __init__(self, plans: list[PlanLog]) -> None:
        self.finished = False
        self.failure: str | None = None
        self._script = self._commands(plans)
        self._next: GroupCommand | BeginCommand | None = None
        self._sent: GroupCommand | BeginCommand | None = None
        self._advance()

    @staticmethod
    def _commands(plans: list[PlanLog]) -> Iterator[GroupCommand | BeginCommand]:
        for group in dict.fromkeys(plan.group for plan in plans):
            yield GroupCommand(op="enable", ref=0, group=group)
        for slot, plan in enumerate(plans):
            yield BeginCommand(ref=slot + 1, group=plan.group, plan_id=plan.plan_id, slot=slot, epochs=())

    def _advance(self) -> None:
        self._next = next(self._script, None)
        self.finished = self._next is None

    def poll(self) -> list[Command]:
        """The next command, once what came before it is done."""
        command, self._next = self._next, None
        if command is None:
            return []
        self._sent = command
        return [command]

    def send(self, packet: bytes) -> None:
        """Hears what the controller says."""
        message = CONTROLLER_MESSAGE.validate_json(packet)
        if isinstance(message, ControllerReply):
            if message.error is not None:
                # A drive that is still being brought up will be ready soon: ask again.
                if message.ref == 0 and message.error.code.value == "UNAVAILABLE":
                    self._next = self._sent
                else:
                    self.failure, self.finished = message.error.message, True
            elif message.ref == 0:
                self._advance()
        elif message.event.kind == EventKind.MOVE_ENDED:
            if message.event.details["status"] != "succeeded":
                self.failure, self.finished = message.event.message, True
            else:
                self._advance()

    def close(self) -> None:
        """Nothing to close."""
