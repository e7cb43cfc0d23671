"""What the dashboard costs, and what it costs the cycle (`--only dashboard`); how long its STOP takes (`browser`)."""

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from crowd import Crowd
from phases import Arms, Call
from playwright.sync_api import Error, expect, sync_playwright
from processes import Sampler
from report import Report

from support.browser import ARGUMENTS, CHROMIUM, Dashboard, Screen

VIEWERS = (0, 1, 10)
FRAMES_HZ = 20
DRAW_SELDOM = "window.requestAnimationFrame = draw => setTimeout(() => draw(performance.now()), 500)"
"""Without a graphics card the 3D view takes more than the processors have left beside a cell; STOP does not need it."""
NOTE_KEYS = "addEventListener('keydown', key => window.keyAt = performance.timeOrigin + key.timeStamp, true)"
"""When the browser saw a key go down, ms of its wall clock."""


@dataclass(slots=True)
class Seen:
    """What was measured while the service ran.

    Attributes:
        spans_ns: begin and end of moving beside so many viewers; cpu: the dashboard's share of a core meanwhile.
        presses: stops by a browser's space bar, from when the key went down.
    """

    spans_ns: dict[int, tuple[int, int]] = field(default_factory=dict)
    cpu: dict[int, float] = field(default_factory=dict)
    presses: list[Call] = field(default_factory=list)


def measure(report: Report, directory: Path, endpoint: str, arms: Arms, seconds: float, presses: int) -> Seen:
    """Moves beside viewers for so long, 0: not at all; then stops so many moves from a browser.

    Raises:
        RuntimeError: the browser does not keep up.
    """
    seen = Seen()
    directory.mkdir()
    with Dashboard(directory, endpoint).running() as dashboard:
        for count in VIEWERS if seconds else ():
            report.say(f"moving with {count} viewers of the dashboard")
            with Crowd("pages", dashboard.url, count):
                sampler = Sampler(dashboard.process.pid)
                seen.spans_ns[count] = arms.swing(seconds / len(VIEWERS), lambda: None)
                seen.cpu[count] = sum(usage.cpu for usage in sampler.usage())
        if presses and not CHROMIUM.exists():
            report.say(f"no stops from a browser: there is no {CHROMIUM}")
        elif presses:
            report.say(f"stopping {presses} moves by the space bar of a browser")
            try:
                with _screen(dashboard.url) as screen:
                    seen.presses = arms.stops(presses, lambda: _press(screen))
            except (Error, AssertionError) as error:
                raise RuntimeError(f"the browser does not keep up: {str(error).splitlines()[0]}") from None
    return seen


def _press(screen: Screen) -> int:
    """Until the page says that the stop was taken; so none of its own repetitions hits the move that follows.

    Returns when the browser saw the key, monotonic ns: what tells it to press one takes its time too.
    """
    screen.page.keyboard.press("Space")
    expect(screen.page.locator("#stop-note")).to_contain_text("Stop taken")
    pressed_ms: float = screen.page.evaluate("keyAt")
    return time.monotonic_ns() - (time.time_ns() - round(pressed_ms * 1e6))


@contextlib.contextmanager
def _screen(url: str) -> Iterator[Screen]:
    """The page in a browser of its own, which draws twice a second."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS), timeout=90_000)
        page = browser.new_page(viewport={"width": 1280, "height": 1000})
        page.add_init_script(f"{DRAW_SELDOM}; {NOTE_KEYS}")
        yield Screen(page).open(url)
        browser.close()


def say(report: Report, axes: int, seen: Seen) -> None:
    """The table of its CPU; lateness and stops are read from the log."""
    title = f"CPU of the dashboard at {FRAMES_HZ} Hz, {axes} axes moving"
    lines = [[str(count), f"{100 * cpu:.1f} %"] for count, cpu in seen.cpu.items()]
    report.table("dashboard", title, ["viewers", "of one core"], lines)
