"""The recorder's own process: what it leaves behind when it is closed, killed, or its disk is full."""

import contextlib
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from axisync_schemas import plan_slots
from axisync_schemas.memory import Word
from support.feeder import Feeder
from support.logread import Log, logs_in, read_log
from support.recording import Recording, small_disk, wait_for

FAILING, WRITING = 2, 1


@pytest.fixture
def recording(tmp_path: Path) -> Iterator[Recording]:
    with Recording(tmp_path) as one:
        yield one


def logged(recording: Recording) -> Log:
    return read_log(*logs_in(recording.log_dir))


def fill_up(directory: Path) -> Path:
    """A file that takes all the room there is."""
    ballast = directory / "ballast"
    with contextlib.suppress(OSError), ballast.open("wb", buffering=0) as file:
        while True:
            file.write(bytes(65536))
    return ballast


def assert_as_fed(log: Log, feeder: Feeder, first: int, last: int) -> None:
    """Every tick first..last is there, byte for byte."""
    assert log.ticks["tick"].tolist() == list(range(first, last + 1))
    fed = b"".join(feeder.record(tick).tobytes() for tick in range(first, last + 1))
    assert log.ticks.tobytes() == fed


def test_closing_leaves_everything_and_exit_status_0(recording: Recording) -> None:
    recording.start()
    recording.feeder.write(1, 1500)
    recording.send_event("hello")
    status, said = recording.close()
    log = logged(recording)
    assert status == 0, said
    assert_as_fed(log, recording.feeder, 1, 1500)
    assert recording.control[Word.RECORDER_CURSOR] == 1501
    assert log.complete
    assert log.kinds() == ["log_opened", "group_state", "log_closed"]


def test_a_killed_recorder_is_followed_by_one_that_goes_on(recording: Recording) -> None:
    recording.start()
    recording.feeder.write(1, 700)
    recording.wait_cursor(400)
    recording.kill()
    recording.feeder.write(701, 2000)  # Nobody is there.
    recording.send_event("meanwhile")
    recording.start()
    recording.feeder.write(2001, 2300)
    assert recording.close()[0] == 0
    files = logs_in(recording.log_dir)
    assert len(files) == 2
    assert not read_log(files[0]).complete
    assert_as_fed(logged(recording), recording.feeder, 1, 2300)
    assert recording.control[Word.RECORDER_LOST] == 0
    assert [event.data["message"] for event in logged(recording).events if event.data["source"] == "front"]


def test_a_chunk_written_before_the_cursor_moved_is_written_again_and_read_once(recording: Recording) -> None:
    recording.start()
    recording.feeder.write(1, 500)
    recording.wait_cursor(400)
    recording.kill()
    recording.control[Word.RECORDER_CURSOR] = 101  # As if the kill had come just after the write.
    recording.start()
    assert recording.close()[0] == 0
    log = logged(recording)
    assert log.duplicates >= 300
    assert_as_fed(log, recording.feeder, 1, 500)


def test_ticks_that_the_ring_no_longer_holds_are_counted_and_said(recording: Recording) -> None:
    recording.start()
    recording.feeder.write(1, 100)
    recording.wait_cursor(101)
    recording.kill()
    recording.feeder.write(101, 100 + recording.slots + 300)
    recording.start()
    status, said = recording.close()
    log = logged(recording)
    assert status == 0
    assert recording.control[Word.RECORDER_LOST] == 300
    lost = [event.data for event in log.events if event.data["kind"] == "recorder_lost"]
    assert [event["details"]["ranges"] for event in lost] == [[[101, 400]]]
    assert lost[0]["details"]["lost"] == 300
    assert "kind=recorder_lost" in said
    assert log.ticks["tick"].tolist() == [*range(1, 101), *range(401, 401 + recording.slots)]


def test_a_full_disk_is_said_and_left_behind_when_there_is_room_again(tmp_path: Path) -> None:
    with contextlib.ExitStack() as stack:
        try:
            directory = stack.enter_context(small_disk(tmp_path / "disk", 8))
        except PermissionError as error:
            pytest.skip(str(error))
        with Recording(tmp_path, log_dir=directory) as recording:
            recording.start()
            recording.feeder.write(1, 300)
            recording.wait_cursor(200)
            ballast = fill_up(directory)
            recording.feeder.write(301, 2000)
            wait_for(lambda: recording.control[Word.RECORDER_STATE] == FAILING, "nobody noticed")
            cursor = recording.control[Word.RECORDER_CURSOR]
            recording.send_event("while the disk was full")
            time.sleep(1.2)
            assert recording.control[Word.RECORDER_CURSOR] == cursor
            assert recording.process is not None
            assert recording.process.poll() is None
            ballast.unlink()
            wait_for(lambda: recording.control[Word.RECORDER_STATE] == WRITING, "it does not come back")
            status, said = recording.close()
            log = logged(recording)
            assert status == 0
            assert said.count("kind=log_failed") <= 4
            assert len(logs_in(directory)) == 2
            assert_as_fed(log, recording.feeder, 1, 2000)
            assert "while the disk was full" in [event.data["message"] for event in log.events]


