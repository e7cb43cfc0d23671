"""The blocking client: one connection to one cell."""

import atexit
import logging
import os
import time
import weakref
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from threading import Lock
from types import TracebackType
from typing import Any, Self, TypeVar, Unpack

from axisync_client import calls, discovery, moves
from axisync_client.calls import Call
from axisync_client.clock import DaemonClock
from axisync_client.errors import AxisyncError, InvalidArgument, Refused, Unavailable, UnexpectedReply
from axisync_client.lease import Lease, OnLost
from axisync_client.link import Link
from axisync_client.moves import AnyMove, JointOptions, LinearOptions, PathOptions, Place
from axisync_client.program import load
from axisync_client.setpoints import Setpoints, decoder
from axisync_client.settings import resolve
from axisync_client.streams import Stream
from axisync_schemas import keys, topics
from axisync_schemas.base import Strict
from axisync_schemas.cell import Cell
from axisync_schemas.errors import ErrorCode
from axisync_schemas.moves import Curve, Dwell, SingleMove
from axisync_schemas.programs import Program
from axisync_schemas.replies import Event, GroupReply, Info, MoveReply, MoveReport, State

R = TypeVar("R", bound=Strict)
T = TypeVar("T")
STREAM_SILENCE_S = 3.0
"""A periodic stream that is silent for so long has lost its daemon."""

RETRY_S = 0.2

_log = logging.getLogger(__name__)


