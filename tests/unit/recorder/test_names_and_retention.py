"""Which files are ours, and which of them are kept."""

import fcntl
from pathlib import Path

import pytest

from axisync_service.recorder.names import FAULTS, LogName
from axisync_service.recorder.retention import log_files, tidy

KB = 1000


def make(directory: Path, name: str, size: int = KB) -> Path:
    path = directory / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(bytes(size))
    return path


@pytest.mark.parametrize(
    "name",
    [
        "eod-20260102T030405Z.mcap",
        "eod-20260102T030405Z-12.mcap",
        "eod-20260102T030405Z-fault-drive_fault.mcap",
        "eod-20260102T030405Z-fault-drive_lost-2.mcap",
    ],
)
def test_names_are_read_as_they_are_written(name: str) -> None:
    parsed = LogName.parse("eod", name)
    assert parsed is not None
    assert str(parsed) == name


@pytest.mark.parametrize(
    "name",
    [
        "eod-2-20260102T030405Z.mcap",  # of the cell eod-2
        "eod-20260102T030405Z.mcap.bak",
        "eod-20260102T030405Z-1.mcap",
        "eod-20260102T030405Z-02.mcap",
        "my-eod-20260102T030405Z.mcap",
        "eod-20260102.mcap",
        "eod-20260102T030405Z-fault-.mcap",
        "eod-20260102T030405Z\n.mcap",
    ],
)
def test_other_names_are_not_ours(name: str) -> None:
    assert LogName.parse("eod", name) is None


def test_names_sort_by_time_then_number() -> None:
    names = ["eod-20260102T030405Z.mcap", "eod-20260102T030405Z-2.mcap", "eod-20260102T030405Z-10.mcap",
             "eod-20260102T030406Z-fault-x.mcap"]  # fmt: skip
    parsed = [LogName.parse("eod", name) for name in reversed(names)]
    assert [str(name) for name in sorted(name for name in parsed if name)] == names


def test_the_oldest_go_until_the_rest_fits_and_nothing_of_others(tmp_path: Path) -> None:
    old = make(tmp_path, "eod-20260101T000000Z.mcap", 4 * KB)
    extract = make(tmp_path / FAULTS, "eod-20260101T000001Z-fault-x.mcap", 2 * KB)
    kept = make(tmp_path, "eod-20260102T000000Z.mcap", 3 * KB)
    newest = make(tmp_path, "eod-20260103T000000Z.mcap", 3 * KB)
    others = [make(tmp_path, name, 50 * KB) for name in ("notes.txt", "eod-x-20200101T000000Z.mcap", "eod.mcap")]
    (tmp_path / "eod-20200101T000000Z.mcap").symlink_to(others[0])
    (tmp_path / "eod-20200102T000000Z.mcap").mkdir()
    assert [file.path for file in log_files(tmp_path, "eod")] == [old, extract, kept, newest]
    assert [file.path for file in tidy(tmp_path, "eod", 6 * KB)] == [old, extract]
    assert sorted(path.name for path in tmp_path.glob("eod-2026*.mcap")) == [kept.name, newest.name]
    assert all(path.exists() for path in others)
    assert tidy(tmp_path, "eod", 6 * KB) == []


def test_the_newest_stays_however_large(tmp_path: Path) -> None:
    make(tmp_path, "eod-20260103T000000Z.mcap", 9 * KB)
    assert tidy(tmp_path, "eod", KB) == []


def test_a_file_that_is_being_written_stays(tmp_path: Path) -> None:
    for name in ("eod-20260101T000000Z.mcap", "eod-20260102T000000Z.mcap", "eod-20260103T000000Z.mcap"):
        make(tmp_path, name)
    with (tmp_path / "eod-20260101T000000Z.mcap").open("ab") as written:
        fcntl.flock(written, fcntl.LOCK_EX)
        assert [str(file.name) for file in tidy(tmp_path, "eod", KB)] == ["eod-20260102T000000Z.mcap"]


def test_a_directory_that_is_not_there_has_no_files(tmp_path: Path) -> None:
    assert tidy(tmp_path / "nowhere", "eod", KB) == []
