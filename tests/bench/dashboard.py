"""What the dashboard costs, what it costs the cycle, and how long its STOP takes: `--only dashboard`."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from crowd import Crowd
from phases import Arms, Call
from processes import Sampler
from report import Report

from support.browser import ARGUMENTS, CHROMIUM, Dashboard, Screen

VIEWERS = (0, 1, 10)
FRAMES_HZ = 20


@dataclass(slots=True)
class Seen:
    """What was measured while the service ran.

    Attributes:
        spans_ns: begin and end of moving beside so many viewers; cpu: the dashboard's share of a core meanwhile.
        presses: stops by a browser's space bar, from before the key went down.
    """

    spans_ns: dict[int, tuple[int, int]] = field(default_factory=dict)
    cpu: dict[int, float] = field(default_factory=dict)
    presses: list[Call] = field(default_factory=list)


def measure(report: Report, directory: Path, endpoint: str, arms: Arms, seconds: float, presses: int) -> Seen:
    """Moves beside viewers, then stops moves from a browser."""
    seen = Seen()
    directory.mkdir()
    with Dashboard(directory, endpoint).running() as dashboard:
        for count in VIEWERS:
            report.say(f"moving with {count} viewers of the dashboard")
            with Crowd("pages", dashboard.url, count):
                sampler = Sampler(dashboard.process.pid)
                seen.spans_ns[count] = arms.swing(seconds / len(VIEWERS), lambda: None)
                seen.cpu[count] = sum(usage.cpu for usage in sampler.usage())
        if not CHROMIUM.exists():
            report.say(f"no stops from a browser: there is no {CHROMIUM}")
            return seen
        report.say(f"stopping {presses} moves by the space bar of a browser")
        with _screen(dashboard.url) as screen:
            seen.presses = arms.stops(presses, lambda: screen.page.keyboard.press("Space"))
    return seen


@contextlib.contextmanager
def _screen(url: str) -> Iterator[Screen]:
    """The page in a browser of its own."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS), timeout=90_000)
        yield Screen(browser.new_page(viewport={"width": 1280, "height": 1000})).open(url)
        browser.close()


def say(report: Report, axes: int, seen: Seen) -> None:
    """The table of its CPU; lateness and stops are read from the log."""
    title = f"CPU of the dashboard at {FRAMES_HZ} Hz, {axes} axes moving"
    lines = [[str(count), f"{100 * cpu:.1f} %"] for count, cpu in seen.cpu.items()]
    report.table("dashboard", title, ["viewers", "of one core"], lines)
