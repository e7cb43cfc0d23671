"""A cell that answers over real Zenoh: a router on a loopback port, the real models, and just enough behind them.

Groups are enabled and moved by name alone; moves are timed by the wall, along curves of four equal segments. What a
test wants to go wrong it says by `refusals`, `deaf` and `end`.
"""

import json
import math
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import zenoh

from axisync_schemas import keys
from axisync_schemas.base import Strict
from axisync_schemas.cell import Cell, read_cell
from axisync_schemas.enumerations import MoveStatus
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.replies import (
    AloneReport,
    CycleReport,
    DriveReport,
    Event,
    Events,
    GroupReply,
    GroupReport,
    Info,
    JogAhead,
    JogReply,
    LeaseReply,
    MoveReply,
    MoveReport,
    Percentiles,
    RecorderReport,
    State,
    StepReport,
)
from axisync_schemas.ticks import TickLayout

CELL_FILE = Path(__file__).parents[2] / "service" / "axisync_service" / "cells" / "eod.toml"
Body = dict[str, Any]


def free_port() -> int:
    """A loopback port that nobody uses just now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@dataclass
class HeldLease:
    """One lease."""

    user: str
    groups: tuple[str, ...]
    ttl_s: float
    until: float


@dataclass
class RunningMove:
    """One move: from `begin` for `duration_s`, unless it ended otherwise."""

    group: str
    begin: float
    duration_s: float
    ended: MoveStatus | None = None
    at: float = 1.0
    reason: str | None = None


@dataclass
class Peer:
    """Attributes that tests set or read.

    refusals: by verb, what to answer instead of doing it.
    deaf: verbs that get no answer, as many times as said.
    requests: every command as it came: verb, user, body.
    leases: by token.
    events: what a query of the newest gives.
    clock_ahead_s: of its monotonic clock before this process's.
    checks_time: whether late commands are STALE.
    """

    port: int = field(default_factory=free_port)
    cells: tuple[str, ...] = ("eod",)
    schema_versions: tuple[int, ...] = (1,)
    cell: Cell = field(default_factory=lambda: read_cell(CELL_FILE)[0])
    refusals: dict[str, Refusal] = field(default_factory=dict)
    deaf: dict[str, int] = field(default_factory=dict)
    requests: list[tuple[str, str, Body]] = field(default_factory=list)
    leases: dict[str, HeldLease] = field(default_factory=dict)
    moves: dict[str, RunningMove] = field(default_factory=dict)
    events: list[Event] = field(default_factory=list)
    clock_ahead_s: float = 0.0
    checks_time: bool = False

    def __post_init__(self) -> None:
        self.states = dict.fromkeys(self.cell.group_names, "disabled")
        self.epoch = 0
        self._unanswered: list[zenoh.Query] = []
        self.open()

    @property
    def endpoint(self) -> str:
        return f"tcp/127.0.0.1:{self.port}"

    @property
    def now_s(self) -> float:
        """Its monotonic clock."""
        return time.monotonic() + self.clock_ahead_s

    # --- Zenoh ----------------------------------------------------------------------------------------------------

    def open(self) -> None:
        """Listens; again after `close`, as a restarted daemon would."""
        config = zenoh.Config()
        for key, value in {
            "mode": "router",
            "listen/endpoints": [self.endpoint],
            "scouting/delay": 0,
            "scouting/multicast/enabled": False,
            "scouting/gossip/enabled": False,
            "transport/shared_memory/enabled": False,
        }.items():
            config.insert_json5(key, json.dumps(value))
        self.session = zenoh.open(config)
        for cell in self.cells:
            for name in ("info", "state", "config", "events", "moves/*"):
                self.session.declare_queryable(keys.topic(cell, name), self._on_query)
            self.session.declare_queryable(keys.command(cell, "*", "*"), self._on_query)

    def close(self) -> None:
        self._unanswered.clear()
        self.session.close()

    def publish(self, topic: str, payload: str | bytes) -> None:
        data = payload.encode() if isinstance(payload, str) else payload
        self.session.put(keys.topic(self.cells[0], topic), data)

    def _on_query(self, query: zenoh.Query) -> None:
        parts = str(query.key_expr).split("/")
        verb = parts[-1] if "cmd" in parts else parts[2]
        if self.deaf.get(verb, 0):
            self.deaf[verb] -= 1
            self._unanswered.append(query)  # kept alive: a dropped query counts as answered
            self._note(query, verb)
            return
        with query:
            self._reply(query, parts, verb)

    def _reply(self, query: zenoh.Query, parts: list[str], verb: str) -> None:
        try:
            answer = self._answer(query, parts, verb)
        except Refusal as refusal:
            query.reply_err(refusal.body(None).model_dump_json())
            return
        cells = self.cells if parts[1] == "*" else (parts[1],)
        for cell in cells:
            query.reply("/".join(["axisync", cell, *parts[2:]]), answer.model_dump_json())

    def _note(self, query: zenoh.Query, verb: str) -> Body:
        body: Body = json.loads(bytes(query.payload)) if query.payload and len(bytes(query.payload)) else {}
        if "/cmd/" in str(query.key_expr):
            self.requests.append((verb, str(query.key_expr).split("/")[3], body))
        return body

    # --- answers --------------------------------------------------------------------------------------------------

    def _answer(self, query: zenoh.Query, parts: list[str], verb: str) -> Strict:
        body = self._note(query, verb)
        if verb in self.refusals:
            raise self.refusals[verb]
        if self.checks_time and body.get("not_after_s", math.inf) < self.now_s:
            raise Refusal(ErrorCode.STALE, "too late", now_s=self.now_s)
        if "cmd" not in parts:
            return self._about(verb, parts)
        handlers: dict[str, Callable[[Body, str], Strict]] = {
            "lease": self._lease,
            "enable": lambda b, u: self._switch(b, "standstill"),
            "disable": lambda b, u: self._switch(b, "disabled"),
            "reset": lambda b, u: self._switch(b, "disabled"),
            "stop": lambda b, u: self._stop(b),
            "move": lambda b, u: self._move(b, commit=True),
            "plan": lambda b, u: self._move(b, commit=False),
            "jog": lambda b, u: self._jog(b),
        }
        return handlers[verb](body, parts[3])

    def _about(self, name: str, parts: list[str]) -> Strict:
        now_s = self.now_s
        if name == "config":
            return self.cell
        if name == "state":
            return self.state()
        if name == "events":
            return Events(now_s=now_s, events=tuple(self.events))
        if name == "moves":
            return self.report(parts[3])
        return Info(
            name=parts[1], version="9.9", schema_versions=self.schema_versions, now_s=now_s,
            wall_time="2026-01-01T00:00:00Z", pid=1, log_directory="/tmp", verbs=("move",),
        )  # fmt: skip

    def _names(self, group: str) -> tuple[str, ...]:
        try:
            return tuple(self.cell.group_names[i] for i in self.cell.members(group))
        except KeyError:
            known = [*self.cell.group_names, "all"]
            raise Refusal(ErrorCode.INVALID_REQUEST, f"group: no group {group!r} in this cell", groups=known) from None

    def _holder(self, group: str) -> str | None:
        held = (lease for lease in self.leases.values() if group in lease.groups and lease.until > time.monotonic())
        return next((lease.user for lease in held), None)

    def _lease(self, body: Body, user: str) -> LeaseReply:
        groups = tuple(name for group in body["groups"] for name in self._names(group))
        token = body.get("lease", "")
        if body["action"] in ("acquire", "take"):
            if body["action"] == "acquire":
                for group in groups:
                    if (holder := self._holder(group)) is not None:
                        raise Refusal(ErrorCode.LEASE_HELD, f"{group} is held by {holder}", group=group, holder=holder)
            self.leases = {k: v for k, v in self.leases.items() if not set(v.groups) & set(groups)}
            self.epoch += 1
            token = f"token-{self.epoch}"
            self.leases[token] = HeldLease(user, groups, body["ttl_s"], 0.0)
        self._verify(token, groups, lapsing=False)
        self.leases[token].until = time.monotonic() + body["ttl_s"]
        if body["action"] == "release":
            del self.leases[token]
        return LeaseReply(**self._stamp(body), lease=token, epoch=self.epoch, expires_in_s=body["ttl_s"])

    def _verify(self, token: str | None, groups: tuple[str, ...], lapsing: bool = True) -> None:
        lease = self.leases.get(token or "")
        if lease is None or (lapsing and lease.until <= time.monotonic()):
            raise Refusal(ErrorCode.LEASE_FENCED, "this lease has lapsed, was released or taken over")

    def _stamp(self, body: Body) -> dict[str, Any]:
        return {"request_id": body["request_id"], "now_s": self.now_s}

    def _switch(self, body: Body, state: str) -> GroupReply:
        names = self._names(body["group"])
        self._verify(body.get("lease"), names)
        self.states.update(dict.fromkeys(names, state))
        return GroupReply(**self._stamp(body), groups={name: self.states[name] for name in names})

    def _jog(self, body: Body) -> JogReply:
        """At once, and as long as the last request says; nothing else happens."""
        names = self._names(body["group"])
        self._verify(body.get("lease"), names)
        moving = any(body["velocity"])
        ahead = JogAhead(velocity=tuple(body["velocity"])) if moving else None
        return JogReply(
            **self._stamp(body), group=body["group"], state="moving" if moving else "standing", ahead=ahead
        )  # fmt: skip

    def _stop(self, body: Body) -> GroupReply:
        names = self._names(body["group"])
        for move in self.moves.values():
            if set(self._names(move.group)) & set(names):
                self.end(move, MoveStatus.STOPPED, "a stop was asked for")
        return GroupReply(**self._stamp(body), groups={name: self.label(name) for name in names})

    def _move(self, body: Body, commit: bool) -> MoveReply:
        names = self._names(body["group"])
        if commit:
            self._verify(body.get("lease"), names)
            for name in names:
                if self.states[name] == "disabled":
                    raise Refusal(ErrorCode.NOT_ENABLED, f"{name} is disabled: enable it first", group=name)
        reply = plan(self.cell, body)
        if commit:
            move_id = f"m-{len(self.moves) + 1}"
            self.moves[move_id] = RunningMove(body["group"], time.monotonic(), reply.duration_s)
            return reply.model_copy(update={"move_id": move_id, **self._stamp(body)})
        return reply.model_copy(update=self._stamp(body))

    # --- what is so -----------------------------------------------------------------------------------------------

    def end(self, move: RunningMove, status: MoveStatus, reason: str) -> None:
        """A move ends other than by arriving."""
        if self._progress(move) < 1.0 and move.ended is None:
            move.at, move.ended, move.reason = self._progress(move), status, reason

    @staticmethod
    def _progress(move: RunningMove) -> float:
        if move.ended is not None:
            return move.at
        return min(1.0, (time.monotonic() - move.begin) / move.duration_s) if move.duration_s else 1.0

    def report(self, move_id: str) -> MoveReport:
        if move_id not in self.moves:
            raise Refusal(ErrorCode.NOT_FOUND, "no such move")
        move = self.moves[move_id]
        progress = self._progress(move)
        status = move.ended or (MoveStatus.SUCCEEDED if progress == 1.0 else MoveStatus.EXECUTING)
        return MoveReport(
            move_id=move_id, group=move.group, status=status, progress=progress, reason=move.reason,
            duration_s=move.duration_s, now_s=self.now_s,
        )  # fmt: skip

    def label(self, name: str) -> str:
        running = any(
            name in self._names(m.group) and m.ended is None and self._progress(m) < 1.0 for m in self.moves.values()
        )
        return "moving" if running else self.states[name]

    def state(self, seq: int = 0) -> State:
        timing = Percentiles(p50=26.0, p99=99.0, max=120.0)
        return State(
            seq=seq,
            tick=1000,
            now_s=self.now_s,
            groups={group.name: self._group(group.name, len(group.axes)) for group in self.cell.groups},
            lease={name: self._holder(name) for name in self.cell.group_names},
            cycle=CycleReport(
                period_s=0.002, lateness_us=timing, read_us=timing, decide_us=timing, write_us=timing,
                skipped_ticks=3, realtime=False,
            ),
            buses={},
            recorder=RecorderReport(state="up", cursor_tick=990, lost_ticks=0),
            controller="up",
        )  # fmt: skip

    def _group(self, name: str, axes: int) -> GroupReport:
        drives = tuple(
            DriveReport(
                axis=f"{name}.{i + 1}", bus=name, node_id=i + 1, state="operation_enabled", nmt="operational",
                statusword=0x27, error_code=0, error=None, temperature=31.4, voltage=48.0,
            )
            for i in range(axes)
        )  # fmt: skip
        start = tuple(axis.drive.start for axis in self.cell.axes if axis.name.startswith(f"{name}."))
        return GroupReport(
            state=self.label(name), move_id=None, progress=None, path_rate=0.0, position=start,
            velocity=(0.0,) * axes, setpoint=start, pose=None, drives=drives,
        )  # fmt: skip

    def event(self, seq: int, message: str) -> Event:
        return Event(
            seq=seq, source="front", kind="move_accepted", now_s=1.0, wall_time="12:00:00", message=message,
            group="kingkong",
        )  # fmt: skip

    def batch(self, seq: int, ticks: range) -> bytes:
        layout = TickLayout(len(self.cell.axes), len(self.cell.groups))
        records = []
        for tick in ticks:
            record = layout.new()
            record["tick"], record["cycle_start_ns"] = tick, tick * 2_000_000
            record["position"] = np.arange(len(self.cell.axes)) + tick
            records.append(record.tobytes())
        return layout.batch(records, seq)


def plan(cell: Cell, body: Body) -> MoveReply:
    """A reply of the shape that the kind has; the numbers mean little but for joint moves."""
    move = body["move"]
    if move["kind"] == "sequence":
        return _sequence(body)
    if move["kind"] == "joint" and isinstance(move["target"], list):
        return _joint(cell, body)
    return _tool(cell, body)


SIGNS = (1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0)


def _tool(cell: Cell, body: Body) -> MoveReply:
    """300 mm and a right angle in 4 s for each arm, stretched 1.8 times for the group's fifth joint."""
    duration = body["move"].get("duration_s", 4.0)
    axes = [cell.axes[i] for i in cell.axis_indices(body["group"])]
    arms = (
        [f"{name}." for name in (cell.group_names[i] for i in cell.members(body["group"]))] if len(axes) > 6 else [""]
    )
    return MoveReply(
        request_id="", now_s=0.0, move_id=None, group=body["group"], duration_s=duration,
        scalars=tuple(f"{arm}{name}" for arm in arms for name in ("length", "rotation")),
        T=((1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0),) * 2 * len(arms),
        U=tuple(tuple(sign * d / 2.0 for sign in SIGNS) for _ in arms for d in (0.3, np.pi / 2)),
        minimum_s=(2.2, 1.9) * len(arms), limiting=axes[4].name, scale=1.8, min_distance_m=0.0843,
        nearest=("kingkong link 3", "body"), end=tuple(axis.drive.start for axis in axes),
        alone=AloneReport(limit_margin=0.5, axis="kingkong.2", min_distance_m=0.0401),
    )  # fmt: skip


