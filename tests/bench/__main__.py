"""How well this machine runs axisync: `make bench`, or `python tests/bench [--seconds S] [--only NAME]...`.

Starts the demo without its dashboard and, as a client, swings both arms, starts moves and stops moves. Lateness and
setpoints are read from the log, times by stage from the controller's shared memory. The planner is measured without a
service, beside the Ruckig library, and so are poses, paths and moves of arms, beside TOPP-RA and coal. Drives are
measured in lock-step, in the bus's own time, the recorder on ticks that the bench itself makes.
"""

import argparse
import json
import signal
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(1, str(Path(__file__).parents[1]))  # for tests/support

import machine
from daemon import DaemonError
from report import Report
from stress import LOADS

from axisync_client import AxisyncError
from bench import BENCHES, UNASKED, Bench


def main(arguments: Sequence[str] | None = None) -> int:
    options = _options(arguments)
    signal.signal(signal.SIGTERM, lambda number, _frame: sys.exit(128 + number))  # so that the service is ended, too
    report = Report()
    here = machine.describe()
    report.data["machine"] = here.as_json()
    report.say(here.sentence())
    try:
        with tempfile.TemporaryDirectory(prefix="axisync-bench-") as directory:
            wanted = frozenset(options.only or UNASKED)
            bench = Bench(report, wanted, options.seconds, options.moves, options.figure, options.stress)
            bench.run(Path(directory))
    except (DaemonError, AxisyncError, RuntimeError, LookupError, ValueError) as error:
        print(f"bench: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    if options.json:
        options.json.write_text(json.dumps(report.data, indent=2) + "\n")
    return 0


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="bench", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=_seconds, default=60.0, help="how long the arms swing, by default 60")
    parser.add_argument(
        "--moves", type=_count, default=100, help="moves started and moves stopped, by default 100 each"
    )
    parser.add_argument("--only", action="append", choices=BENCHES, help="may be given several times")
    parser.add_argument("--stress", choices=LOADS, help="load the machine by stress-ng while the service runs")
    parser.add_argument("--figure", type=Path, metavar="FILE", help="draw what a step costs, as SVG (scale)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the numbers there")
    return parser.parse_args(arguments)


def _seconds(text: str) -> float:
    seconds = float(text)
    if not 1.0 <= seconds <= 86400.0:
        raise argparse.ArgumentTypeError("must be 1 to 86,400")
    return seconds


def _count(text: str) -> int:
    count = int(text)
    if not 1 <= count <= 100_000:
        raise argparse.ArgumentTypeError("must be 1 to 100,000")
    return count


if __name__ == "__main__":
    sys.exit(main())
