"""The actioner's effects, for real: sockets, shared memory, events to publish and to log."""

import contextlib
import logging
import mmap
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from axisync_schemas.internal import Command, PlanJob
from axisync_schemas.memory import Control, GroupWord, Word
from axisync_schemas.plan_slots import PlanError, read_plan
from axisync_schemas.replies import Event
from axisync_schemas.topics import LOG_EVENTS
from axisync_service.actioner.ports import Notice
from axisync_service.hmi.reports import wall_time
from axisync_service.links.log_sink import LogSink
from axisync_service.links.seqpacket import Link

log = logging.getLogger(__name__)

WORKER_MODULE = b"planner_worker"


class Effects:
    """Implements `actioner.ports.Ports`."""

    def __init__(
        self,
        control: Control,
        plans: mmap.mmap,
        controller: Link,
        planner: Link,
        sink: LogSink,
        publish: Callable[[Event], None],
        parent: int,
    ) -> None:
        """`parent`: process id of the supervisor, whose child the planner must be to be killed from here."""
        self._control = control
        self._plans = plans
        self._controller = controller
        self._planner = planner
        self._sink = sink
        self._publish = publish
        self._parent = parent

    def to_controller(self, command: Command) -> bool:
        """Sends a command."""
        return self._controller.send(command.model_dump_json().encode())

    def to_planner(self, job: PlanJob) -> bool:
        """Sends a job, unless the planner is not there or still warming up: its time must not run meanwhile.

        A sign of life from before the connection is that of the planner before.
        """
        warm = self._control[Word.PLANNER_NS] > self._planner.since_ns
        return warm and self._planner.send(job.model_dump_json().encode())

    def kill_planner(self) -> None:
        """SIGKILL, which also ends a process that is stopped or deep in a library."""
        pid = self._control[Word.PLANNER_PID]
        log.error("planner hangs pid=%s", pid)
        kill_worker(pid, self._parent)

    def set_lease(self, group: int, epoch: int, until_ns: int) -> None:
        """The epoch first: a time without its epoch must never count for the holder before."""
        self._control.set_group(group, GroupWord.LEASE_EPOCH, epoch)
        self._control.set_group(group, GroupWord.LEASE_UNTIL_NS, until_ns)

    def stop_count(self, group: int) -> int:
        """As the stop callback last wrote it."""
        return self._control.group(group, GroupWord.STOP_COUNT)

    def plan_duration(self, slot: int, plan_id: int) -> float | None:
        """From the plan slot."""
        try:
            return read_plan(self._plans, slot, plan_id).duration
        except PlanError:
            return None

    def notice(self, notice: Notice) -> None:
        """As an event of front: published, and logged."""
        event = Event.model_validate(
            {
                "source": "front",
                "kind": str(notice.kind),
                "now_s": time.monotonic_ns() / 1e9,
                "wall_time": wall_time(),
                "message": notice.message,
                "tick": notice.tick,
                "group": notice.group,
                "severity": notice.severity,
                "details": notice.details,
            }
        )
        self._publish(event)
        self.log(LOG_EVENTS, event.model_dump(mode="json"))

    def log(self, topic: str, data: dict[str, Any], slot: int | None = None, plan_id: int | None = None) -> None:
        """To the recorder."""
        self._sink.send(topic, data, slot, plan_id)


def kill_worker(pid: int, parent: int) -> bool:
    """Kills the planner worker `pid`, if it is one; the descriptor rules out that the number was given anew."""
    try:
        descriptor = os.pidfd_open(pid)
    except OSError:
        return False
    try:
        if not _is_worker(pid, parent):
            log.error("not killed pid=%d: it is no planner worker of this service", pid)
            return False
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(descriptor, signal.SIGKILL)
        return True
    finally:
        os.close(descriptor)


def _is_worker(pid: int, parent: int) -> bool:
    try:
        stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
        command = Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False
    return int(stat.rpartition(")")[2].split()[1]) == parent and WORKER_MODULE in command
