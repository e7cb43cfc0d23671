"""The doctor's facts, what they mean, and its exit code."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from axisync_service import main
from axisync_service.doctor.facts import CanInterface, Facts, can_interfaces, deepest_sleep_us, gather, preemption
from axisync_service.doctor.findings import Level, dangerous, findings
from axisync_service.doctor.latency import Latency, loop
from axisync_service.motion_controller.clock import GridClock

GOOD = Facts(
    kernel="6.1.0-rt", preemption="PREEMPT_RT", cpus=4, may_fifo=True, rtprio=80, memlock=-1, privileged=False,
    rt_share=0.95, governors=("performance",), sleep_us=300, may_keep_awake=True, isolated="3", clock_source="tsc",
    load=0.5, virtual=False, can=(CanInterface("can0", True, True, 128, True),),
)  # fmt: skip
ON_TIME = Latency(2000.0, 5000, 5.0, 30.0, 200.0, 0, 0, True)


def test_a_good_machine() -> None:
    found = findings(GOOD, ON_TIME)
    assert {finding.level for finding in found} == {Level.OK}
    assert not dangerous(found)


@pytest.mark.parametrize(
    ("change", "what", "level"),
    [
        ({"may_fifo": False, "rtprio": 0}, "real-time priority", Level.DANGER),
        ({"memlock": 8 << 20}, "locked memory", Level.DANGER),
        ({"memlock": 8 << 20, "privileged": True}, "locked memory", Level.OK),
        ({"rt_share": 0.5}, "throttling", Level.DANGER),
        ({"preemption": "PREEMPT_DYNAMIC"}, "kernel", Level.ADVICE),
        ({"preemption": ""}, "kernel", Level.DANGER),
        ({"clock_source": "hpet"}, "clock source", Level.DANGER),
        ({"governors": ("performance", "powersave")}, "CPU governor", Level.ADVICE),
        ({"may_keep_awake": False}, "CPU sleep", Level.ADVICE),
        ({"may_keep_awake": False, "sleep_us": 2}, "CPU sleep", Level.OK),
        ({"isolated": ""}, "CPU isolation", Level.ADVICE),
        ({"load": 9.0}, "CPUs", Level.ADVICE),
        ({"can": (CanInterface("can0", False, False, wanted=True),)}, "CAN can0", Level.DANGER),
        ({"can": (CanInterface("can0", True, False, 10),)}, "CAN can0", Level.ADVICE),
        ({"can": (CanInterface("can0", True, True, 10, True),)}, "CAN can0", Level.ADVICE),
    ],
)
def test_each_fact_counts(change: dict[str, Any], what: str, level: Level) -> None:
    found = findings(replace(GOOD, **change), ON_TIME)
    (finding,) = (finding for finding in found if finding.what == what)
    assert finding.level is level
    assert dangerous(found) == (level is Level.DANGER)
    assert finding.fix or level is Level.OK


@pytest.mark.parametrize(
    ("change", "level"),
    [
        ({}, Level.OK),
        ({"max_us": 1500.0}, Level.ADVICE),
        ({"p99_us": 201.0}, Level.DANGER),
        ({"skipped": 6, "most_skipped": 1}, Level.DANGER),
        ({"ticks": 500_000, "skipped": 6, "most_skipped": 6}, Level.DANGER),
    ],
)
def test_the_latency_test_has_a_verdict(change: dict[str, Any], level: Level) -> None:
    assert findings(GOOD, replace(ON_TIME, **change))[-1].level is level


def test_preemption_is_read_from_the_build_and_the_flag() -> None:
    assert preemption("#1 SMP PREEMPT_DYNAMIC @0", "") == "PREEMPT_DYNAMIC"
    assert preemption("#1 SMP PREEMPT @0", "1") == "PREEMPT_RT"
    assert preemption("#1 SMP", "") == ""


def test_the_deepest_sleep_is_that_of_the_states_in_use(tmp_path: Path) -> None:
    assert deepest_sleep_us(tmp_path) == 0
    for cpu, state, latency, disable in ((0, 0, 0, 0), (0, 1, 2, 0), (1, 2, 133, 0), (1, 3, 1034, 1)):
        place = tmp_path / f"cpu{cpu}" / "cpuidle" / f"state{state}"
        place.mkdir(parents=True)
        (place / "latency").write_text(f"{latency}\n")
        (place / "disable").write_text(f"{disable}\n")
    assert deepest_sleep_us(tmp_path) == 133


def test_can_interfaces_of_the_kernel_and_those_missing(tmp_path: Path) -> None:
    for name, kind, flags in (("vcan0", "280", "0x40081"), ("can1", "280", "0x40080"), ("eth0", "1", "0x1003")):
        (tmp_path / name).mkdir()
        for file, text in (("type", kind), ("flags", flags), ("tx_queue_len", "10")):
            (tmp_path / name / file).write_text(text + "\n")
    found = can_interfaces(["vcan0", "can7"], tmp_path)
    assert [(one.name, one.there, one.up, one.wanted) for one in found] == [
        ("can1", True, False, False), ("vcan0", True, True, True), ("can7", False, False, True),
    ]  # fmt: skip


class Late:
    """Wakes 50 us late, and once by two periods and a half: too late for a third."""

    def __init__(self) -> None:
        self.now, self.calls = 0, 0

    def now_ns(self) -> int:
        return self.now

    def wait_until_ns(self, instant_ns: int) -> None:
        self.calls += 1
        self.now = max(self.now, instant_ns + (5_000_000 if self.calls == 50 else 50_000))


def test_the_loop_counts_what_it_skipped() -> None:
    found = loop(GridClock(Late(), 2_000_000, 1_000_000), 100, True)
    assert (found.ticks, found.skipped, found.most_skipped) == (100, 3, 3)
    assert found.p50_us == 50.0
    assert found.max_us == 6000.0


def test_the_command(tmp_path: Path) -> None:
    """The real thing, for a moment; what comes of it depends on the machine, that it agrees with itself does not."""
    done = CliRunner().invoke(main.app, ["doctor", "--seconds", "0.2", "--json"])
    report = json.loads(done.output)
    assert report["latency"]["ticks"] == 100
    assert done.exit_code == (0 if report["fit"] else 1)
    assert report["facts"]["kernel"] == gather().kernel
    done = CliRunner().invoke(main.app, ["doctor", "--seconds", "0", "--cell", str(main.CELLS / "eod.toml")])
    assert "CAN vcan0" in done.output
    assert "verdict: " in done.output
