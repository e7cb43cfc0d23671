"""The program itself: `axisync-emulator`, in a process of its own, in real time and in lock-step."""

import itertools
import os
import re
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

from axisync_emulator.simcan.interface import SimCanBus
from axisync_schemas import eds

CELL_FILE = Path(__file__).parents[3] / "service/axisync_service/cells/eod.toml"
MASTER = Path(__file__).parent / "lock_step_master.py"

Start = Callable[..., subprocess.Popen[str]]


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "axisync_emulator.main", *map(str, arguments)]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts the emulator and waits for `ready`; ends what a test leaves."""
    processes: list[subprocess.Popen[str]] = []

    def start(*arguments: object, cell: Path = CELL_FILE) -> subprocess.Popen[str]:
        process = subprocess.Popen(command(cell, *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        processes.append(process)
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        return process

    yield start
    for process in processes:
        end(process)


def end(process: subprocess.Popen[str], number: int = signal.SIGTERM) -> tuple[int, str]:
    """Exit status and what it wrote to stderr."""
    if process.poll() is None:
        process.send_signal(number)
    _, errors = process.communicate(timeout=10)
    return process.returncode, errors


def refused(*arguments: object) -> tuple[int, str]:
    done = subprocess.run(command(*arguments), capture_output=True, text=True, timeout=60)
    assert done.stdout == ""
    return done.returncode, done.stderr


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_ends_cleanly_on_a_signal(start: Start, tmp_path: Path, number: int):
    process = start("--simcan", tmp_path, "--statistics")
    assert end(process, number)[0] == 0
    assert list(tmp_path.glob("*.sock")) == []


def test_serves_both_buses_and_reports_them(start: Start, tmp_path: Path):
    process = start("--simcan", tmp_path, "--statistics")
    for name in ("kingkong", "wukong"):
        bus = SimCanBus(str(tmp_path / f"{name}.sock"))
        heard = {message.arbitration_id for message in (bus.recv(1.0) for _ in range(12)) if message}
        assert heard == {0x701, 0x702, 0x703, 0x704, 0x705, 0x706}
        bus.shutdown()
    status, errors = end(process)
    assert status == 0
    assert re.search(r"bus=kingkong frames=\d\d+ bits=\d+ load=0\.\d+ lost=0\n", errors)


def test_one_bus_of_the_cell_at_a_priority(start: Start, tmp_path: Path):
    process = start("--simcan", tmp_path, "--bus", "wukong", "--priority", 7, "--statistics")
    if os.sched_getscheduler(process.pid) == os.SCHED_FIFO:
        assert os.sched_getparam(process.pid).sched_priority == 7
    else:
        assert "no permission for SCHED_FIFO priority 7" in end(process)[1]
        return
    assert [path.name for path in tmp_path.glob("*.sock")] == ["wukong.sock"]


def test_second_emulator_refuses_the_same_socket(start: Start, tmp_path: Path):
    start("--simcan", tmp_path)
    status, errors = refused(CELL_FILE, "--simcan", tmp_path)
    assert status == 1
    assert errors == f"axisync-emulator: {tmp_path}/kingkong.sock is served by another process\n"


def test_refusals_are_one_line(tmp_path: Path):
    bad = tmp_path / "bad.toml"
    bad.write_text(CELL_FILE.read_text().replace("period_ms = 2.0", 'period_ms = "fast"'))
    status, errors = refused(bad, "--simcan", tmp_path)
    assert status == 1
    assert re.fullmatch(rf"axisync-emulator: {bad}: period_ms: .*\n", errors)
    status, errors = refused(CELL_FILE, "--bus", "godzilla")
    assert (status, errors) == (2, "axisync-emulator: bus 'godzilla' is none of kingkong, wukong\n")
    status, errors = refused(CELL_FILE, "--lock-step")
    assert status == 2
    assert errors.count("\n") == 1
    assert "--simcan DIR" in errors


def test_missing_interface_is_named(tmp_path: Path):
    cell = tmp_path / "cell.toml"
    cell.write_text(CELL_FILE.read_text().replace('"vcan0"', '"nosuchcan0"'))
    status, errors = refused(cell, "--bus", "kingkong")
    assert status == 1
    assert errors.startswith("axisync-emulator: CAN interface nosuchcan0 of bus kingkong: ")
    assert errors.count("\n") == 1


def test_missing_cell_file(tmp_path: Path):
    status, errors = refused(tmp_path / "none.toml")
    assert status == 1
    assert "cannot be read" in errors


def test_dies_with_its_parent(tmp_path: Path):
    launcher = (
        "import subprocess, sys, time\n"
        f"child = subprocess.Popen({command(CELL_FILE, '--simcan', tmp_path, '--die-with-parent')!r},"
        " stdout=subprocess.PIPE)\n"
        "child.stdout.readline()\n"
        "print(child.pid, flush=True)\n"
    )
    done = subprocess.run([sys.executable, "-c", launcher], capture_output=True, text=True, timeout=60)
    pid = int(done.stdout)
    for _ in range(500):
        if not (tmp_path / "kingkong.sock").exists():
            break
        time.sleep(0.01)
    else:
        os.kill(pid, signal.SIGKILL)
        pytest.fail("it outlived its parent by 5 s")


@pytest.fixture
def network(start: Start, tmp_path: Path) -> Iterator[canopen.Network]:
    """python-canopen as the master."""
    start("--simcan", tmp_path, "--bus", "kingkong")
    network = canopen.Network(bus=SimCanBus(str(tmp_path / "kingkong.sock")))
    network.connect()
    yield network
    network.disconnect()


def remote(network: canopen.Network, tmp_path: Path, node: type[canopen.RemoteNode] = canopen.RemoteNode):
    path = tmp_path / "drive.eds"
    path.write_text(eds.drive_eds_text())
    return network.add_node(node(1, str(path)))


def test_canopens_sdo_client_reads_and_writes(network: canopen.Network, tmp_path: Path):
    node = remote(network, tmp_path)
    assert node.sdo[0x1018][1].raw == 0x41584953
    assert node.sdo["Manufacturer device name"].raw == "axisync emulated servo drive"
    node.sdo[0x6085].raw = 54321
    assert node.sdo[0x6085].raw == 54321
    with pytest.raises(canopen.SdoAbortedError) as error:
        node.sdo[0x6041].raw = 1
    assert error.value.code == 0x06010002
    assert node.nmt.wait_for_heartbeat(2.0) == "PRE-OPERATIONAL"


def test_canopens_402_master_enables_and_moves_a_drive(network: canopen.Network, tmp_path: Path):
    node = remote(network, tmp_path, BaseNode402)
    assert isinstance(node, BaseNode402)
    node.nmt.state = "PRE-OPERATIONAL"
    node.sdo[0x6060].raw = 8
    node.sdo[0x60C2][1].raw = 10
    node.sdo[0x2000].raw = 100  # python's threads keep no time
    node.setup_402_state_machine()
    node.nmt.state = "OPERATIONAL"
    network.sync.start(0.01)
    node.rpdo[1].start(0.01)
    try:
        node.state = "OPERATION ENABLED"
        assert node.state == "OPERATION ENABLED"
        at = node.sdo[0x6064].raw
        time.sleep(0.1)  # the brake takes 60 ms, in which the target must be held
        for _ in range(100):
            at += 50
            node.rpdo[1][0x607A].raw = at
            time.sleep(0.01)
        time.sleep(0.1)
        assert node.sdo[0x6064].raw == pytest.approx(at, abs=1)
        assert node.sdo[0x6041].raw & 0x6F == 0x27
    finally:
        node.rpdo[1].stop()
        network.sync.stop()


def test_canopens_402_master_homes_a_drive(network: canopen.Network, tmp_path: Path):
    node = remote(network, tmp_path, BaseNode402)
    assert isinstance(node, BaseNode402)
    node.nmt.state = "PRE-OPERATIONAL"
    node.sdo[0x6098].raw = 19
    node.sdo[0x607C].raw = 12_345
    node.sdo[0x6099][1].raw = 40_000
    node.sdo[0x2000].raw = 100
    node.setup_402_state_machine()
    # What its `homing` writes to the controlword acts at once: it looks at the very next statusword.
    node.rpdo[1].trans_type = 255
    node.rpdo[1].save()
    node.nmt.state = "OPERATIONAL"
    network.sync.start(0.01)
    try:
        assert node.homing(timeout=10)
        assert node.is_homed()
        assert node.sdo[0x6064].raw == pytest.approx(12_345, abs=500)
        assert node.sdo[0x6041].raw & 0x3400 == 0x1400
    finally:
        network.sync.stop()


def dump_of(start: Start, directory: Path, *arguments: object) -> str:
    """One scripted move over both buses in lock-step, as the bus saw it."""
    directory.mkdir()
    process = start("--simcan", directory, "--lock-step", "--candump", directory / "dump.log", *arguments)
    subprocess.run([sys.executable, str(MASTER), str(directory)], check=True, timeout=60)
    assert end(process)[0] == 0
    return (directory / "dump.log").read_text()


def test_lock_step_gives_the_same_frames_each_time(start: Start, tmp_path: Path):
    first = dump_of(start, tmp_path / "a")
    second = dump_of(start, tmp_path / "b")
    assert first == second
    assert first.count(" kingkong 201#") > 150
    assert first.count(" wukong 186#") > 150
    # Virtual time begins at 1 s; the first frame is a drive's boot-up.
    assert first.startswith("(1.000")


def test_time_stands_still_unless_all_wait(start: Start, tmp_path: Path):
    start("--simcan", tmp_path, "--lock-step", "--bus", "kingkong")
    bus = SimCanBus(str(tmp_path / "kingkong.sock"))
    sniffer = SimCanBus(str(tmp_path / "kingkong.sock"))
    source = bus.time_source
    assert source is not None
    assert bus.time_source is source
    begin = source.now_ns()
    time.sleep(0.05)
    assert source.now_ns() == begin
    # Two seconds of drives' time take no two seconds, and their heartbeats are exactly 100 ms apart.
    assert source.wait_until_ns(begin + 2_050_000_000) == begin + 2_050_000_000
    beats = [at for can_id, data, at in sniffer.drain() if can_id == 0x701 and data == b"\x7f"]
    assert {b - a for a, b in itertools.pairwise(beats)} == {100_000_000}
    assert len(beats) == 20
    assert len(bus.drain()) == 6 * 21
    sniffer.shutdown()
    # Woken by a frame, at its completion, before the time that was waited for.
    bus.send_frame(0x601, bytes.fromhex("4018100100000000"))
    now = source.wait_until_ns(begin + 3_000_000_000, wake_on_frame=True)
    ((can_id, _, at),) = bus.drain()
    assert can_id == 0x581
    assert at <= now <= at + 1
    assert now < begin + 2_051_000_000
    bus.shutdown()


def test_a_participant_that_leaves_no_longer_counts(start: Start, tmp_path: Path):
    start("--simcan", tmp_path, "--lock-step", "--bus", "kingkong", "--participants", 2)
    leaver = subprocess.Popen([sys.executable, str(MASTER), str(tmp_path), "leave"], stdin=subprocess.PIPE)
    bus = SimCanBus(str(tmp_path / "kingkong.sock"))
    source = bus.time_source
    assert source is not None
    begin = source.now_ns()
    done: list[int] = []
    waiter = threading.Thread(target=lambda: done.append(source.wait_until_ns(begin + 1_000_000_000)))
    waiter.start()
    waiter.join(0.3)
    assert done == []
    leaver.communicate(b"\n", timeout=60)
    waiter.join(10)
    assert done == [begin + 1_000_000_000]
    bus.shutdown()


def test_the_end_of_the_hub_ends_the_wait(start: Start, tmp_path: Path):
    process = start("--simcan", tmp_path, "--lock-step", "--bus", "kingkong")
    bus = SimCanBus(str(tmp_path / "kingkong.sock"))
    source = bus.time_source
    assert source is not None
    end(process)
    with pytest.raises(ConnectionError):
        source.wait_until_ns(source.now_ns() + 1)
    with pytest.raises(can.CanOperationError):
        bus.drain()
    bus.shutdown()


def cycles(bus: SimCanBus, first: int, count: int, word: int) -> list[tuple[int, bytes, int]]:
    """SYNC and target 0 every 20 ms."""
    heard = []
    for k in range(first, first + count):
        bus.send_frame(0x080, bytes([k % 240 + 1]))
        bus.send_frame(0x201, struct.pack("<Hi", word, 0))
        time.sleep(0.02)
        heard += bus.drain()
    return heard


def test_a_pause_of_the_emulator_is_no_fault_of_the_bus(start: Start, tmp_path: Path):
    process = start("--simcan", tmp_path, "--bus", "kingkong")
    bus = SimCanBus(str(tmp_path / "kingkong.sock"))
    for command_byte, index, sub, value in (
        (0x2F, 0x1019, 0, 240), (0x23, 0x1006, 0, 20_000), (0x2F, 0x60C2, 1, 20), (0x2F, 0x6060, 0, 8),
    ):  # fmt: skip
        bus.send_frame(0x601, struct.pack("<BHBI", command_byte, index, sub, value))
    bus.send_frame(0x000, b"\x01\x01")
    cycles(bus, 0, 4, 0x06)
    cycles(bus, 4, 4, 0x07)
    enabled = cycles(bus, 8, 6, 0x0F)
    assert any(can_id == 0x181 and data[0] & 0x6F == 0x27 for can_id, data, _ in enabled)
    # Away for 400 ms, three times as long as the drive tolerates no SYNC (6.5 periods of 20 ms).
    process.send_signal(signal.SIGSTOP)
    assert cycles(bus, 14, 20, 0x0F) == []
    process.send_signal(signal.SIGCONT)
    heard = cycles(bus, 34, 3, 0x0F)
    positions = [(data, at) for can_id, data, at in heard if can_id == 0x181]
    assert len(positions) >= 20
    assert all(data[0] & 0x6F == 0x27 for data, _ in positions)
    assert [data for can_id, data, _ in heard if can_id == 0x081] == []
    bus.shutdown()
