"""Plan first, then move: what a move would do, in numbers and as a ghost, and the button that does it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from nicegui import ui

from axisync_client import AxisyncError, Lease, Move
from axisync_client.moves import AnyMove
from axisync_dashboard import words
from axisync_dashboard.elements import HoldButton, plain_button
from axisync_dashboard.ghosts import Ghost, ghosts_of
from axisync_dashboard.kinematics import arms_of
from axisync_dashboard.panels.arms import ArmsView
from axisync_dashboard.tab import Tab, View
from axisync_schemas.replies import MoveReply


@dataclass(frozen=True)
class Wish:
    """What is asked for."""

    group: str
    move: AnyMove
    speed_scale: float


class Preview:
    """Plan and move for one form. `wish` raises ValueError, in a sentence, where the form is not filled in well."""

    def __init__(self, tab: Tab, arms: ArmsView | None, wish: Callable[[], Wish], verb: str = "Move") -> None:
        self._tab, self._arms, self._read = tab, arms, wish
        self._planned: Wish | None = None
        self._ghosts: dict[str, Ghost] = {}
        with ui.element("div").classes("buttons"):
            self._plan_button = plain_button("Plan", self.plan, icon="route").classes("plan")
            self._move_button = HoldButton(verb, self.move, icon="play_arrow").classes("move")
        self._shown = ui.element("div").classes("preview").props("role=status")
        self._enable(tab.view())
        tab.on_view.append(self._enable)
        tab.on_group.append(self.forget)

    def forget(self) -> None:
        """The form is another one now: what was planned no longer counts."""
        if self._planned is None and not self._ghosts:
            return
        self._planned, self._ghosts = None, {}
        self._shown.clear()
        self._shown.classes(replace="preview")
        if self._arms is not None:
            self._arms.preview({})
        self._enable(self._tab.view())

    async def plan(self) -> None:
        """Asks the daemon what the move would do."""
        self.forget()
        try:
            wish = self._read()
            reply = await self._tab.link.call(lambda client: client.plan(wish.group, wish.move, wish.speed_scale))
        except AxisyncError as error:
            return self._refused(words.of_error(error))
        except ValueError as error:
            return self._refused(str(error))
        self._planned = wish
        self._ghosts = self._ghosts_of(wish, reply)
        if self._arms is not None:
            self._arms.preview(self._ghosts)
        self._show(reply)
        self._enable(self._tab.view())
        return None

    async def move(self) -> None:
        """Does what was planned."""
        wish, ghosts = self._planned, self._ghosts
        if wish is None:
            return

        def go(lease: Lease) -> Move:
            return lease.move(wish.move, group=wish.group, speed_scale=wish.speed_scale)

        move = await self._tab.leased(go)
        self.forget()
        if move is not None:
            self._tab.link.telemetry.accepted(move.id, ghosts)
            self._tab.say(f"{move.group}: {move.reply.duration_s:.2f} s to go.", "positive")

    def _ghosts_of(self, wish: Wish, reply: MoveReply) -> dict[str, Ghost]:
        state, cell = self._tab.link.telemetry.state, self._tab.cell
        if state is None or not reply.end:
            return {}
        arms = arms_of(cell)
        groups = {
            cell.group_names[i]: (arms[i], np.array(state.groups[cell.group_names[i]].setpoint))
            for i in cell.members(wish.group)
        }
        parabolic = getattr(wish.move, "pulse", "constant") == "parabolic"
        return ghosts_of(reply, wish.move, groups, parabolic)

    def _show(self, reply: MoveReply) -> None:
        self._shown.clear()
        self._shown.classes(replace="preview good")
        with self._shown, ui.element("dl").classes("facts"):
            for name, value in words.of_plan(reply):
                with ui.element("dt"):
                    ui.label(name)
                with ui.element("dd"):
                    ui.label(value)

    def _refused(self, sentence: str) -> None:
        self._shown.clear()
        self._shown.classes(replace="preview bad")
        with self._shown:
            ui.label(sentence)

    def _enable(self, view: View) -> None:
        self._plan_button.set_enabled(view.fresh)
        self._move_button.set_enabled(self._planned is not None and view.may("standstill"))
