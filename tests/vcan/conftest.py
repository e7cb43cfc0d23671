"""Runs the tests marked `vcan` where there is a vcan: all of them in one boot of user-mode Linux, else on this kernel.

They are ordinary tests. Out here each shows the reports of its run in there, so a failure looks as any other does.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest

REPOSITORY = Path(__file__).parents[2]
RUNNER = REPOSITORY / "deploy" / "uml" / "run.py"
REPORTS = "AXISYNC_VCAN_REPORTS"
"""Set inside: where to write the reports, one JSON object a line."""
BOOT_S = 60.0
DEFAULT_TIMEOUT_S = 120.0


def pytest_configure(config: pytest.Config) -> None:
    if REPORTS in os.environ:
        config.pluginmanager.register(ReportWriter(config, Path(os.environ[REPORTS])), "vcan-report-writer")
    elif Path("/usr/bin/linux.uml").exists():
        config.pluginmanager.register(UserModeLinux(config), "vcan-user-mode-linux")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    if REPORTS in os.environ or Path("/usr/bin/linux.uml").exists():
        return
    if all(Path(f"/sys/class/net/{name}").exists() for name in ("vcan0", "vcan1")):
        return
    reason = "neither user-mode Linux (Debian: apt install user-mode-linux kmod iproute2) nor vcan0 and vcan1 here"
    for item in items:
        if item.get_closest_marker("vcan"):
            item.add_marker(pytest.mark.skip(reason=reason))


class ReportWriter:
    """Inside: hands each report out, at once, so that those before a crash are known."""

    def __init__(self, config: pytest.Config, path: Path) -> None:
        self._config = config
        self._path = path

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        data = self._config.hook.pytest_report_to_serializable(config=self._config, report=report)
        with self._path.open("a") as file:
            file.write(json.dumps(data) + "\n")
            file.flush()
            os.fsync(file.fileno())


class UserModeLinux:
    """Outside: runs all selected vcan tests in one boot, when the first is due, and reports each in its turn."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._items: list[pytest.Item] = []

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self._items = [item for item in session.items if item.get_closest_marker("vcan")]
        self._limit_s = BOOT_S + sum(_timeout(item) for item in self._items)
        for item in self._items:
            item.add_marker(pytest.mark.timeout(0))  # the boot and all tests fall into the first one's time

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> bool | None:
        if item not in self._items:
            return None
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        for report in self._reports_of(item):
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    def _reports_of(self, item: pytest.Item) -> Iterator[pytest.TestReport]:
        reports, console = self._run
        found = reports.get(item.nodeid, [])
        yield from found
        if not any(report.when == "teardown" for report in found):
            longrepr = f"not finished under user-mode Linux, which said:\n{console[-8000:]}"
            yield pytest.TestReport(item.nodeid, item.location, {}, "failed", longrepr, "call")

    @cached_property
    def _run(self) -> tuple[dict[str, list[pytest.TestReport]], str]:
        path = self._config._tmp_path_factory.mktemp("vcan") / "reports.jsonl"  # type: ignore[attr-defined]
        command = [sys.executable, str(RUNNER), "--timeout", str(self._limit_s), "--", sys.executable, "-m", "pytest"]
        options = ["-v", "--no-header", "--color=no", "-p", "no:cacheprovider", f"--rootdir={self._config.rootpath}"]
        done = subprocess.run(
            [*command, *options, *(item.nodeid for item in self._items)],
            cwd=self._config.rootpath,
            env={**os.environ, REPORTS: str(path)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            check=False,
        )
        reports: dict[str, list[pytest.TestReport]] = {}
        for line in path.read_text().splitlines() if path.exists() else ():
            report = _report(self._config, json.loads(line))
            reports.setdefault(report.nodeid, []).append(report)
        return reports, done.stdout


def _report(config: pytest.Config, data: dict[str, Any]) -> pytest.TestReport:
    report = config.hook.pytest_report_from_serializable(config=config, data=data)
    assert isinstance(report, pytest.TestReport)
    if isinstance(report.longrepr, list):  # (path, line, reason) of a skip, which JSON turned into a list
        path, line, reason = report.longrepr
        report.longrepr = (str(path), int(line), str(reason))
    return report


def _timeout(item: pytest.Item) -> float:
    marker = item.get_closest_marker("timeout")
    return float(marker.args[0]) if marker and marker.args else DEFAULT_TIMEOUT_S