def test_a_file_size_limit_makes_new_files_not_a_crash(recording: Recording) -> None:
    limit = 300_000
    recording.start(before=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
    recording.feeder.write(1, 2000)
    recording.wait_cursor(400)
    wait_for(lambda: len(logs_in(recording.log_dir)) >= 2, "no second file")
    recording.kill()
    log = logged(recording)
    last = int(log.ticks["tick"][-1])
    assert last >= recording.control[Word.RECORDER_CURSOR] - 1
    assert_as_fed(log, recording.feeder, 1, last)
    assert all(path.stat().st_size <= limit for path in logs_in(recording.log_dir))


def test_no_directory_is_one_sentence_and_exit_status_1(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with Recording(tmp_path, log_dir=tmp_path / "file" / "logs") as recording:
        recording.start(wait=False)
        status, said = recording.ended()
    assert status == 1
    assert said.strip() == f"axisyncd: cannot write a log into {tmp_path / 'file' / 'logs'}: Not a directory"


def test_a_second_start_waits_for_its_directory_instead_of_giving_up(recording: Recording) -> None:
    recording.control[Word.RECORDER_STATE] = WRITING
    recording.log_dir.write_text("in the way")
    recording.start()
    wait_for(lambda: recording.control[Word.RECORDER_STATE] == FAILING, "it does not say that it fails")
    recording.feeder.write(1, 200)
    recording.log_dir.unlink()
    wait_for(lambda: recording.control[Word.RECORDER_STATE] == WRITING, "it does not try again")
    assert recording.close()[0] == 0
    assert_as_fed(logged(recording), recording.feeder, 1, 200)


def test_a_lone_sigterm_closes_when_the_controller_is_done(recording: Recording) -> None:
    process = recording.start()
    recording.feeder.write(1, 50)
    process.send_signal(signal.SIGINT)  # Ignored.
    process.send_signal(signal.SIGTERM)
    time.sleep(0.2)
    assert process.poll() is None
    recording.feeder.write(51, 60)
    recording.control[Word.CONTROLLER_DONE] = 1
    assert recording.ended()[0] == 0
    assert_as_fed(logged(recording), recording.feeder, 1, 60)


def test_a_message_reaches_the_kernel_within_a_second_or_so(recording: Recording) -> None:
    """No ticks fill the chunk."""
    recording.start()
    recording.send_event("soon")
    begin = time.monotonic()
    wait_for(lambda: any(event.data["message"] == "soon" for event in logged(recording).events), "it never comes", 5.0)
    assert time.monotonic() - begin < 3.0


def test_the_plan_of_a_slot_is_logged_to_the_bit(recording: Recording) -> None:
    rng = np.random.default_rng(5)
    plan = plan_slots.Plan(
        plan_id=77,
        axes=np.arange(6, dtype=np.uint32),
        knots=np.concatenate([[0.0], np.cumsum(rng.random(7))]),
        coefficients=rng.normal(size=(7, 4, 6)) * 10.0 ** rng.integers(-12, 12, (7, 4, 6)),
        start=rng.normal(size=6),
        end=rng.normal(size=6),
        rate_codes=np.arange(3 * 4 * 7, dtype=np.uint16).reshape(3, 4, 7),
        rate_limits=rng.normal(size=(4, 6)),
    )
    plan_slots.write_plan(recording.plans, 3, plan)
    recording.start()
    head = {"plan_id": 77, "move_id": "m-1", "group": "kingkong"}
    recording.send("/plans", head, slot=3, plan_id=77)
    recording.send("/plans", {**head, "plan_id": 78}, slot=3, plan_id=78)
    assert recording.close()[0] == 0
    plans = logged(recording).plans
    for name in ("axes", "knots", "coefficients", "start", "end", "rate_limits"):
        values = np.array(plans[77][name], dtype=getattr(plan, name).dtype)
        assert values.tobytes() == getattr(plan, name).tobytes()
    assert plans[78]["missing"] == "plan slot 3 holds plan 77, not 78"


def test_it_loads_neither_zenoh_nor_can() -> None:
    code = "import sys, axisync_service.recorder_process; print({'zenoh', 'can', 'canopen'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
