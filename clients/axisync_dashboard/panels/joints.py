"""A joint move: a target for each axis, in degrees."""

import math
from collections.abc import Callable

from nicegui import ui

from axisync_client import deg, moves
from axisync_dashboard.elements import plain_button
from axisync_dashboard.panels.arms import ArmsView
from axisync_dashboard.panels.preview import Preview, Wish
from axisync_dashboard.tab import Tab
from axisync_dashboard.words import numbers


class JointForm:
    """One number for each axis of the chosen group."""

    def __init__(self, tab: Tab, arms: ArmsView | None) -> None:
        self._tab = tab
        self._fields: dict[str, ui.number] = {}
        self._grid = ui.element("div").classes("fields")
        with ui.element("div").classes("buttons"):
            plain_button("Present position", self.fill, icon="my_location")
            self._relative = ui.checkbox("Relative", on_change=self._changed)
        self._speed = speed_field(self._changed)
        self._preview = Preview(tab, arms, self.wish)
        tab.on_group.append(self.build)
        self.build()

    def build(self) -> None:
        """The fields of the group."""
        self._grid.clear()
        self._fields = {}
        with self._grid:
            for i in self._tab.cell.axis_indices(self._tab.group):
                axis = self._tab.cell.axes[i]
                low, high = (math.degrees(limit) for limit in axis.soft_limits)
                field = ui.number(axis.name, format="%.2f", suffix="°", on_change=self._changed)
                field.props("dense outlined step=any").tooltip(f"{low:g}° to {high:g}°")
                self._fields[axis.name] = field
        self.fill()

    def fill(self) -> None:
        """Where the axes are told to be now; relative: zeros."""
        state = self._tab.link.telemetry.state
        if state is None:
            return
        names = [self._tab.cell.group_names[i] for i in self._tab.cell.members(self._tab.group)]
        setpoint = [value for name in names for value in state.groups[name].setpoint]
        for field, value in zip(self._fields.values(), setpoint, strict=True):
            field.value = 0.0 if self._relative.value else round(math.degrees(value), 2) + 0.0

    def wish(self) -> Wish:
        """The move.

        Raises:
            ValueError: a field is empty.
        """
        target = numbers([field.value for field in self._fields.values()], list(self._fields))
        move = moves.joint(deg(target), relative=bool(self._relative.value))
        return Wish(self._tab.group, move, speed_of(self._speed))

    def _changed(self) -> None:
        self._preview.forget()


def speed_field(changed: Callable[[], None], percent: float = 50, of: str = "% of the limits") -> ui.number:
    """A share in percent."""
    field = ui.number("Speed", value=percent, min=1, max=100, suffix=of)
    field.props("dense outlined").classes("speed")
    field.on_value_change(lambda: changed())
    return field


def speed_of(field: ui.number) -> float:
    """The speed_scale.

    Raises:
        ValueError: it is empty, or no share.
    """
    (percent,) = numbers([field.value], ["Speed"])
    if not 0.0 < percent <= 100.0:
        raise ValueError("Speed: enter 1 to 100 %.")
    return percent / 100.0
