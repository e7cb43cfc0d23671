"""How late the cycle's own clock wakes here, without drives: as a process of its own, as the controller is.

`python -m axisync_service.doctor.latency PERIOD_NS WORST_WIRE_NS SECONDS` prints one line of JSON.
"""

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass

from axisync_service.motion_controller import realtime
from axisync_service.motion_controller.clock import GridClock, MonotonicTime, TimeSource

PERIOD_NS, WORST_WIRE_NS, SKIPPED_MAX = 2_000_000, 1_445_000, 5
"""Of the demo's cell."""
SPARE_S = 30.0


class LatencyError(RuntimeError):
    """The loop could not be run; one sentence."""


@dataclass(frozen=True, slots=True)
class Latency:
    """Lateness of ticks, us. `skipped_max`: how many in a row the cell tolerates."""

    period_us: float
    ticks: int
    p50_us: float
    p99_us: float
    max_us: float
    skipped: int
    most_skipped: int
    realtime: bool
    skipped_max: int = SKIPPED_MAX


def measure(
    seconds: float, period_ns: int = PERIOD_NS, worst_wire_ns: int = WORST_WIRE_NS, skipped_max: int = SKIPPED_MAX
) -> Latency:
    """Runs the loop in a process of its own.

    Raises:
        LatencyError: it failed.
    """
    command = [sys.executable, "-m", __name__, str(period_ns), str(worst_wire_ns), str(seconds)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=seconds + SPARE_S, check=True)
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
        said = (error.stderr or "").strip()[-300:] if isinstance(error.stderr, str) else ""
        raise LatencyError(f"the latency test failed: {said or error}") from None
    return Latency(**json.loads(done.stdout), skipped_max=skipped_max)


def loop(clock: GridClock, ticks: int, realtime_now: bool) -> Latency:
    """So many ticks of the grid, those that are skipped included."""
    clock.start()
    late: list[int] = []
    skipped = most = 0
    while len(late) + skipped < ticks:
        tick = clock.wait()
        late.append(tick.lateness_ns)
        skipped, most = skipped + tick.skipped, max(most, tick.skipped)
    ordered = sorted(late)
    at: Callable[[float], float] = lambda share: ordered[int(share * (len(ordered) - 1))] / 1e3  # noqa: E731
    longest = max(ordered[-1], most * clock.period_ns) / 1e3
    return Latency(clock.period_ns / 1e3, ticks, at(0.5), at(0.99), longest, skipped, most, realtime_now)


def main(period_ns: int, worst_wire_ns: int, seconds: float, source: TimeSource | None = None) -> None:
    """In the process of its own."""
    missing = realtime.enter()
    clock = GridClock(source or MonotonicTime(), period_ns, worst_wire_ns)
    found = asdict(loop(clock, max(1, round(seconds * 1e9 / period_ns)), missing is None))
    del found["skipped_max"]
    print(json.dumps(found))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]))