def _sequence(body: Body) -> MoveReply:
    """Each step takes as long as it says."""
    lasting = [step["duration_s"] for step in body["move"]["steps"]]
    steps = tuple(
        StepReport(kind=step["kind"], begins_s=sum(lasting[:i]), duration_s=lasting[i], limiting=None, scale=1.0 + i)
        for i, step in enumerate(body["move"]["steps"])
    )
    return MoveReply(
        request_id="", now_s=0.0, move_id=None, group=body["group"], duration_s=sum(lasting), scalars=(), T=(),
        U=(), minimum_s=(), limiting=None, scale=float(len(steps)), steps=steps, end=(0.0,) * 6,
    )  # fmt: skip


def _joint(cell: Cell, body: Body) -> MoveReply:
    """Jerk segments of a quarter of the duration each, as long as the slowest axis needs at its jerk limit."""
    axes = [cell.axes[i] for i in cell.axis_indices(body["group"])]
    target = body["move"]["target"]
    if len(target) != len(axes):
        raise Refusal(ErrorCode.INVALID_REQUEST, f"move.target: {len(axes)} axes are expected, not {len(target)}")
    start = [0.0 if body["move"]["relative"] else axis.drive.start for axis in axes]
    distances = [end - begin for end, begin in zip(target, start, strict=True)]
    alone = [4.0 * (abs(d) / (2.0 * axis.limits.jerk)) ** (1 / 3) for d, axis in zip(distances, axes, strict=True)]
    duration = body["move"].get("duration_s") or max(alone)
    quarter = duration / 4.0
    jerks = [d / (2.0 * quarter**3) if quarter else 0.0 for d in distances]
    return MoveReply(
        request_id="", now_s=0.0, move_id=None, group=body["group"], duration_s=duration,
        scalars=tuple(axis.name for axis in axes),
        T=tuple((quarter, 0.0, quarter, 0.0, quarter, 0.0, quarter) for _ in axes),
        U=tuple(tuple(sign * jerk for sign in SIGNS) for jerk in jerks),
        minimum_s=tuple(alone),
        limiting=axes[int(np.argmax(alone))].name if duration else None,
    )  # fmt: skip
