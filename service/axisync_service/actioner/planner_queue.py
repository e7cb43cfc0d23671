"""Jobs for the planner worker: one is with it, the others wait here, so that the time-out is each job's own."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.internal import PlanJob, PlanResult
from axisync_schemas.moves import SequenceMove
from axisync_schemas.replies import JogAhead, MoveReply
from axisync_service.actioner.ports import Ports

TIMEOUT_NS = 5 * 10**9
STEP_TIMEOUT_NS = 2 * 10**8
"""More for each further step of a sequence."""

Done = Callable[[MoveReply, JogAhead | None], None]
Refused = Callable[[Refusal], None]


@dataclass(slots=True)
class Waiting:
    """A job, whom to tell, and until when it may take: to be sent at first, then to be answered."""

    job: PlanJob
    done: Done
    refused: Refused
    until_ns: int

    @property
    def timeout_ns(self) -> int:
        """For planning alone."""
        move = self.job.move
        return TIMEOUT_NS + STEP_TIMEOUT_NS * (len(move.steps) - 1 if isinstance(move, SequenceMove) else 0)


class PlannerQueue:
    """Plans one job at a time. There are never more jobs than groups: a group has one plan at a time."""

    def __init__(self, ports: Ports) -> None:
        self._ports = ports
        self._queue: deque[Waiting] = deque()
        self._working: Waiting | None = None

    def submit(self, job: PlanJob, done: Done, refused: Refused, now_ns: int) -> None:
        """Plans `job` when its turn comes; then either `done` or `refused` is called, once."""
        self._queue.append(Waiting(job, done, refused, now_ns + TIMEOUT_NS))
        self._advance(now_ns)

    def on_result(self, result: PlanResult, now_ns: int) -> None:
        """The planner has answered; answers to jobs given up are dropped."""
        waiting = self._working
        if waiting is None or waiting.job.ref != result.ref:
            return
        self._working = None
        self._advance(now_ns)
        if result.plan is not None:
            waiting.done(result.plan, result.jog)
        elif result.error is not None:
            refusal = Refusal(result.error.code, result.error.message)
            refusal.details = result.error.details
            waiting.refused(refusal)
        else:
            waiting.refused(Refusal(ErrorCode.INTERNAL, "the planner gave neither a plan nor a reason"))

    def on_down(self) -> None:
        """The planner is gone; jobs that wait still have their time."""
        waiting, self._working = self._working, None
        if waiting is not None:
            waiting.refused(Refusal(ErrorCode.INTERNAL, "the planner ended while planning this move"))

    def on_time(self, now_ns: int) -> None:
        """Kills a planner that takes too long, and gives up on jobs that no planner took."""
        waiting = self._working
        if waiting is not None and waiting.until_ns <= now_ns:
            self._working = None
            self._ports.kill_planner()
            timeout_s = waiting.timeout_ns / 1e9
            message = f"planning took longer than {timeout_s:g} s"
            waiting.refused(Refusal(ErrorCode.INTERNAL, message, timeout_s=timeout_s))
        self._advance(now_ns)
        if self._working is None:
            while self._queue and self._queue[0].until_ns <= now_ns:
                self._queue.popleft().refused(Refusal(ErrorCode.UNAVAILABLE, "the planner is not there"))

    def _advance(self, now_ns: int) -> None:
        if self._working is None and self._queue and self._ports.to_planner(self._queue[0].job):
            self._working = self._queue.popleft()
            self._working.until_ns = now_ns + self._working.timeout_ns
