"""An actioner on lists: what it sends is kept, what comes is called by hand."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest

from axisync_schemas.cell import Cell, read_cell
from axisync_schemas.enumerations import GroupState, Phase
from axisync_schemas.internal import BeginCommand, GroupCommand, PlanJob, PlanResult
from axisync_schemas.replies import MoveReply
from axisync_service.actioner.actioner import Actioner
from axisync_service.actioner.ports import Answer, Incoming, Notice
from axisync_service.actioner.world import GroupView, World

CELL, _ = read_cell(Path(__file__).parents[3] / "service" / "axisync_service" / "cells" / "eod.toml")
START = tuple(axis.drive.start for axis in CELL.axes)
SECOND = 10**9


@dataclass
class Lists:
    """Every effect, in order."""

    commands: list[GroupCommand | BeginCommand] = field(default_factory=list)
    jobs: list[PlanJob] = field(default_factory=list)
    notices: list[Notice] = field(default_factory=list)
    logged: list[tuple[str, dict[str, Any], int | None, int | None]] = field(default_factory=list)
    leases: dict[int, tuple[int, int]] = field(default_factory=dict)
    stops: list[int] = field(default_factory=lambda: [0, 0])
    durations: dict[tuple[int, int], float] = field(default_factory=dict)
    controller_there: bool = True
    planner_there: bool = True
    kills: int = 0

    def to_controller(self, command: GroupCommand | BeginCommand) -> bool:
        if self.controller_there:
            self.commands.append(command)
        return self.controller_there

    def to_planner(self, job: PlanJob) -> bool:
        if self.planner_there:
            self.jobs.append(job)
        return self.planner_there

    def kill_planner(self) -> None:
        self.kills += 1

    def set_lease(self, group: int, epoch: int, until_ns: int) -> None:
        self.leases[group] = (epoch, until_ns)

    def stop_count(self, group: int) -> int:
        return self.stops[group]

    def plan_duration(self, slot: int, plan_id: int) -> float | None:
        return self.durations.get((slot, plan_id))

    def notice(self, notice: Notice) -> None:
        self.notices.append(notice)

    def log(self, topic: str, data: dict[str, Any], slot: int | None = None, plan_id: int | None = None) -> None:
        self.logged.append((topic, data, slot, plan_id))

    def kinds(self) -> list[str]:
        """Kinds of the events so far."""
        return [str(notice.kind) for notice in self.notices]


@dataclass
class Rig:
    """The actioner, its effects, and a robot that the test moves by hand."""

    ports: Lists
    actioner: Actioner
    world: World
    cell: Cell = CELL
    lease_token: str = ""

    def observe(self) -> World:
        """Shows the actioner the robot."""
        self.actioner.observe(self.world)
        return self.world

    def wait(self, seconds: float) -> None:
        """Time passes."""
        self.world = replace(self.world, now_ns=self.world.now_ns + round(seconds * SECOND))
        self.actioner.on_time(self.observe())

    def show(self, *groups: int, **fields: Any) -> None:
        """The controller shows these groups so."""
        views = list(self.world.groups)
        for group in groups or range(len(views)):
            views[group] = replace(views[group], **fields)
        self.world = replace(self.world, groups=tuple(views), tick=self.world.tick + 1)
        self.observe()

    def send(self, verb: str, user: str = "anonymous", **fields: Any) -> list[Answer]:
        """A command; its answers appear in the list."""
        return self.send_bytes(verb, json.dumps({"request_id": str(uuid4())} | fields).encode(), user)

    def send_bytes(self, verb: str, body: bytes, user: str = "anonymous") -> list[Answer]:
        """A command's bytes."""
        answers: list[Answer] = []
        self.actioner.on_command(Incoming(verb, user, body, answers.append, self.world.now_ns), self.observe())
        return answers

    def lease(self, *groups: str, ttl_s: float = 60.0) -> str:
        """A lease on free groups."""
        answer = body(self.send("lease", action="acquire", groups=list(groups), ttl_s=ttl_s))
        self.lease_token = str(answer["lease"])
        return self.lease_token

    def move(self, group: str, lease: str | None, **fields: Any) -> list[Answer]:
        """A move of all axes by 0.1 rad."""
        count = len(self.cell.axis_indices(group))
        return self.send("move", group=group, lease=lease, move={"target": [0.1] * count, "relative": True}, **fields)

    def plan(self, job: PlanJob, duration_s: float = 2.0) -> None:
        """The planner answers."""
        self.actioner.on_plan(PlanResult(ref=job.ref, plan=plan_reply(job.group, duration_s)), self.observe())


def plan_reply(group: str, duration_s: float = 2.0) -> MoveReply:
    """What the planner says."""
    return MoveReply(
        request_id="", now_s=0.0, move_id=None, group=group, duration_s=duration_s, scalars=(), T=(), U=(),
        minimum_s=(), limiting=None,
    )  # fmt: skip


def body(answers: list[Answer]) -> dict[str, Any]:
    """The one answer, which must be a reply."""
    assert len(answers) == 1
    assert not answers[0].is_error, answers[0].payload
    return dict(json.loads(answers[0].payload))


def refusal(answers: list[Answer]) -> dict[str, Any]:
    """The one answer, which must be a refusal."""
    assert len(answers) == 1
    assert answers[0].is_error, answers[0].payload
    return dict(json.loads(answers[0].payload))


def standing() -> World:
    """Both groups enabled, at rest."""
    view = GroupView(GroupState.STANDSTILL, 0, 0.0, 0.0, -1, None)
    return World(1000 * SECOND, Phase.RUNNING, True, 500, START, START, (0.0,) * len(START), (view, view), None)


@pytest.fixture
def rig() -> Rig:
    """Ready to move."""
    ports = Lists()
    made = Rig(ports, Actioner(CELL, ports, (7, 4), 1000), standing())
    made.observe()
    return made


@pytest.fixture
def ok() -> Callable[[list[Answer]], dict[str, Any]]:
    """Reads a reply."""
    return body


@pytest.fixture
def no() -> Callable[[list[Answer]], dict[str, Any]]:
    """Reads a refusal."""
    return refusal


@pytest.fixture
def eod() -> Cell:
    """The robot of the paper."""
    return CELL
