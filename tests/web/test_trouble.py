"""Faults, and a daemon that is gone and comes back. The last of this folder: the daemon is killed here."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import Browser, expect

from axisync_emulator.faults.control import ask
from support.browser import Dashboard, Screen
from support.daemon import Daemon, free_port

FAULT = {"kind": "emergency", "bus": "kingkong", "node": 2, "code": 0x2310}
"""Over-current, as a drive reports it: a fault that a reset ends."""

GREY = """() => {
  window.greyMs = 0;
  new MutationObserver(() => { if (document.body.classList.contains("stale")) window.greyMs ||= Date.now(); })
    .observe(document.body, { attributes: true, attributeFilter: ["class"] });
}"""


def test_a_fault_is_shown_and_reset(screen: Screen, service: Daemon) -> None:
    screen.control("kingkong")
    ask(service.directory / "control" / "kingkong.sock", {"inject": FAULT})
    expect(screen.state("kingkong")).to_have_text("fault")
    expect(screen.live("a1.fault")).not_to_be_empty()
    screen.press("Reset")
    expect(screen.state("kingkong")).to_have_text("disabled")
    screen.enable("kingkong")


def test_a_dead_daemon_is_said_within_a_moment_and_a_new_one_is_found(
    screen: Screen, service: Daemon, dashboard: Dashboard
) -> None:
    screen.page.evaluate(GREY)
    killed_ms = 1e3 * time.time()
    os.kill(service.pid("front"), signal.SIGKILL)
    service.kill()
    screen.page.wait_for_function("() => window.greyMs > 0")
    delay_ms = screen.page.evaluate("() => window.greyMs") - killed_ms
    assert 300 < delay_ms < 5000  # 0.45 s on a quiet machine; this one may be busy
    expect(screen.page.locator("#banner")).not_to_be_empty()
    screen.page.keyboard.press("Space")
    expect(screen.page.locator("#stop-note")).to_contain_text("NOT STOPPED")
    expect(screen.button("Plan")).to_be_disabled()
    service.start()
    screen.is_fresh()
    expect(screen.page.locator("#banner")).to_be_empty()
    screen.control("wukong")
    assert dashboard.process.poll() is None


def test_a_port_that_is_taken_is_said_in_a_sentence(dashboard: Dashboard) -> None:
    command = [sys.executable, "-m", "axisync_dashboard", "--port", str(dashboard.port)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "choose another --port" in done.stderr


def test_a_dashboard_without_a_daemon_says_so_and_ends_cleanly(browser: Browser, tmp_path: Path) -> None:
    with Dashboard(tmp_path, f"127.0.0.1:{free_port()}").running() as lonely:
        page = browser.new_page()
        page.goto(lonely.url)
        expect(page.locator("#banner")).to_contain_text("nobody listens", ignore_case=True)
        expect(page.locator("#stop")).to_be_visible()
        assert lonely.end(signal.SIGINT) == 0  # with a page open
        expect(page.locator("#banner")).to_contain_text("server")
        page.close()
