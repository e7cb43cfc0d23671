"""A move of the tool: to a place in millimetres, on a straight line or by the joints."""

from typing import Literal, cast

from nicegui import ui

from axisync_client import ToolPose, deg, mm, moves
from axisync_client.moves import AnyMove
from axisync_dashboard.panels.arms import ArmsView
from axisync_dashboard.panels.joints import speed_field, speed_of
from axisync_dashboard.panels.preview import Preview, Wish
from axisync_dashboard.tab import Tab
from axisync_dashboard.words import numbers

WAYS = {"linear": "Straight line", "joint": "By the joints"}
FRAMES = {"base": "Base of the arm", "body": "Body", "tool": "Tool"}
COORDINATES = ("x", "y", "z")
ANGLES = ("α (z)", "β (y')", "γ (z'')")


class ToolForm:
    """Position, and orientation where it is to change."""

    def __init__(self, tab: Tab, arms: ArmsView | None) -> None:
        self._tab = tab
        self._only_one = ui.label("Choose one arm: both at once are moved by joints or programs.").classes("hint")
        self._all = ui.element("div")
        with self._all:
            with ui.element("div").classes("fields"):
                self._way = ui.select(WAYS, value="linear", label="Way", on_change=self._changed)
                self._frame = ui.select(FRAMES, value="body", label="Frame", on_change=self._changed)
                self._relative = ui.checkbox("Offset", value=True, on_change=self._changed)
                self._position = [self._number(name, "mm") for name in COORDINATES]
            self._keep = ui.checkbox("Keep the orientation", value=True, on_change=self._changed)
            angles = ui.element("div").classes("fields")
            angles.bind_visibility_from(self._keep, "value", lambda keep: not keep)
            with angles:
                self._angles = [self._number(name, "°") for name in ANGLES]
            self._speed = speed_field(self._changed)
            self._preview = Preview(tab, arms, self.wish)
        for select in (self._way, self._frame):
            select.props("dense outlined options-dense")
        tab.on_group.append(self.build)
        self.build()

    def build(self) -> None:
        """For one arm only."""
        single = self._tab.group in self._tab.cell.group_names
        self._only_one.set_visibility(not single)
        self._all.set_visibility(single)

    def wish(self) -> Wish:
        """The move.

        Raises:
            ValueError: a field is empty, or they do not go together.
        """
        position = mm(numbers([field.value for field in self._position], COORDINATES))
        euler = None
        if not self._keep.value:
            euler = deg(numbers([field.value for field in self._angles], ANGLES))
        frame = cast(Literal["base", "body", "tool"], self._frame.value)
        return Wish(self._tab.group, self._move(moves.pose(position, euler_zyz=euler), frame), speed_of(self._speed))

    def _move(self, place: ToolPose, frame: Literal["base", "body", "tool"]) -> AnyMove:
        if self._way.value == "linear":
            return moves.linear(place, frame=frame, relative=bool(self._relative.value))
        if self._relative.value:
            raise ValueError("An offset is for straight lines: untick it, or choose the straight line.")
        return moves.joint(place, frame=frame)

    def _number(self, name: str, unit: str) -> ui.number:
        field = ui.number(name, value=0.0, format="%.2f", suffix=unit, on_change=self._changed)
        return field.props("dense outlined step=any")

    def _changed(self) -> None:
        if hasattr(self, "_preview"):
            self._preview.forget()
