"""The planner worker: `python -m axisync_service.planner_worker`. Plans one job after the other; may be killed."""

import contextlib
import gc
import logging
import mmap
import os
import selectors
import socket
import sys
import time
from collections.abc import Iterator, Sequence

from pydantic import ValidationError

from axisync_motion import backend
from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import Phase
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.internal import MAX_PACKET, Jog, PlanJob, PlanResult
from axisync_schemas.memory import Control, Word
from axisync_schemas.moves import JointMove, LinearMove, ToolPose
from axisync_schemas.plan_slots import Plan, PlanError, PlanTooLarge, read_plan, write_plan
from axisync_service.planner.jog_plan import plan_jog
from axisync_service.planner.models import Models
from axisync_service.planner.move_plan import Planned, plan_move
from axisync_service.process import ProcessContext, start

log = logging.getLogger(__name__)

HEARTBEAT_S = 0.1
SEND_S = 1.0
"""A front that does not take an answer for this long is gone."""


def solve(models: Models, plans: mmap.mmap, job: PlanJob) -> PlanResult:
    """Plans `job` and writes the plan into its slot. Every fault becomes an answer."""
    try:
        planned = plan_any(models, job, others(plans, job))
        if planned.plan is not None and job.slot is not None:
            write_plan(plans, job.slot, planned.plan)
        return PlanResult(ref=job.ref, plan=planned.reply, jog=planned.jog)
    except Refusal as refusal:
        return PlanResult(ref=job.ref, error=refusal.body())
    except PlanTooLarge as error:
        message = f"{error}: plan fewer steps at a time"
        return PlanResult(ref=job.ref, error=Refusal(ErrorCode.TOO_LARGE, message).body())
    except Exception as error:
        log.exception("planning failed group=%s plan_id=%d", job.group, job.plan_id)
        message = f"planning failed: {type(error).__name__}"
        return PlanResult(ref=job.ref, error=Refusal(ErrorCode.INTERNAL, message).body())


def plan_any(models: Models, job: PlanJob, reserved: tuple[Plan, ...] = ()) -> Planned:
    """A move, or a jog.

    Raises:
        Refusal: see `plan_move` and `plan_jog`.
    """
    return plan_jog(models, job, reserved) if isinstance(job.move, Jog) else plan_move(models, job, reserved)


def others(plans: mmap.mmap, job: PlanJob) -> tuple[Plan, ...]:
    """The plans that must be kept clear of; one whose slot holds another plan by now was refused and never begins."""
    found = []
    for reserved in job.reserved:
        with contextlib.suppress(PlanError):
            found.append(read_plan(plans, reserved.slot, reserved.plan_id))
    return tuple(found)


class Worker:
    """Accepts front, reads jobs, answers them in order."""

    def __init__(self, cell: Cell, control: Control, plans: mmap.mmap, listening: socket.socket) -> None:
        self.models = Models(cell)
        self._control = control
        self._plans = plans
        self._listening = listening
        listening.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(listening, selectors.EVENT_READ, self._accept)

    def step(self) -> None:
        """One wait of at most `HEARTBEAT_S`, and what came of it."""
        self._control[Word.PLANNER_NS] = time.monotonic_ns()
        for key, _ in self._selector.select(HEARTBEAT_S):
            key.data(key.fileobj)

    def close(self) -> None:
        """Closes all connections."""
        for key in list(self._selector.get_map().values()):
            if isinstance(key.fileobj, socket.socket):
                key.fileobj.close()
        self._selector.close()

    def _accept(self, listening: socket.socket) -> None:
        try:
            connection, _ = listening.accept()
        except BlockingIOError:
            return
        connection.settimeout(SEND_S)
        self._selector.register(connection, selectors.EVENT_READ, self._receive)

    def _receive(self, connection: socket.socket) -> None:
        try:
            packet = connection.recv(MAX_PACKET)
            if packet:
                self._answer(connection, packet)
                return
        except OSError as error:
            log.warning("front lost error=%r", error)
        self._selector.unregister(connection)
        connection.close()

    def _answer(self, connection: socket.socket, packet: bytes) -> None:
        try:
            job = PlanJob.model_validate_json(packet)
        except ValidationError as error:
            log.error("job=malformed errors=%d", error.error_count())
            return
        connection.send(solve(self.models, self._plans, job).model_dump_json().encode())


def main(arguments: Sequence[str] | None = None) -> int:
    """Works until the service stops."""
    context = start("planner", arguments)
    context.control[Word.PLANNER_NS] = 0  # until warm
    context.control[Word.PLANNER_PID] = os.getpid()
    worker = make_worker(context)
    warm_up(worker.models)
    log.info("backend=%s", backend())
    gc.collect()
    gc.freeze()
    try:
        while context.phase() is Phase.RUNNING:
            worker.step()
    finally:
        worker.close()
    return 0


def warm_up(models: Models) -> None:
    """A first plan takes many times as long as those that follow: here it keeps nobody waiting.

    Whatever goes wrong here goes wrong again for whoever asks for such a move, and for nobody else.
    """
    cell = models.cell
    rest = tuple(axis.drive.start for axis in cell.axes)
    for name in (*cell.group_names, *(compound.name for compound in cell.compounds)):
        start = tuple(rest[i] for i in cell.axis_indices(name))
        still = ToolPose(position=(0.0, 0.0, 0.01))
        along = LinearMove(target=dict.fromkeys(_arms(models, name), still), relative=True)
        for move in (JointMove(target=(0.01,) * len(start), relative=True), along):
            job = PlanJob(ref=0, group=name, plan_id=0, slot=0, start=start, rest=rest, move=move, speed_scale=1.0)
            with _tried(job):
                plan_move(models, job)
        for space, velocity in (("joint", (0.1,) * len(start)), ("base", (0.0, 0.0, 0.01))):
            jog = Jog.model_validate({"space": space, "velocity": velocity})
            job = PlanJob(ref=0, group=name, plan_id=0, slot=0, start=start, rest=rest, move=jog, speed_scale=1.0)
            with _tried(job):
                plan_jog(models, job)


@contextlib.contextmanager
def _tried(job: PlanJob) -> Iterator[None]:
    try:
        yield
    except Refusal:
        pass
    except Exception:
        log.exception("warm-up failed group=%s", job.group)


def _arms(models: Models, name: str) -> list[str]:
    return [member.group.name for member in models.members(name) if member.arm is not None]


def make_worker(context: ProcessContext) -> Worker:
    """The worker on what the supervisor passed."""
    plans = context.regions["plans"].map()
    listening = socket.socket(fileno=context.sockets["planner_listen"])
    return Worker(context.cell, context.control, plans, listening)


if __name__ == "__main__":
    sys.exit(main())
