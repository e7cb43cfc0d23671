"""The chosen group: its state, enable, reset, hold and resume, and how fast it runs along its paths."""

from functools import partial

from nicegui import ui

from axisync_client import Lease
from axisync_dashboard.elements import HoldButton, live_bar, live_text, panel, plain_button
from axisync_dashboard.tab import Tab, View


def build(tab: Tab) -> None:
    """The panel."""
    with panel("Group"):
        for name in tab.cell.group_names:
            with ui.element("div").classes("group-line"):
                ui.label(name)
                live_text(f"g.{name}.state", "state")
                live_text(f"g.{name}.rate", "number")
                live_text(f"g.{name}.move", "move")
            live_bar(f"g.{name}.progress")
        hint = ui.label().classes("hint")
        with ui.element("div").classes("buttons"):
            _buttons(tab, hint)
        _override(tab)


def _buttons(tab: Tab, hint: ui.label) -> None:
    enable = HoldButton("Enable", lambda: tab.leased(partial(Lease.enable, group=tab.group)), icon="power")
    reset = HoldButton("Reset", lambda: tab.leased(partial(Lease.reset, group=tab.group)), icon="restart_alt")
    home = HoldButton("Home", lambda: tab.leased(partial(Lease.home, group=tab.group), "Homed."), icon="home")
    disable = HoldButton("Disable", lambda: tab.leased(partial(Lease.disable, group=tab.group)))
    hold = plain_button("Hold", lambda: tab.leased(partial(Lease.hold, group=tab.group)), icon="pause")
    resume = HoldButton("Resume", lambda: tab.leased(partial(Lease.resume, group=tab.group)), icon="play_arrow")
    disable.props("icon=power_off")
    home.set_visibility(any(tab.cell.axes[i].drive.homing for i in tab.cell.axis_indices("all")))

    def show(view: View) -> None:
        enable.set_enabled(view.any("disabled") and not view.any("fault"))
        reset.set_enabled(view.any("fault"))
        home.set_enabled(view.may("standstill"))
        disable.set_enabled(view.any("standstill", "held"))
        hold.set_enabled(view.any("moving"))
        resume.set_enabled(view.any("held"))
        hint.text = _hint(view)

    tab.on_view.append(show)


def _hint(view: View) -> str:
    if not view.fresh:
        return ""
    if not view.operator:
        return "You are looking. Take control to move; STOP works always."
    if view.any("fault"):
        return "A drive has a fault: see Drives below, then reset."
    if view.any("disabled"):
        return "The drives are off: press Enable and hold."
    if view.any("held"):
        return "The move rests on its path: Resume goes on, STOP ends it."
    return "Buttons that fill while pressed act when they are full."


def _override(tab: Tab) -> None:
    """Slower acts at once; faster only when confirmed."""
    with ui.element("div").classes("override"):
        ui.label("Override")
        slider = ui.slider(min=0, max=100, step=5, value=100).props("label switch-label-side")
        wanted = ui.label("100 %").classes("number")
        faster = HoldButton("Set", lambda: send(), icon="speed").classes("faster")
    shown = {"value": 1.0}

    async def send() -> None:
        share = float(slider.value) / 100.0
        if await tab.leased(lambda lease: lease.override(share, group=tab.group)) is not None:
            shown["value"] = share
        faster.set_enabled(False)

    async def moved() -> None:
        if float(slider.value) / 100.0 < shown["value"]:
            await send()
        else:
            faster.set_enabled(float(slider.value) / 100.0 > shown["value"])

    slider.on("change", moved, args=[])
    slider.on_value_change(lambda: wanted.set_text(f"{slider.value:.0f} %"))
    faster.set_enabled(False)

    def show(view: View) -> None:
        slider.set_enabled(view.operator and view.fresh)
        if view.override != shown["value"]:
            shown["value"] = view.override
            slider.value = round(100 * view.override)
        if not view.operator:
            faster.set_enabled(False)

    tab.on_view.append(show)
