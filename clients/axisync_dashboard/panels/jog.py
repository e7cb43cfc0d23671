"""Jog pads: an axis moves while its pad, or its key, is held. Dead until they are made live."""

from nicegui import ui

from axisync_dashboard.elements import HoldButton
from axisync_dashboard.jogging import SPACES, pads_of
from axisync_dashboard.tab import Tab, View

KEYS = (("KeyQ", "KeyA"), ("KeyW", "KeyS"), ("KeyE", "KeyD"), ("KeyR", "KeyF"), ("KeyT", "KeyG"), ("KeyY", "KeyH"))
"""Forward and backward of the first six, by where they are on the keyboard."""


class JogPads:
    """A pair of pads for each axis, or direction, of the chosen group."""

    def __init__(self, tab: Tab) -> None:
        self._tab = tab
        self._pads: list[ui.element] = []
        self._hint = ui.label().classes("hint")
        with ui.element("div").classes("fields"):
            self._space = ui.select(dict(SPACES), value=tab.space, label="Along", on_change=self._choose)
            self._space.props("dense outlined options-dense")
        with ui.element("div").classes("override"):
            ui.label("Speed")
            slider = ui.slider(min=5, max=100, step=5, value=round(100 * tab.share))
            said = ui.label(f"{slider.value:.0f} %").classes("number")
        slider.on_value_change(lambda: self._set_share(float(slider.value), said))
        self._arm = HoldButton("Make the pads live", tab.arm, icon="lock_open").classes("arm")
        self._grid = ui.element("div").classes("pads")
        tab.on_group.append(self.build)
        tab.on_view.append(self.show)
        self.build()

    def build(self) -> None:
        """The pads of the group."""
        tab, self._pads = self._tab, []
        self._grid.clear()
        compound = tab.group not in tab.cell.group_names
        if compound and tab.space != "joint":
            self._space.value = "joint"
        self._space.set_enabled(not compound)
        with self._grid:
            for number, name in enumerate(pads_of(tab.cell, tab.group, tab.space)):
                self._pad(number, -1, "−")
                ui.label(name)
                self._pad(number, 1, "+")
        self.show(tab.view())

    def show(self, view: View) -> None:
        """Live or dead, and why."""
        self._hint.text = _hint(view)
        live = view.jog and view.armed and view.any("standstill", "jogging", "stopping")
        for pad in self._pads:
            pad.classes(**{"remove" if live else "add": "disabled"})
        self._arm.set_enabled(view.jog and view.may("standstill", "jogging") and not view.armed)

    def _pad(self, number: int, sign: int, text: str) -> None:
        key = KEYS[number][0 if sign > 0 else 1] if number < len(KEYS) else ""
        pad = ui.element("button").classes("pad disabled")
        pad.props(f'type=button data-pad={number} data-sign={sign} data-key="{key}"')
        with pad:
            ui.label(text)
            ui.label(key.removeprefix("Key")).classes("key")
        self._pads.append(pad)

    def _choose(self) -> None:
        self._tab.space = self._space.value
        self._tab.disarm()
        self.build()

    def _set_share(self, percent: float, said: ui.label) -> None:
        self._tab.share = percent / 100.0
        said.text = f"{percent:.0f} %"


def _hint(view: View) -> str:
    if not view.fresh:
        return ""
    if not view.jog:
        return "This daemon cannot jog: it does not know the command. A newer version does."
    if not view.operator:
        return "Take control to jog."
    if not view.armed:
        return "The pads are dead, so that nobody jogs by accident. They go dead again after 30 s without use."
    return "Hold a pad or its key: the arm moves as long as you hold it."
