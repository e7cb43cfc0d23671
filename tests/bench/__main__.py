"""How well this machine runs axisync: `make bench`, or `python tests/bench [--seconds S] [--only NAME]...`.

Starts the demo without its dashboard and, as a client, swings both arms, starts moves and stops moves. Lateness and setpoints
are read from the log, times by stage from the controller's shared memory.
"""

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import machine
from daemon import Daemon, DaemonError
from phases import Arms, Call, acquire
from processes import Sampler, find
from reference import Reference, Scheduling
from report import Report
from stages import StageReader

import log as logs
from axisync_client import AxisyncError, Client
from axisync_schemas.cell import Cell
from percentiles import Distribution

BENCHES = ("lateness", "stages", "requests", "stops", "processes")
GROUP = "both"
ALONE_S = 10.0


def main(arguments: Sequence[str] | None = None) -> int:
    options = _options(arguments)
    wanted = options.only or list(BENCHES)
    report = Report()
    here = machine.describe()
    report.data["machine"] = here.as_json()
    report.say(here.sentence())
    try:
        with tempfile.TemporaryDirectory(prefix="axisync-bench-") as directory:
            Bench(Path(directory), report, wanted, options).run()
    except (DaemonError, AxisyncError, RuntimeError, LookupError, ValueError) as error:
        print(f"bench: {error}", file=sys.stderr)
        return 1
    if options.json:
        options.json.write_text(json.dumps(report.data, indent=2) + "\n")
    return 0
