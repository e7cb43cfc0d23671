"""A log that was cut becomes one that strict readers take, with everything that was whole."""

import random
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import SeekingReader
from mcap.records import Statistics

from axisync_review.recover import Recovery, recover
from support.command_line import Run
from support.logread import read_log


def statistics(path: Path) -> Statistics:
    """As a strict reader finds them; every checksum is verified, every message reached by the indexes."""
    with path.open("rb") as stream:
        reader = SeekingReader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        times = [message.log_time for _, _, message in reader.iter_messages()]
        assert len(times) == summary.statistics.message_count
        assert times == sorted(times)
        assert sum(1 for _ in reader.iter_attachments()) == summary.statistics.attachment_count
        assert sum(1 for _ in reader.iter_metadata()) == summary.statistics.metadata_count
        middle = times[len(times) // 2]
        assert next(reader.iter_messages(starting_at=middle))[2].log_time >= middle
        return summary.statistics


def test_a_whole_log_stays_the_same(good_log: Path, tmp_path: Path) -> None:
    out = tmp_path / "again.mcap"
    found = recover(good_log, out)
    assert (found.was_whole, found.lost, found.lost_bytes) == (True, (), 0)
    assert statistics(out) == statistics(good_log)
    assert (read_log(out).ticks == read_log(good_log).ticks).all()


@pytest.mark.parametrize("seed", range(8))
def test_a_log_cut_anywhere(good_log: Path, tmp_path: Path, seed: int) -> None:
    data, cut, out = good_log.read_bytes(), tmp_path / "cut.mcap", tmp_path / "whole.mcap"
    cut.write_bytes(data[: random.Random(seed).randrange(len(data) // 4, len(data) - 30_000)])
    found, readable = recover(cut, out), read_log(cut)
    assert statistics(out).message_count == found.messages
    assert found.ticks == len(readable.ticks) > 100
    assert found.last_tick == readable.ticks["tick"][-1]
    assert (read_log(out).ticks == readable.ticks).all()
    assert read_log(out).complete
    assert found.lost_bytes > 0
    assert found.lost[0].startswith("the last ")


def test_a_damaged_chunk_is_left_out(good_log: Path, tmp_path: Path) -> None:
    data, damaged, out = bytearray(good_log.read_bytes()), tmp_path / "damaged.mcap", tmp_path / "whole.mcap"
    data[data.find(b"\x28\xb5\x2f\xfd", len(data) // 2) + 40] ^= 0xFF
    damaged.write_bytes(data)
    found = recover(damaged, out)
    assert not found.was_whole
    assert len(found.lost) == 1
    steps = np.diff(read_log(out).ticks["tick"].astype(np.int64))
    assert sorted(set(steps.tolist()))[0] == 1
    assert (steps > 1).sum() == 1
    statistics(out)


def test_nothing_is_left_where_it_fails(tmp_path: Path, good_log: Path, run: Run) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(good_log.read_bytes()[:400])
    shown = run("recover", cut)
    assert shown.code == 1
    assert "nothing can be recovered" in shown.err
    assert list(tmp_path.iterdir()) == [cut]


def test_the_command(run: Run, good_log: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(good_log.read_bytes()[:-200_000])
    shown = run("recover", cut)
    assert (shown.code, shown.err) == (0, "")
    assert f"{tmp_path / 'cut_recovered.mcap'}: " in shown.out
    assert "lost: the last " in shown.out
    printed = run("recover", good_log, "-o", tmp_path / "b.mcap", "--json")
    assert Recovery.model_validate_json(printed.out).was_whole
    assert run("review", tmp_path / "b.mcap").code == 0
