"""The dashboard in a real browser: Debian's Chromium, driven by Playwright, as a person would use it."""

import contextlib
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from playwright.sync_api import Locator, Page, expect

from support.daemon import free_port, wait_for

CHROMIUM = Path("/usr/bin/chromium")
ARGUMENTS = (
    "--no-sandbox", "--disable-gpu", "--use-gl=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run",
)  # fmt: skip
PATIENCE_MS = 30_000
"""For what takes well below a second on a quiet machine."""
HOLDING = "found => found.some(button => button.classList.contains('holding'))"
"""Of these buttons one is filling up."""


class Dashboard:
    """One run of `axisync-dashboard`."""

    def __init__(self, directory: Path, endpoint: str) -> None:
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}/"
        self._output = directory / "dashboard.txt"
        # NiceGUI takes this variable for a sign that its own tests run.
        environment = {key: value for key, value in os.environ.items() if key != "PYTEST_CURRENT_TEST"}
        environment["NICEGUI_STORAGE_PATH"] = str(directory / "nicegui")
        command = [sys.executable, "-m", "axisync_dashboard", "--endpoint", endpoint, "--port", str(self.port)]
        with self._output.open("wb") as output:
            self.process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, env=environment
            )

    @property
    def output(self) -> str:
        """What it printed so far."""
        return self._output.read_text(encoding="utf-8", errors="replace")

    def end(self, number: int = signal.SIGINT, seconds: float = 20.0) -> int:
        """Ends it as a person would; its exit code."""
        self.process.send_signal(number)
        try:
            return self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise AssertionError(f"the dashboard did not end\n{self.output}") from None

    @contextlib.contextmanager
    def running(self) -> Iterator["Dashboard"]:
        """Nothing of it is left after the block."""
        try:
            wait_for(lambda: "dashboard: " in self.output or self.process.poll() is not None, "the dashboard", 60.0)
            assert self.process.poll() is None, self.output
            yield self
        finally:
            if self.process.poll() is None:
                self.process.kill()
                self.process.wait()


class Screen:
    """The page as a person sees it."""

    def __init__(self, page: Page) -> None:
        self.page = page

    def open(self, url: str) -> "Screen":
        """Loads the page, and waits until it shows what is so."""
        self.page.goto(url)
        expect(self.page.locator("body")).not_to_have_class(re.compile(r"\bstale\b"))
        expect(self.state("kingkong")).not_to_be_empty()
        return self

    def live(self, key: str) -> Locator:
        """A text that is kept up to date, by its key."""
        return self.page.locator(f'[data-live="{key}"]').first

    def state(self, group: str) -> Locator:
        """The state of a group."""
        return self.live(f"g.{group}.state")

    def button(self, name: str) -> Locator:
        """A button by what is written on it."""
        return self.page.get_by_role("button", name=name, exact=True).locator("visible=true")

    def choose(self, group: str) -> None:
        """Controls are about this group from now on."""
        self.page.locator(".groups").get_by_text(group, exact=True).click()

    def press(self, name: str) -> None:
        """Presses a button until it has filled up."""
        button = self.button(name)
        expect(button).to_be_enabled()
        button.hover()
        self.page.mouse.down()
        wait_for(lambda: not button.evaluate_all(HOLDING), f"{name} is full", PATIENCE_MS / 1e3)  # or gone
        self.page.mouse.up()

    def tap(self, name: str) -> None:
        """Touches it and lets go at once, as by accident."""
        expect(self.button(name)).to_be_enabled()
        self.button(name).click()

    def control(self, group: str) -> None:
        """Takes the lease and switches the drives on."""
        self.choose(group)
        self.button("Take control").click()
        expect(self.page.locator(".holder")).to_have_text("You are in control")
        self.enable(group)

    def enable(self, group: str) -> None:
        """Until the group stands, enabled; a machine that was too busy may have made the drives give up."""
        expect(self.state(group)).to_have_text(re.compile("disabled|standstill|fault"))
        if self.state(group).text_content() == "fault":
            self.press("Reset")
            expect(self.state(group)).to_have_text("disabled")
        if self.state(group).text_content() == "disabled":
            self.press("Enable")
        expect(self.state(group)).to_have_text("standstill")

    def joint(self, axis: str, degrees: float) -> None:
        """Fills in a target."""
        self.page.get_by_label(axis, exact=True).fill(f"{degrees:g}")

    def speed(self, percent: float) -> None:
        """Fills in the speed of the joint move."""
        self.page.get_by_label("Speed").first.fill(f"{percent:g}")

    def plan(self) -> Locator:
        """Plans; what is said about it."""
        self.button("Plan").click()
        shown = self.page.locator(".preview:not(:empty)").locator("visible=true")
        expect(shown).to_be_visible()
        return shown

    def position(self, axis: int) -> float:
        """Where an axis is, degrees, as the table of drives shows it."""
        return float(self.live(f"a{axis}.position").text_content() or "nan")

    def tool(self, group: str) -> list[float]:
        """Where the 3D view draws the tool, m in O."""
        place = self.page.evaluate("group => document.querySelector('.arms-view').view.toolPosition(group)", group)
        return [float(value) for value in place]
