"""One service and one dashboard for all tests of this folder; a fresh browser page for each."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from axisync_client import Client
from axisync_schemas.cell import override
from support.cells import eod_text
from support.daemon import PATIENT, Daemon, running, wait_for

pytest.importorskip("playwright", reason="playwright is not installed")
pytest.importorskip("nicegui", reason="NiceGUI is not installed")

from playwright.sync_api import Browser, expect, sync_playwright

from support.browser import ARGUMENTS, CHROMIUM, PATIENCE_MS, Dashboard, Screen

PERIOD_MS = 10.0
"""Slower than the robot's: the browser needs the processor as well."""

TIMEOUT_S = 600
"""The first test also waits for the service and the browser to start, on a machine that may be busy."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Everything here needs the browser."""
    missing = pytest.mark.skip(reason=f"there is no {CHROMIUM} (Debian: apt install chromium)")
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.web)
            item.add_marker(pytest.mark.timeout(TIMEOUT_S))
            if not CHROMIUM.exists():
                item.add_marker(missing)


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    """The demo without its program, with sockets that take faults."""
    directory = tmp_path_factory.mktemp("web")
    (directory / "control").mkdir()
    cell = override(eod_text(), {**PATIENT, "period_ms": PERIOD_MS})
    with running(directory, cell, ("--control", str(directory / "control"))) as daemon:
        yield daemon


@pytest.fixture(scope="session")
def dashboard(service: Daemon) -> Iterator[Dashboard]:
    """The web server beside it."""
    with Dashboard(service.directory, service.endpoint).running() as served:
        yield served
        assert served.end() == 0, served.output
        assert "Traceback" not in served.output, served.output


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Chromium without a window."""
    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS), timeout=90_000)
        yield chromium
        chromium.close()


@pytest.fixture
def client(service: Daemon) -> Iterator[Client]:
    """Somebody else who looks at the daemon."""
    with Client(service.endpoint, timeout_s=PATIENCE_MS / 1e3) as other:
        yield other


@pytest.fixture(autouse=True)
def _as_at_the_beginning(service: Daemon) -> None:
    """Nothing moves, no fault, full speed, and nobody in control, whatever the test before left."""
    if service.process is None or service.process.poll() is not None:
        service.kill()
        service.start()
    with Client(service.endpoint, timeout_s=PATIENCE_MS / 1e3) as client, client.lease("all", take=True) as everything:
        client.stop()
        wait_for(lambda: states(client) <= {"standstill", "disabled", "fault"}, "it stands", PATIENCE_MS / 1e3)
        if "fault" in states(client):
            everything.reset()
        everything.override(1.0)


def states(client: Client) -> set[str]:
    """Of all groups."""
    return {group.state for group in client.state().groups.values()}


@pytest.fixture
def new_screen(browser: Browser, dashboard: Dashboard) -> Iterator[Callable[[], Screen]]:
    """Opens the page as one more viewer. Its errors fail the test."""
    contexts, errors = [], []

    def opened() -> Screen:
        context = browser.new_context(viewport={"width": 1280, "height": 1000})
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("request", lambda request: errors.append(request.url) if _elsewhere(request.url) else None)
        return Screen(page).open(dashboard.url)

    yield opened
    for context in contexts:
        context.close()
    assert errors == []


def _elsewhere(url: str) -> bool:
    """Whatever the page needs must come from the dashboard: it works without internet."""
    return not url.startswith(("http://127.0.0.1:", "ws://127.0.0.1:", "data:", "blob:"))


@pytest.fixture
def screen(new_screen: Callable[[], Screen]) -> Screen:
    """The page."""
    return new_screen()
