"""Control, move, slow, hold, stop: everything by mouse and keys, judged by the daemon's own word."""

import re
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import expect

from axisync_client import Client
from support.browser import Screen
from support.daemon import wait_for


@pytest.fixture
def operator(screen: Screen) -> Screen:
    """In control of KingKong, which stands."""
    screen.control("kingkong")
    return screen


SLOW_PERCENT = 10
"""Above twenty seconds for the shortest of these moves: it is under way however late the browser is."""


def start(screen: Screen, client: Client) -> None:
    """A slow move of KingKong, there or back."""
    here = screen.position(0)
    screen.joint("kingkong.1", 60 if here < 30 else 0)
    screen.speed(SLOW_PERCENT)
    expect(screen.plan()).to_contain_text("Duration")
    screen.press("Move")
    expect(screen.state("kingkong")).to_have_text("moving")
    wait_for(lambda: abs(client.state().groups["kingkong"].velocity[0]) > 1e-3, "it moves", 20)


def state_of(client: Client) -> str:
    return client.state().groups["kingkong"].state


def test_a_move_is_planned_made_and_arrives(operator: Screen, client: Client) -> None:
    here = operator.position(1)
    operator.joint("kingkong.2", here + 5)
    operator.speed(100)
    said = operator.plan()
    expect(said).to_contain_text("kingkong.2")
    operator.tap("Move")  # an accidental touch does nothing
    assert state_of(client) == "standstill"
    operator.press("Move")
    operator.passes("kingkong", "moving", "standstill")
    expect(operator.live("a1.position")).to_have_text(re.compile(f"^{here + 5:.1f}"))
    expect(operator.page.locator(".event").filter(has_text="move ended").first).to_be_visible()


def test_a_changed_form_must_be_planned_again(operator: Screen) -> None:
    operator.joint("kingkong.3", operator.position(2) + 3)
    operator.plan()
    expect(operator.button("Move")).to_be_enabled()
    operator.joint("kingkong.3", operator.position(2) + 4)
    expect(operator.button("Move")).to_be_disabled()


def test_hold_resume_slower_and_stop(operator: Screen, client: Client) -> None:
    start(operator, client)
    operator.tap("Hold")
    expect(operator.state("kingkong")).to_have_text("held")
    operator.press("Resume")
    expect(operator.state("kingkong")).to_have_text("moving")
    slider = operator.page.locator(".override .q-slider [tabindex]").first
    slider.focus()
    operator.page.keyboard.press("ArrowLeft")
    wait_for(lambda: client.state().groups["kingkong"].override == 0.95, "slower at once", 20)
    operator.page.locator("#stop").click()
    operator.has_shown("stop-note", "Stop taken")
    expect(operator.state("kingkong")).to_have_text("standstill")
    slider.focus()  # the button has it now
    operator.page.keyboard.press("ArrowRight")
    assert client.state().groups["kingkong"].override == 0.95
    operator.press("Set")
    wait_for(lambda: client.state().groups["kingkong"].override == 1.0, "as fast as before", 20)


def test_the_space_bar_stops_wherever_it_is_pressed(operator: Screen, client: Client) -> None:
    start(operator, client)
    operator.page.get_by_label("kingkong.4", exact=True).focus()
    operator.page.keyboard.press("Space")
    wait_for(lambda: state_of(client) in ("stopping", "standstill"), "it stops", 20)
    expect(operator.state("kingkong")).to_have_text("standstill")


def test_a_viewer_stops_what_another_moves(operator: Screen, new_screen: Callable[[], Screen], client: Client) -> None:
    viewer = new_screen()
    start(operator, client)
    viewer.page.keyboard.press("Space")
    expect(operator.state("kingkong")).to_have_text("standstill")
    expect(operator.page.locator(".holder")).to_have_text("You are in control")


def test_a_page_that_is_gone_leaves_its_move_held(
    operator: Screen, new_screen: Callable[[], Screen], client: Client
) -> None:
    start(operator, client)
    operator.page.close()
    wait_for(lambda: state_of(client) == "held", "held without its operator", 30)
    new_screen().page.locator("#stop").click()
    wait_for(lambda: state_of(client) == "standstill", "stopped by anyone", 20)


def test_the_tool_moves_on_a_line(operator: Screen, client: Client) -> None:
    before = client.state().groups["kingkong"].pose
    operator.page.get_by_role("tab", name="Tool").click()
    operator.page.get_by_label("z", exact=True).fill("-20")
    said = operator.plan()
    expect(said).to_contain_text("length")
    operator.press("Move")
    operator.passes("kingkong", "moving", "standstill")
    after = client.state().groups["kingkong"].pose
    assert before is not None
    assert after is not None
    assert after["position"][2] - before["position"][2] == pytest.approx(-0.02, abs=1e-4)


def test_a_program_of_ones_own_is_planned_and_run(operator: Screen) -> None:
    step = '[[steps]]\nkind = "joint"\nrelative = true\ntarget_deg = [0, 0, 0, 0, 0, '
    text = f'schema = 1\nname = "a nod"\ngroup = "kingkong"\n{step}'
    operator.page.get_by_role("tab", name="Programs").click()
    with tempfile.TemporaryDirectory() as directory:
        for name, last in (("broken.toml", "oops]"), ("nod.toml", "8]")):
            (Path(directory) / name).write_text(text + last)
            operator.page.locator(".upload input[type=file]").set_input_files(str(Path(directory) / name))
            expect(operator.page.locator(".about")).to_contain_text("a nod" if last == "8]" else "broken.toml")
    expect(operator.plan()).to_contain_text("Duration")
    operator.press("Run")
    operator.passes("kingkong", "moving", "standstill")


def test_a_log_can_be_downloaded(operator: Screen) -> None:
    with operator.page.expect_download() as download:
        operator.page.locator(".log a").first.click()
    assert Path(download.value.path()).read_bytes().startswith(b"\x89MCAP0\r\n")


def test_a_held_pad_jogs_until_it_is_let_go(operator: Screen, client: Client) -> None:
    operator.page.get_by_role("tab", name="Jog").click()
    operator.press("Make the pads live")
    before = client.state().groups["kingkong"].position[3]
    pad = operator.page.locator('.pad[data-pad="3"][data-sign="1"]')
    expect(pad).not_to_have_class(re.compile("disabled"))
    pad.hover()
    operator.page.mouse.down()
    operator.passes("kingkong", "jogging")
    wait_for(lambda: client.state().groups["kingkong"].position[3] > before + 0.02, "it jogs", 20)
    operator.page.mouse.up()
    expect(operator.state("kingkong")).to_have_text("standstill")
