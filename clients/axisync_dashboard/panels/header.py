"""The bar at the top: which cell, which group, who controls it, and STOP."""

from nicegui import ui

from axisync_dashboard.elements import HoldButton, plain_button
from axisync_dashboard.tab import Tab, View


def stop_button() -> None:
    """STOP lies over everything and acts when it is touched, not when it is let go."""
    with ui.element("button").props('id=stop type=button aria-label="Stop all motion"'):
        ui.label("STOP").classes("stop-word")
        ui.label("or space bar").classes("stop-key")
    ui.element("div").props("id=stop-note role=status aria-live=assertive")


def banner() -> None:
    """What is wrong with the connection."""
    ui.element("div").props("id=banner role=alert")


def build(tab: Tab | None) -> None:
    """The bar; without a daemon only its name, the theme and STOP."""
    dark = ui.dark_mode(None)

    def turn() -> None:
        dark.value = not dark.value

    with ui.element("header").classes("bar-top"):
        ui.label("axisync").classes("brand")
        if tab is not None:
            ui.label(tab.cell.name).classes("cell")
            _groups(tab)
            _lease(tab)
        ui.space()
        ui.button(icon="contrast", on_click=turn).props('flat round aria-label="Light or dark"').classes("theme")
    banner()
    stop_button()


def _groups(tab: Tab) -> None:
    names = [*tab.cell.group_names, *(compound.name for compound in tab.cell.compounds)]
    toggle = ui.toggle(names, value=tab.group, on_change=lambda event: tab.choose(event.value))
    toggle.props("no-caps unelevated").classes("groups")


def _lease(tab: Tab) -> None:
    said = ui.label().classes("holder").props("role=status")
    take = plain_button("Take control", lambda: tab.take_control(), icon="lock_open").classes("take")
    over = HoldButton("Take over", lambda: tab.take_control(take=True), icon="gavel").classes("take-over")
    give = plain_button("Release", tab.give_back, icon="lock").classes("release")

    def show(view: View) -> None:
        said.text = _words(view)
        said.classes(replace="holder" + (" operator" if view.operator else ""))
        others = view.holder is not None and not view.operator and not view.holding
        take.set_visibility(not view.operator and not others)
        take.set_enabled(view.fresh)
        over.set_visibility(others)
        give.set_visibility(view.holding)

    tab.on_view.append(show)


def _words(view: View) -> str:
    if not view.fresh:
        return "no daemon"
    if view.operator:
        return "You are in control"
    return f"Held by {view.holder}" if view.holder else "Viewing"
