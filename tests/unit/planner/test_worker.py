"""The worker's loop over its socket: answers in order, bad packets, fronts that come and go."""

import os
import socket
import struct
from collections.abc import Iterator
from pathlib import Path

import pytest

from axisync_schemas.cell import Cell, read_cell
from axisync_schemas.commands import JointMove
from axisync_schemas.errors import ErrorCode
from axisync_schemas.internal import MAX_PACKET, PlanJob, PlanResult
from axisync_schemas.memory import PLAN_SLOT_BYTES, PLAN_SLOTS, Control, Region, Word
from axisync_schemas.plan_slots import read_plan
from axisync_service import planner_worker
from axisync_service.planner_worker import Worker, solve


@pytest.fixture(scope="module")
def cell() -> Cell:
    found, _ = read_cell(Path(__file__).parents[3] / "service" / "axisync_service" / "cells" / "eod.toml")
    return found


@pytest.fixture
def plans() -> Iterator[Region]:
    size = PLAN_SLOTS * PLAN_SLOT_BYTES
    descriptor = os.memfd_create("plans")
    os.ftruncate(descriptor, size)
    yield Region("plans", descriptor, size)
    os.close(descriptor)


def job(ref: int, slot: int | None = 3) -> PlanJob:
    move = JointMove(target=(0.1,) * 6, relative=True)
    return PlanJob(ref=ref, group="kingkong", plan_id=ref, slot=slot, start=(0.0,) * 6, move=move, speed_scale=1.0)


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


def test_whoever_connects_sees_the_worker_s_process_id(worker: tuple[Worker, Path, Control]) -> None:
    _, path, _ = worker
    with connect(path) as front:
        credentials = front.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12)
    assert struct.unpack("3i", credentials)[0] == os.getpid()


def test_a_fault_of_ours_is_an_answer(cell: Cell, plans: Region, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("secret")

    monkeypatch.setattr(planner_worker, "plan_joint_move", broken)
    error = solve(cell, plans.map(), job(1)).error
    assert error is not None
    assert error.code is ErrorCode.INTERNAL
    assert error.message == "planning failed: ZeroDivisionError"


def test_warming_up_plans_every_group(cell: Cell, monkeypatch: pytest.MonkeyPatch) -> None:
    planned: list[str] = []
    monkeypatch.setattr(planner_worker, "plan_joint_move", lambda _, job: planned.append(job.group))
    planner_worker.warm_up(cell)
    assert planned == ["kingkong", "wukong", "both"]


@pytest.mark.parametrize("slot", [-1, PLAN_SLOTS])
def test_a_slot_that_is_none(cell: Cell, plans: Region, slot: int) -> None:
    error = solve(cell, plans.map(), job(1, slot)).error
    assert error is not None
    assert error.code is ErrorCode.INTERNAL


def test_a_job_of_the_wrong_size(cell: Cell, plans: Region) -> None:
    wrong = job(1).model_copy(update={"start": (0.0,) * 5})
    assert solve(cell, plans.map(), wrong).error is not None
