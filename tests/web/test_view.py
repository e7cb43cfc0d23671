"""What a viewer sees, and that a viewer moves nothing."""

import re
from collections.abc import Callable

import numpy as np
from playwright.sync_api import expect

from axisync_client import Client
from support.browser import Screen


def test_a_viewer_sees_the_arms_where_they_are(screen: Screen, client: Client) -> None:
    state = client.state()
    for group, report in state.groups.items():
        assert report.pose is not None
        np.testing.assert_allclose(screen.tool(group), report.pose["position"], atol=1e-3)
    degrees = np.degrees([value for report in state.groups.values() for value in report.position])
    np.testing.assert_allclose([screen.position(i) for i in range(12)], degrees, atol=0.02)
    for key in ("b.kingkong.load", "c.skipped", "c.late", "a0.drive", "a0.error"):
        expect(screen.live(key)).to_have_text(re.compile(r"\w"))
    expect(screen.page.locator("[data-bin]")).to_have_count(10)


def test_a_viewer_plans_and_does_not_move(screen: Screen) -> None:
    expect(screen.page.locator(".holder")).to_have_text("Viewing")
    for name in ("Enable", "Resume", "Hold", "Move"):
        expect(screen.button(name)).to_be_disabled()
    screen.joint("kingkong.1", 20)
    said = screen.plan()
    expect(said).to_contain_text("Duration")
    expect(said).to_contain_text("kingkong.1")
    expect(screen.button("Move")).to_be_disabled()


def test_a_refusal_is_said_in_words(screen: Screen) -> None:
    screen.joint("kingkong.1", 500)
    expect(screen.plan()).to_contain_text("kingkong.1")
    screen.joint("kingkong.1", 20)
    screen.page.get_by_label("kingkong.2", exact=True).fill("")
    expect(screen.plan()).to_have_text("kingkong.2: enter a number.")


def test_the_second_page_views_and_may_take_over(new_screen: Callable[[], Screen]) -> None:
    first, second = new_screen(), new_screen()
    first.choose("wukong")
    second.choose("wukong")
    first.button("Take control").click()
    expect(first.page.locator(".holder")).to_have_text("You are in control")
    expect(second.page.locator(".holder")).to_have_text("Held by anonymous")
    second.tap("Take over")
    expect(second.page.locator(".holder")).to_have_text("Held by anonymous")
    second.press("Take over")
    expect(second.page.locator(".holder")).to_have_text("You are in control")
    expect(first.page.locator(".q-notification")).to_contain_text(["wukong"])
    expect(first.page.locator(".holder")).to_have_text("Held by anonymous")
    second.page.close()
    expect(first.page.locator(".holder")).to_have_text("Viewing")


def test_pads_are_dead_and_say_why(screen: Screen) -> None:
    screen.page.get_by_role("tab", name="Jog").click()
    expect(screen.page.locator(".pad").first).to_have_class(re.compile("disabled"))
    expect(screen.page.locator(".motion .hint").locator("visible=true").first).to_have_text(re.compile(r"jog"))
