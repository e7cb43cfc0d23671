"""The worker's loop over its socket: answers in order, bad packets, fronts that come and go."""

import math
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from axisync_schemas import plan_slots
from axisync_schemas.cell import Cell, parse_cell, read_cell
from axisync_schemas.errors import ErrorCode
from axisync_schemas.internal import MAX_PACKET, PlanJob, PlanResult, Reserved
from axisync_schemas.memory import PLAN_SLOT_BYTES, PLAN_SLOTS, Control, Region, Word
from axisync_schemas.moves import Dwell, JointMove, LinearMove, SequenceMove, ToolPose
from axisync_schemas.plan_slots import read_plan
from axisync_service import planner_worker
from axisync_service.planner.models import Models
from axisync_service.planner_worker import Worker, others, solve
from support.cells import eod_text, small

REST = [math.radians(x) for x in (0, -150, 60, -45, -45, 45, 0, -60, -60, -60, 90, 0)]


@pytest.fixture(scope="module")
def cell() -> Cell:
    found, _ = read_cell(Path(__file__).parents[3] / "service" / "axisync_service" / "cells" / "eod.toml")
    return found


@pytest.fixture(scope="module")
def models(cell: Cell) -> Models:
    return Models(cell)


@pytest.fixture
def plans() -> Iterator[Region]:
    size = PLAN_SLOTS * PLAN_SLOT_BYTES
    descriptor = os.memfd_create("plans")
    os.ftruncate(descriptor, size)
    yield Region("plans", descriptor, size)
    os.close(descriptor)


def job(ref: int, slot: int | None = 3, **fields: Any) -> PlanJob:
    move = fields.pop("move", JointMove(target=(0.1,) * 6, relative=True))
    rest = tuple(REST)
    return PlanJob(
        ref=ref, group="kingkong", plan_id=ref, slot=slot, start=rest[:6], rest=rest, move=move, speed_scale=1.0,
        **fields,
    )  # fmt: skip


@pytest.fixture
def worker(cell: Cell, plans: Region, tmp_path: Path) -> Iterator[tuple[Worker, Path, Control]]:
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    listening.bind(str(tmp_path / "planner.sock"))
    listening.listen(1)
    control = Control(bytearray(Control.size(2)), 2)
    made = Worker(cell, control, plans.map(), listening)
    yield made, tmp_path / "planner.sock", control
    made.close()


def connect(path: Path) -> socket.socket:
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    connection.settimeout(5.0)
    connection.connect(str(path))
    return connection


def answer(connection: socket.socket) -> PlanResult:
    return PlanResult.model_validate_json(connection.recv(MAX_PACKET))


def test_jobs_are_answered_in_order(worker: tuple[Worker, Path, Control], plans: Region) -> None:
    made, path, control = worker
    with connect(path) as front:
        for ref in (1, 2):
            front.send(job(ref, slot=ref).model_dump_json().encode())
        for _ in range(3):
            made.step()
        assert [answer(front).ref, answer(front).ref] == [1, 2]
    assert read_plan(plans.map(), 2, 2).plan_id == 2
    assert control[Word.PLANNER_NS] > 0


def test_bad_packets_do_no_harm(worker: tuple[Worker, Path, Control]) -> None:
    made, path, _ = worker
    with connect(path) as front:
        front.send(b"{")
        front.send(job(5).model_dump_json().encode())
        for _ in range(3):
            made.step()
        assert answer(front).ref == 5


def test_a_new_front_is_served_after_the_old_one_died(worker: tuple[Worker, Path, Control]) -> None:
    made, path, _ = worker
    with connect(path) as front:
        front.send(job(1).model_dump_json().encode())
    with connect(path) as front:
        front.send(job(2).model_dump_json().encode())
        for _ in range(6):
            made.step()
        assert answer(front).ref == 2


def test_a_fault_of_ours_is_an_answer(models: Models, plans: Region, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("secret")

    monkeypatch.setattr(planner_worker, "plan_move", broken)
    error = solve(models, plans.map(), job(1)).error
    assert error is not None
    assert error.code is ErrorCode.INTERNAL
    assert error.message == "planning failed: ZeroDivisionError"


def test_warming_up_plans_every_group_both_ways(models: Models, monkeypatch: pytest.MonkeyPatch) -> None:
    planned: list[tuple[str, str]] = []
    monkeypatch.setattr(planner_worker, "plan_move", lambda _, job: planned.append((job.group, job.move.kind)))
    planner_worker.warm_up(models)
    kinds = ("joint", "linear")
    assert planned == [(group, kind) for group in ("kingkong", "wukong", "both") for kind in kinds]


def test_what_is_planned_for_warming_up_can_be(models: Models, caplog: pytest.LogCaptureFixture) -> None:
    planner_worker.warm_up(models)
    assert caplog.records == []


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_arms_of_few_axes_can_be_planned_for(axes: int, caplog: pytest.LogCaptureFixture) -> None:
    planner_worker.warm_up(Models(parse_cell(small(eod_text(), axes))))
    assert caplog.records == []


def test_a_fault_in_warming_up_keeps_nobody_from_planning(models: Models, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(planner_worker, "plan_move", broken)
    planner_worker.warm_up(models)


@pytest.mark.parametrize("slot", [-1, PLAN_SLOTS])
def test_a_slot_that_is_none(models: Models, plans: Region, slot: int) -> None:
    assert solve(models, plans.map(), job(1, slot)).error is not None


def test_a_job_of_the_wrong_size(models: Models, plans: Region) -> None:
    wrong = job(1).model_copy(update={"start": (0.0,) * 5})
    assert solve(models, plans.map(), wrong).error is not None


def test_a_refusal_is_an_answer(models: Models, plans: Region) -> None:
    far = LinearMove(target=ToolPose(position=(3.0, 0.0, 0.0)))
    error = solve(models, plans.map(), job(1, move=far)).error
    assert error is not None
    assert error.code is ErrorCode.UNREACHABLE
    assert "nearest_reachable" in error.details


def test_a_plan_too_large_for_a_slot(models: Models, plans: Region, monkeypatch: pytest.MonkeyPatch) -> None:
    """Slots hold any sequence that a request can; a smaller one shows what is said where they do not."""
    monkeypatch.setattr(plan_slots, "MAX_BODY", 4000)
    steps = (JointMove(target=(0.1,) * 6, relative=True), Dwell(duration_s=1.0))
    error = solve(models, plans.map(), job(1, move=SequenceMove(steps=steps))).error
    assert error is not None
    assert error.code is ErrorCode.TOO_LARGE
    assert "fewer steps" in error.message


def test_reserved_plans_are_read_and_those_that_never_began_are_not(models: Models, plans: Region) -> None:
    buffer = plans.map()
    for ref, slot in ((1, 1), (2, 2)):
        assert solve(models, buffer, job(ref, slot)).error is None
    reserved = tuple(Reserved(slot=slot, plan_id=ref) for ref, slot in ((1, 1), (5, 2), (9, 9)))
    assert [plan.plan_id for plan in others(buffer, job(3, reserved=reserved))] == [1]
