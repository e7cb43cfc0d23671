"""The SDK, its examples and the Python of its documents against the real service."""

import asyncio
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from axisync_client import (
    AsyncClient,
    AxisyncError,
    Client,
    LeaseLost,
    MoveStatus,
    MoveStopped,
    Setpoints,
    deg,
    to_deg,
)
from axisync_emulator.faults.control import ask
from support.cells import eod_text
from support.daemon import Daemon, running, unhurried, wait_for
from support.documents import ROOT, python_blocks
from support.logread import logs_in

pytestmark = pytest.mark.unhurried

EXAMPLES = ROOT / "clients" / "examples"
TIMEOUT_S = 90.0
PAGES = ("README.md", "docs/clients.md", "docs/log.md", "docs/protocol.md")
BLOCKS = [(page, number) for page in PAGES for number in range(len(python_blocks(ROOT / page)))]
FAULT = {"kind": "emergency", "bus": "kingkong", "node": 1, "code": 0x2310, "duration_s": 0.2}


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    """One daemon for all tests here, with drives that can be given faults."""
    directory = tmp_path_factory.mktemp("sdk")
    (directory / "control").mkdir()
    with running(directory, unhurried(eod_text()), arguments=("--control", str(directory / "control"))) as daemon:
        with Client(daemon.endpoint, timeout_s=TIMEOUT_S) as client:
            client.plan_joint("kingkong", client.state().groups["kingkong"].setpoint)  # the planner is warm
        yield daemon


def example(service: Daemon, name: str, *words: str) -> "subprocess.Popen[str]":
    """Started as a user starts it."""
    return python(service, str(EXAMPLES / name), *words)