class Client:
    """Connects on construction; a context manager. Usable from several threads.

    Args:
        endpoint: "tcp/HOST:PORT" or "HOST:PORT"; default AXISYNC_ENDPOINT, then tcp/127.0.0.1:7447.
        cell: default AXISYNC_CELL, then the only cell that answers.
        user: default AXISYNC_USER, then "anonymous".
        timeout_s: for every question that has no longer one of its own.

    Raises:
        Unavailable: nobody listens, or nobody answers.
        InvalidArgument: several cells answer and none was chosen, or a name is none.
        UnexpectedReply: the daemon serves another schema version.
    """

    def __init__(
        self, endpoint: str | None = None, *, cell: str | None = None, user: str | None = None, timeout_s: float = 5.0
    ) -> None:
        if not 0.0 < timeout_s < 86400.0:
            raise InvalidArgument(f"timeout_s is {timeout_s}", "must be a number of seconds above 0")
        settings = resolve(endpoint, cell, user, os.environ)
        self.endpoint, self.user, self.timeout_s = settings.endpoint, settings.user, timeout_s
        self._clock = DaemonClock()
        self._lock = Lock()
        self._leases: list[Lease] = []
        self._streams: weakref.WeakSet[Stream[Any]] = weakref.WeakSet()
        self._closed = False
        self._link = Link(self.endpoint)
        _open_clients.add(self)
        try:
            self.cell = settings.cell or self._patiently(self._discover)
            self._patiently(self._greet)
        except BaseException:
            self.close()
            raise

    # What is so.

    def info(self) -> Info:
        """Versions and clock of the daemon."""
        return self._ask(calls.INFO)

    def config(self) -> Cell:
        """The cell file in force: groups, axes, limits."""
        return self._ask(calls.CONFIG)

    def state(self) -> State:
        """Everything that is shown: groups, drives, leases, cycle, buses, recorder."""
        return self._ask(calls.STATE)

    def move_report(self, move_id: str) -> MoveReport:
        """Where a move is in its life; Refused with NOT_FOUND where the daemon knows none of that id."""
        return self._ask(calls.move_report(move_id))

    def recent_events(self) -> tuple[Event, ...]:
        """The newest events that the daemon remembers (200), the oldest first; `events` tells what comes."""
        return self._ask(calls.EVENTS).events

    # What anyone may do.

    def stop(self, group: str = "all") -> GroupReply:
        """Stops a group, a compound or all on their paths, jerk-limited. Needs no lease; answered when it has begun."""
        return self._ask(calls.stop(group), urgent=True)

    def plan(self, group: str, move: AnyMove, speed_scale: float = 1.0) -> MoveReply:
        """What `Lease.move` would do from the present setpoint; nothing moves.

        Raises:
            Refused: as `Lease.move`.
        """
        return self._ask(calls.plan(group, move, speed_scale))

    def plan_joint(
        self, group: str, target: Place, *, speed_scale: float = 1.0, **options: Unpack[JointOptions]
    ) -> MoveReply:
        """What `Lease.move_joint` would do."""
        return self.plan(group, moves.joint(target, **options), speed_scale)

    def plan_linear(
        self,
        group: str,
        target: Place | Mapping[str, Place],
        *,
        speed_scale: float = 1.0,
        **options: Unpack[LinearOptions],
    ) -> MoveReply:
        """What `Lease.move_linear` would do."""
        return self.plan(group, moves.linear(target, **options), speed_scale)

    def plan_circular(
        self, group: str, via: Place, target: Place, *, speed_scale: float = 1.0, **options: Unpack[PathOptions]
    ) -> MoveReply:
        """What `Lease.move_circular` would do."""
        return self.plan(group, moves.circular(via, target, **options), speed_scale)

    def plan_path(
        self, group: str, curve: Curve, *, speed_scale: float = 1.0, **options: Unpack[PathOptions]
    ) -> MoveReply:
        """What `Lease.move_path` would do."""
        return self.plan(group, moves.path(curve, **options), speed_scale)

    def plan_sequence(self, group: str, steps: Sequence[SingleMove | Dwell], *, speed_scale: float = 1.0) -> MoveReply:
        """What `Lease.move_sequence` would do."""
        return self.plan(group, moves.sequence(steps), speed_scale)

    def plan_program(self, program: Program | str | Path, *, speed_scale: float = 1.0) -> MoveReply:
        """What `Lease.run_program` would do."""
        loaded = load(program)
        return self.plan(loaded.group, loaded.move, loaded.speed_scale * speed_scale)

    # The right to move.

    def lease(
        self,
        groups: str | Sequence[str],
        ttl_s: float = 2.0,
        *,
        take: bool = False,
        on_lost: OnLost | None = None,
    ) -> Lease:
        """Acquires the right to move some groups; renewed in the background until released or lost.

        Args:
            groups: one name or several; a compound's name stands for its members.
            ttl_s: how long the daemon waits for a sign of life before everything comes to `held`.
            take: also from another holder, who is told by LEASE_FENCED.
            on_lost: called once, on the renewing thread.

        Raises:
            Refused: LEASE_HELD names the holder.
        """
        names = (groups,) if isinstance(groups, str) else tuple(groups)
        sent_s = time.monotonic()
        reply = self._ask(calls.acquire(names, float(ttl_s), take))
        lease = Lease(self, names, float(ttl_s), reply, sent_s, on_lost)
        with self._lock:
            self._leases.append(lease)
        return lease

    # What happens.

    def events(self) -> Stream[Event]:
        """Events from now on. A long silence is no error as long as the daemon is there."""
        return self._stream(topics.EVENTS.name, _event, self._still_there)

    def states(self) -> Stream[State]:
        """States from now on, 20 a second."""
        return self._stream(topics.STATE.name, _state, self._gone)

    def setpoints(self) -> Stream[Setpoints]:
        """Every tick of the control cycle from now on, as arrays, about 10 ticks at a time."""
        return self._stream(topics.SETPOINTS.name, decoder(self.config()), self._gone)

    # The end.

    def close(self) -> None:
        """Gives leases back and ends the connection. May be called twice; also called when the interpreter ends."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            leases, streams = list(self._leases), list(self._streams)
        for lease in leases:
            try:
                lease.release()
            except AxisyncError as error:
                _log.warning("lease not released groups=%s reason=%s", ",".join(lease.groups), error)
        for stream in streams:
            stream.close()
        self._link.close()
        _open_clients.discard(self)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # For the parts of this package.

    def _ask(self, call: Call[R], *, urgent: bool = False) -> R:
        """The answer, also where the daemon's clock has become another one; errors of versions name both versions."""
        try:
            return self._ask_once(call, urgent)
        except (Refused, UnexpectedReply) as error:
            if error.code is ErrorCode.UNSUPPORTED_SCHEMA:
                self._greet()  # raises where the daemon is not the one any more that was greeted first
            if error.code is not ErrorCode.STALE:
                raise
            _log.warning("clocks disagree name=%s reason=%s", call.name, error.message)
        self._greet()
        return self._ask_once(call.anew(), urgent)

    def _ask_once(self, call: Call[R], urgent: bool) -> R:
        timeout_s = self.timeout_s if call.timeout_s is None else call.timeout_s
        sent_s = time.monotonic()
        payload = call.payload(self._clock.at(sent_s + (timeout_s if call.fresh_s is None else call.fresh_s)))
        answer = self._link.query(call.key(self.cell, self.user), payload, timeout_s, urgent=urgent)
        if answer.error is not None:
            raise Refused(answer.error)
        reply = call.read(answer.payload)
        self._observe(reply, sent_s)
        return reply

    def _observe(self, reply: Strict, sent_s: float) -> None:
        now_s = getattr(reply, "now_s", None)
        if isinstance(now_s, float):
            self._clock.observe(now_s, sent_s, time.monotonic())

    def _forget(self, lease: Lease) -> None:
        with self._lock:
            self._leases = [other for other in self._leases if other is not lease]

    def _patiently(self, ask: Callable[[], T]) -> T:
        """A daemon that has just started listens a moment before it answers."""
        until_s = time.monotonic() + self.timeout_s
        while True:
            try:
                return ask()
            except Unavailable:
                if time.monotonic() + RETRY_S > until_s:
                    raise
                time.sleep(RETRY_S)

    def _discover(self) -> str:
        answers = self._link.query_all(keys.topic("*", calls.INFO.name), self.timeout_s)
        return discovery.the_cell(list(answers), self.endpoint)

    def _greet(self) -> None:
        """Checks that the daemon is there and speaks our schema, and learns its clock."""
        sent_s = time.monotonic()
        answer = self._link.query(calls.INFO.key(self.cell, self.user), b"", self.timeout_s)
        if answer.error is not None:
            raise Refused(answer.error)
        discovery.check_versions(answer.payload)
        self._observe(calls.INFO.read(answer.payload), sent_s)

    def _stream(
        self, name: str, decode: Callable[[bytes], tuple[T, int]], on_silence: Callable[[str], None]
    ) -> "Stream[T]":
        key = keys.topic(self.cell, name)
        stream = Stream(self._link, key, decode, silence_s=STREAM_SILENCE_S, on_silence=lambda: on_silence(key))
        with self._lock:
            self._streams.add(stream)
        return stream

    def _still_there(self, key: str) -> None:
        self.info()

    def _gone(self, key: str) -> None:
        raise Unavailable(
            f"nothing came on {key} from {self.endpoint} for {STREAM_SILENCE_S:g} s", "is axisyncd running?"
        )


_open_clients: "weakref.WeakSet[Client]" = weakref.WeakSet()


@atexit.register
def _close_all() -> None:
    """A session left open may keep the interpreter from ending, and a lease left held keeps others out."""
    for client in list(_open_clients):
        client.close()


def _event(payload: bytes) -> tuple[Event, int]:
    event = calls.read(Event, payload, topics.EVENTS.name)
    return event, event.seq


def _state(payload: bytes) -> tuple[State, int]:
    state = calls.read(State, payload, topics.STATE.name)
    return state, state.seq
