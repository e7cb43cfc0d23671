"""What a process asks for so as to be on time; scheduling and memory are tried by the doctor's own loop."""

import os
from pathlib import Path

from axisync_service.motion_controller.realtime import keep_awake


def test_cpus_stay_awake_as_long_as_the_process_lives(tmp_path: Path) -> None:
    device = tmp_path / "cpu_dma_latency"
    device.touch()
    assert keep_awake(device)
    assert device.read_bytes() == bytes(4)  # 0 us, in 32 bits
    links = Path("/proc/self/fd").iterdir()
    (kept,) = (int(link.name) for link in links if os.path.realpath(link) == str(device))
    os.close(kept)


def test_where_it_is_not_there_the_loop_runs_all_the_same(tmp_path: Path) -> None:
    assert not keep_awake(tmp_path / "none")
