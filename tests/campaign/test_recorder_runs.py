"""The recorder's process in long runs: killed at random moments, and ten minutes without a lost tick."""

import random
from pathlib import Path

import pytest

from axisync_schemas.memory import Word
from support.logread import logs_in, read_log
from support.recording import Recording

KILLS = 50
SECOND = 500  # ticks


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_killed_fifty_times(tmp_path: Path) -> None:
    rng = random.Random(4)
    newest: list[int] = []
    with Recording(tmp_path) as recording:
        for _ in range(KILLS):
            recording.start()
            newest.append(recording.feeder.run(recording.control[Word.CONTROLLER_TICK] + 1, rng.uniform(0.0, 2.0)))
            recording.kill()
            away = newest[-1] + rng.randrange(2 * SECOND)
            recording.feeder.write(newest[-1] + 1, away)
        recording.start()
        assert recording.close()[0] == 0
        last = recording.control[Word.CONTROLLER_TICK]
        files = logs_in(recording.log_dir)
        assert len(files) == KILLS + 1
        unwritten = []
        for path, tick in zip(files, newest, strict=False):
            ticks = read_log(path).ticks["tick"]
            if ticks.size:
                unwritten.append(tick - int(ticks[-1]))
        assert len(unwritten) > KILLS / 2
        assert max(unwritten) <= SECOND, unwritten
        log = read_log(*files)
        assert log.ticks["tick"].tolist() == list(range(1, last + 1))
        assert recording.control[Word.RECORDER_LOST] == 0


@pytest.mark.campaign
@pytest.mark.timeout(900)
def test_ten_minutes(tmp_path: Path) -> None:
    with Recording(tmp_path) as recording:
        recording.start()
        last = recording.feeder.run(1, 600.0)
        status, said = recording.close()
        assert status == 0
        assert recording.control[Word.RECORDER_LOST] == 0, said
        ticks = read_log(*logs_in(recording.log_dir)).ticks["tick"]
        assert ticks.size == last
        assert int(ticks[0]) == 1
        assert (ticks[1:] - ticks[:-1] == 1).all()
