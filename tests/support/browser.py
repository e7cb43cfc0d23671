"""The dashboard in a real browser: Debian's Chromium, driven by Playwright, as a person would use it."""

import contextlib
import os
import re
import signal
import socket
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
RECORD = """
window.shown = [];
new MutationObserver((changes) => {
  for (const { target, addedNodes } of changes) {
    const key = target.dataset?.live ?? target.id;
    if (key === "stop-note" || key?.endsWith(".state"))
      for (const node of addedNodes) window.shown.push([key, node.textContent]);
  }
}).observe(document, { childList: true, subtree: true });
"""
"""Keeps the states and notes that the page shows: a question now and then would miss what is soon over."""
HAS_SHOWN = """([key, texts]) => {
  let next = 0;
  const isNext = ([of, text]) => of === key && text.includes(texts[next]);
  const end = window.shown.findIndex((one) => isNext(one) && ++next === texts.length);
  if (end < 0) return false;
  window.shown = window.shown.filter(([of], i) => i > end || of !== key);
  return true;
}"""
POLL_MS = 50
AWAIT_CONFIRMED = """(button) => {
  button.confirmed = false;
  button.addEventListener("confirmed", () => (button.confirmed = true), { once: true });
}"""
IS_HELD = "button => !button.confirmed && button.classList.contains('holding')"
PRESSES = 3
"""A page that changes under the mouse makes a person press again, too."""


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

    def _listens(self) -> bool:
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", self.port)) == 0

    @contextlib.contextmanager
    def running(self) -> Iterator["Dashboard"]:
        """Nothing of it is left after the block."""
        try:
            wait_for(lambda: self._listens() or self.process.poll() is not None, "the dashboard", 60.0)
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
        page.add_init_script(RECORD)

    def open(self, url: str) -> "Screen":
        """Loads the page, and waits until it shows what is so."""
        self.page.goto(url)
        self.is_fresh()
        return self

    def is_fresh(self) -> None:
        """Waits until what it shows is so."""
        expect(self.page.locator("body")).not_to_have_class(re.compile(r"\bstale\b"))
        expect(self.state("kingkong")).not_to_be_empty()

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

    def passes(self, group: str, *states: str) -> None:
        """Waits until it has shown these states of a group, one after the other, since it was last asked."""
        self.has_shown(f"g.{group}.state", *states)

    def has_shown(self, key: str, *texts: str) -> None:
        """Waits until a text that is kept had these in it, one after the other, since it was last asked."""
        self.page.wait_for_function(HAS_SHOWN, arg=[key, texts], polling=POLL_MS)

    def press(self, name: str) -> None:
        """Presses a button until it has filled up."""
        if not any(self._pressed(self.button(name)) for _ in range(PRESSES)):
            raise AssertionError(f"{name} was pressed {PRESSES} times, and never until it was full")

    def _pressed(self, button: Locator) -> bool:
        """Pressed once; whether it was full before it was let go, or moved away from under the mouse."""
        expect(button).to_be_enabled()
        element = button.element_handle()
        assert element is not None
        element.evaluate(AWAIT_CONFIRMED)
        button.hover()
        self.page.mouse.down()
        wait_for(lambda: not element.evaluate(IS_HELD), "the button is full", PATIENCE_MS / 1e3)
        self.page.mouse.up()
        return bool(element.evaluate("button => button.confirmed"))

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
        self.page.wait_for_function("() => document.querySelector('.arms-view')?.view")
        place = self.page.evaluate("group => document.querySelector('.arms-view').view.toolPosition(group)", group)
        return [float(value) for value in place]
