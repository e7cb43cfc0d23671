"""Small things that panels are made of."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from nicegui import ui


@contextmanager
def panel(title: str, *, live: bool = True) -> Iterator[ui.element]:
    """A card with a title. `live`: it shows the daemon's data, and is greyed while these are old."""
    with ui.element("section").classes("panel" + (" from-daemon" if live else "")) as section:
        ui.label(title).classes("panel-title").props("role=heading aria-level=2")
        yield section


def live_text(key: str, classes: str = "") -> ui.element:
    """A text that the browser fills in by its key in `texts`."""
    return ui.element("span").classes(classes).props(f'data-live="{key}"')


def live_bar(key: str) -> None:
    """A bar whose width, 0% to 100%, the browser sets by its key in `texts`."""
    with ui.element("div").classes("live-bar"):
        ui.element("div").props(f'data-bar="{key}"')


class HoldButton(ui.button):
    """Acts when it was pressed for 0.6 s: by mouse, finger or Enter. For whatever makes motion, or may."""

    def __init__(self, text: str, on_confirm: Callable[[], Any], *, icon: str | None = None) -> None:
        super().__init__(text, icon=icon)
        self.classes("hold").props("no-caps unelevated").tooltip("Press and hold")
        self.on("confirmed", on_confirm, args=[])


def plain_button(text: str, on_click: Callable[[], Any], *, icon: str | None = None) -> ui.button:
    """A button that acts at once: for what makes no motion, or ends one."""
    return ui.button(text, icon=icon, on_click=on_click).props("no-caps outline")
