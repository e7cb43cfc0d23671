"""Whatever a file holds, there is a report or one sentence, never a traceback."""

import io
import random
import shutil
from contextlib import suppress
from pathlib import Path

import pytest
from mcap.writer import Writer

from axisync_review import log_file
from axisync_review.container import MAGIC
from axisync_review.errors import GIVE_A_LOG, LogUnreadable
from axisync_review.findings import gather
from axisync_review.html_report import page
from axisync_review.recover import recover
from axisync_review.replay import replay
from axisync_review.review import review_of
from axisync_review.why import why
from axisync_schemas.ticks import file_descriptor_set
from support.command_line import Run
from support.recording import CELL
from support.saved_log import Maker

CUTS = 200
FLIPS = 60
PAGES = 10
"""One in so many is also drawn and replayed, which is slow."""
COMMANDS = ("review", "why", "replay", "recover")


def everything(path: Path, out: Path, draw: bool) -> str:
    """All that reads a log; a sentence where it cannot be read."""
    try:
        found = gather([path], curves=draw)
    except LogUnreadable as error:
        return str(error)
    why(found)
    if draw:
        page(review_of(found), found)
        replay([path])
    out.unlink(missing_ok=True)
    if found.run.ticks:
        recover(path, out)
    else:
        with suppress(LogUnreadable):
            recover(path, out)
    return review_of(found).verdict