def python(service: Daemon, *words: str) -> "subprocess.Popen[str]":
    environment = {**os.environ, "AXISYNC_ENDPOINT": service.endpoint, "PYTHONUNBUFFERED": "1"}
    return subprocess.Popen(
        [sys.executable, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
        cwd=service.directory,
    )  # fmt: skip


def printed(process: "subprocess.Popen[str]") -> list[str]:
    """Its lines, once it has ended well."""
    out, errors = process.communicate(timeout=TIMEOUT_S)
    assert (process.returncode, errors) == (0, ""), out + errors
    return out.splitlines()


def test_there_is_a_test_for_every_example() -> None:
    text = Path(__file__).read_text(encoding="utf-8")
    assert [path.name for path in EXAMPLES.glob("*.py") if f'"{path.name}"' not in text] == []


def test_first_move(service: Daemon) -> None:
    lines = printed(example(service, "first_move.py"))
    assert [line.split(" in ")[0] for line in lines] == ["+10 degrees", "-10 degrees"]


def test_two_arms(service: Daemon) -> None:
    lines = printed(example(service, "two_arms.py"))
    assert [line.split(" in ")[0] for line in lines] == ["-50 mm", "+50 mm"]


@pytest.fixture(autouse=True)
def _no_fault_is_left(service: Daemon) -> None:
    """A test that fails leaves the others a chance."""
    with Client(service.endpoint) as client:
        groups = client.state().groups
        for name in (name for name, group in groups.items() if group.state == "fault"):
            with client.lease(name, take=True) as lease:
                lease.reset()


@pytest.mark.parametrize("words", [("move.svg",), ()])
def test_streaming_plot(service: Daemon, words: tuple[str, ...]) -> None:
    lines = printed(example(service, "streaming_plot.py", *words))
    assert int(lines[0].split()[0]) > 100
    if words and find_spec("matplotlib"):
        assert lines[1] == "drawn in move.svg"
        assert "kingkong.1" in (service.directory / "move.svg").read_text(encoding="utf-8")
    else:
        assert lines[-1].startswith("kingkong.6")


def test_fault_recovery_from_refusals(service: Daemon) -> None:
    lines = printed(example(service, "fault_recovery.py"))
    assert lines[0].startswith("SOFT_LIMIT: the bound of kingkong.1 is ")
    assert lines[1].startswith("INFEASIBLE_DURATION: ")
    assert lines[2:] == ["arrived", "arrived"]


def test_fault_recovery_from_a_fault(service: Daemon) -> None:
    process = example(service, "fault_recovery.py", "3")
    with Client(service.endpoint) as client:
        wait_for(lambda: client.state().groups["kingkong"].state == "moving", "it moves", TIMEOUT_S)
        ask(service.directory / "control" / "kingkong.sock", {"inject": FAULT})
    lines = printed(process)
    assert any(line.startswith("fault: ") for line in lines), lines
    assert lines.count("arrived") == 6, lines


@pytest.fixture(scope="module")
def log(service: Daemon) -> Path:
    """What the daemon has written so far, as a log of its own."""
    whole = service.directory / "so_far.mcap"
    printed(python(service, "-m", "axisync_cli", "recover", str(logs_in(service.log_dir)[-1]), "-o", str(whole)))
    return whole


@pytest.mark.parametrize(("page", "number"), BLOCKS)
def test_a_documents_python_runs_as_it_stands(service: Daemon, log: Path, page: str, number: int) -> None:
    """Each block by itself: what it needs, it imports. Its argument, for those that read one, is a log."""
    with Client(service.endpoint, timeout_s=TIMEOUT_S) as client, client.lease("all") as arms:
        arms.enable()
    printed(python(service, "-W", "error", "-c", python_blocks(ROOT / page)[number], str(log)))


def test_async_moves_beside_streams(service: Daemon) -> None:
    async def collect(batches: list[Setpoints], client: AsyncClient) -> None:
        async with client.setpoints() as stream:
            while True:
                batches.append(await anext(stream))

    async def main() -> None:
        batches: list[Setpoints] = []
        async with AsyncClient(service.endpoint) as client, client.lease("all") as arms:
            await arms.enable()
            collector = asyncio.create_task(collect(batches, client))
            while not batches:
                await asyncio.sleep(0.01)
            moves = [
                await arms.move_joint(deg(3, 0, 0, 0, 0, 0), group=name, relative=True)
                for name in ("kingkong", "wukong")
            ]
            await asyncio.gather(*[move.result(TIMEOUT_S) for move in moves])
            await asyncio.sleep(0.2)
            collector.cancel()
        ends = np.concatenate([batch.position for batch in batches])
        assert to_deg(ends[-1] - ends[0])[[0, 6]] == pytest.approx([3.0, 3.0], abs=1e-6)

    asyncio.run(asyncio.wait_for(main(), TIMEOUT_S))


def test_async_move_that_somebody_stops(service: Daemon) -> None:
    async def main() -> None:
        async with AsyncClient(service.endpoint) as client, client.lease("wukong") as arm:
            await arm.enable()
            move = await arm.move_joint(deg(30, 0, 0, 0, 0, 0), relative=True, duration_s=20.0)
            async for report in move.updates():
                if report.progress > 0.0:
                    break
            await client.stop("wukong")
            with pytest.raises(MoveStopped):
                await move.result(TIMEOUT_S)

    asyncio.run(asyncio.wait_for(main(), TIMEOUT_S))


def test_two_operators(service: Daemon) -> None:
    """The move goes on for who takes the lease, to hold, resume or stop it."""
    told = threading.Event()
    with Client(service.endpoint) as first, Client(service.endpoint) as second:
        lease = first.lease("kingkong", on_lost=lambda *_: told.set())
        lease.enable()
        move = lease.move_joint(deg(-5, 0, 0, 0, 0, 0), relative=True, duration_s=40.0)
        wait_for(lambda: move.progress() > 0.0, "it moves", TIMEOUT_S)
        with second.lease("kingkong", ttl_s=10.0, take=True) as taken:
            with pytest.raises(LeaseLost, match="the lease on kingkong is lost"):
                move.wait(TIMEOUT_S)
            assert told.wait(TIMEOUT_S)
            taken.hold()
            wait_for(lambda: move.report().status is MoveStatus.HELD, "it is held", TIMEOUT_S)
            taken.resume()
            wait_for(lambda: move.report().status is MoveStatus.EXECUTING, "it goes on", TIMEOUT_S)
            taken.stop()
            wait_for(lambda: move.report().status is MoveStatus.STOPPED, "it is stopped", TIMEOUT_S)


def test_a_front_that_is_killed_is_found_again(service: Daemon) -> None:
    with Client(service.endpoint) as client:
        lease = client.lease("kingkong", ttl_s=1.0)
        states = client.states()
        next(states)
        os.kill(service.pid("front"), 9)
        wait_for(lambda: lease.lost, "the lease is lost", TIMEOUT_S)
        with pytest.raises(LeaseLost):
            lease.enable()
        wait_for(lambda: answers(client), "front is back", TIMEOUT_S)
        with client.lease("kingkong") as again:
            assert again.enable().groups == {"kingkong": "standstill"}
        states.close()
        with client.states() as fresh:
            assert set(next(fresh).groups) == {"kingkong", "wukong"}


def answers(client: Client) -> bool:
    try:
        return client.state().controller == "up"
    except AxisyncError:
        return False
