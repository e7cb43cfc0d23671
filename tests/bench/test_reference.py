"""The reference loops: what is read of cyclictest's output, and that each loop there is here gives sane numbers."""

import os
import shutil

import pytest
from reference import Reference, Scheduling, parse_cyclictest

OUTPUT = """# /dev/cpu_dma_latency set to 0us
# Histogram
000000 000000
000011 000007
000012 000002
# Total: 000000010
# Min Latencies: 00011
# Avg Latencies: 00017
# Max Latencies: 04711
# Histogram Overflows: 00001
# Histogram Overflow at cycle number:
# Thread 0: 00005
"""


def test_cyclictest_histogram_with_an_overflow() -> None:
    found = parse_cyclictest(OUTPUT)
    assert found.total == 10
    assert (found.percentile(50), found.percentile(90), found.maximum) == (11.0, 12.0, 4711.0)


def test_other_output_is_an_error() -> None:
    with pytest.raises(RuntimeError, match="no histogram"):
        parse_cyclictest("Unable to change scheduling policy!")


def ordinary() -> Scheduling:
    return Scheduling(os.SCHED_OTHER, 0, frozenset(os.sched_getaffinity(0)))


@pytest.mark.parametrize("missing", [(), ("cyclictest",), ("cyclictest", "cc", "gcc", "clang")])
def test_each_loop_measures_every_tick(missing: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    which = shutil.which
    monkeypatch.setattr("reference.shutil.which", lambda name: None if name in missing else which(name))
    found = Reference(0.002, 0.2, ordinary()).result()
    assert found.total == 100
    assert 0.0 <= found.percentile(50) < 1e6


def test_a_failing_loop_says_so() -> None:
    nobody_has = Scheduling(os.SCHED_OTHER, 0, frozenset({4095}))
    with pytest.raises((RuntimeError, OSError, ValueError)):
        Reference(0.002, 0.1, nobody_has).result()


def test_beside_a_pinned_process_the_other_cpus_are_used() -> None:
    cpus = frozenset(os.sched_getaffinity(0))
    one = frozenset({min(cpus)})
    assert Scheduling(os.SCHED_FIFO, 80, one).beside().cpus == ((cpus - one) or one)
    assert Scheduling(os.SCHED_FIFO, 80, cpus).beside().cpus == cpus