@pytest.fixture(scope="module")
def short_log(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A few chunks: quick to read two hundred times."""
    return Maker(tmp_path_factory.mktemp("short")).write(span=slice(0, 400)).read_bytes()


def test_a_log_cut_anywhere(short_log: bytes, tmp_path: Path) -> None:
    """Every cut that leaves a chunk leaves a report, on all ticks that are whole."""
    path, rng = tmp_path / "cut.mcap", random.Random(1)
    said: set[str] = set()
    for number, cut in enumerate([0, 1, 7, 8, len(short_log) - 1, *rng.sample(range(9, len(short_log)), CUTS)]):
        path.write_bytes(short_log[:cut])
        said.add(everything(path, tmp_path / "out.mcap", number % PAGES == 0).replace(str(path), "it"))
    known = {f"it is empty: {GIVE_A_LOG}", f"it is not an MCAP file: {GIVE_A_LOG}", "NOT GOOD: the log has no tick"}
    assert known <= said
    assert any(sentence.startswith("good: ") for sentence in said)
    assert any("it ends before its cell file" in sentence for sentence in said)


def test_a_log_with_flipped_bits(short_log: bytes, tmp_path: Path) -> None:
    path, rng = tmp_path / "flipped.mcap", random.Random(2)
    for number in range(FLIPS):
        data = bytearray(short_log)
        data[rng.randrange(8, len(data))] ^= 1 << rng.randrange(8)
        path.write_bytes(data)
        everything(path, tmp_path / "out.mcap", number % PAGES == 0)


def test_a_chunk_in_the_middle_is_damaged(short_log: bytes, tmp_path: Path) -> None:
    """The rest is read; what is missing is a gap, and the damage is told."""
    data = bytearray(short_log)
    at = data.find(b"\x28\xb5\x2f\xfd", len(data) // 2)  # zstd's magic number: the data of a chunk
    data[at + 40] ^= 0xFF
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    found = review_of(gather([path]))
    assert {problem.kind for problem in found.problems} >= {"gap", "damage"}
    assert found.ticks > 200


@pytest.mark.parametrize("command", COMMANDS)
def test_not_an_mcap_file(run: Run, tmp_path: Path, command: str) -> None:
    path = tmp_path / "letter.txt"
    path.write_text("Dear Sir or Madam,")
    shown = run(command, path)
    assert (shown.code, shown.out, shown.err) == (1, "", f"{path} is not an MCAP file: {GIVE_A_LOG}\n")


@pytest.mark.parametrize("command", COMMANDS)
def test_an_empty_file(run: Run, tmp_path: Path, command: str) -> None:
    path = tmp_path / "empty.mcap"
    path.touch()
    assert run(command, path).err == f"{path} is empty: {GIVE_A_LOG}\n"


@pytest.mark.parametrize("command", [*COMMANDS, "export", "diff"])
def test_no_file_at_all(run: Run, tmp_path: Path, command: str) -> None:
    missing, folder = tmp_path / "none.mcap", tmp_path
    more = {"export": ["--csv"], "diff": [missing]}.get(command, [])
    for path, words in ((missing, ("does not exist", "No such file")), (folder, ("is a directory",))):
        shown = run(command, path, *more)
        assert shown.code == 1
        assert any(word.lower() in shown.err.lower() for word in words), shown.err
        assert len(shown.err.splitlines()) == 1


@pytest.mark.parametrize("command", COMMANDS)
def test_somebody_elses_file(run: Run, tmp_path: Path, command: str) -> None:
    path = tmp_path / "ros.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="libmcap 1.2")
        writer.register_channel("/tf", "cdr", writer.register_schema("tf", "ros2msg", b""))
        writer.add_message(1, 0, b"0000", 0)
        writer.finish()
    assert f"{path} is an MCAP file of another program (profile 'ros2'" in run(command, path).err


def test_an_older_version(run: Run, make: Maker, monkeypatch: pytest.MonkeyPatch) -> None:
    """The fields of its ticks differ: the sentence names them."""
    path = make.write()
    newer = file_descriptor_set().replace(b"path_rate", b"path_tate")
    monkeypatch.setattr(log_file, "file_descriptor_set", lambda: newer)
    shown = run("review", path)
    assert shown.code == 1
    assert "written by another version of axisync, whose ticks differ in path_rate, path_tate" in shown.err
    assert len(shown.err.splitlines()) == 1


def test_messages_of_another_version(run: Run, make: Maker) -> None:
    """They are left out, counted, and told of."""
    shown = run("review", make.write(more=[("/events", 5, {"kind": "unheard_of", "since": "version 9"})]))
    assert shown.code == 0
    assert "1 messages of /events are of another schema version and were left out" in shown.out


def test_a_cell_file_of_another_version(run: Run, make: Maker) -> None:
    path = make.write(cell_text=CELL.read_text().replace("period_ms", "period_minutes"))
    shown = run("review", path)
    assert (shown.code, len(shown.err.splitlines())) == (1, 1)
    assert "the cell file in" in shown.err


@pytest.mark.parametrize("command", ["review", "why", "replay"])
def test_a_log_without_ticks(run: Run, make: Maker, command: str) -> None:
    shown = run(command, make.write(span=slice(0, 0)))
    assert shown.err == ""
    assert shown.code == (1 if command == "review" else 0)
    assert "the log has no tick" in shown.out


def test_a_log_without_anything(run: Run, make: Maker) -> None:
    """Closed as soon as it was opened: there is no chunk."""
    shown = run("review", make.write(span=slice(0, 0), story=False))
    assert "NOT GOOD: the log has no tick" in shown.out
    assert shown.err == ""


def test_logs_of_two_cells(run: Run, make: Maker) -> None:
    other = make.write(cell_text=CELL.read_text().replace('name = "eod"', 'name = "another"'))
    shown = run("review", make.write(), other)
    assert shown.code == 1
    assert "is of cell 'another' and" in shown.err
    assert "give the files of one cell at a time" in shown.err


@pytest.mark.parametrize("form", ["--csv", "--parquet"])
def test_an_export_that_fails_leaves_nothing(run: Run, good_log: Path, make: Maker, tmp_path: Path, form: str) -> None:
    if form == "--parquet":
        pytest.importorskip("pyarrow")
    out, other = tmp_path / "table", make.write(cell_text=CELL.read_text().replace('name = "eod"', 'name = "another"'))
    assert "give the files of one cell" in run("export", good_log, other, form, "-o", out).err
    assert not list(tmp_path.glob("table*"))


def test_one_log_twice(run: Run, good_log: Path) -> None:
    assert run("review", good_log, good_log).err == "one log is given twice\n"


def test_magic_alone(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "magic.mcap"
    path.write_bytes(MAGIC)
    assert "holds nothing that can be read" in run("review", path).err


def test_results_that_cannot_be_written(run: Run, good_log: Path, tmp_path: Path) -> None:
    taken = tmp_path / "taken.mcap"
    shutil.copy(good_log, taken)
    assert "exists already" in run("recover", good_log, "-o", taken).err
    assert "exists already" in run("export", good_log, "--csv", "-o", taken).err
    nowhere = tmp_path / "no" / "such" / "folder"
    assert "cannot be written" in run("recover", good_log, "-o", nowhere).err
    assert "cannot be written" in run("export", good_log, "--csv", "-o", nowhere).err
    assert "cannot be written" in run("review", good_log, "--html", nowhere).err


def test_export_needs_a_format(run: Run, good_log: Path) -> None:
    assert run("export", good_log).code == 2
    assert run("export", good_log, "--csv", "--parquet").code == 2


def test_without_the_extra(run: Run, good_log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from axisync_cli import review_commands

    found = review_commands.find_spec
    monkeypatch.setattr(review_commands, "find_spec", lambda name: None if name == "mcap" else found(name))
    shown = run("review", good_log)
    assert (shown.code, shown.out) == (1, "")
    assert shown.err.startswith("reading logs needs mcap, which is not installed: install the extra `review`")


def test_frames_of_a_container_are_not_read_beyond_its_size(tmp_path: Path) -> None:
    """A damaged length must not make anybody allocate what it says."""
    path = tmp_path / "huge.mcap"
    path.write_bytes(MAGIC + io.BytesIO(b"\x06" + (2**62).to_bytes(8, "little")).read() + b"abc")
    with pytest.raises(LogUnreadable):
        gather([path])
