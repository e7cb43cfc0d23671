"""One page in one browser: the group it has chosen, the lease that it holds, and what its controls may do."""

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeVar

from nicegui import Client as Browser
from nicegui import ui

from axisync_client import AxisyncError, Client, Lease, LeaseLost, Refused
from axisync_client.jog import PASSING
from axisync_dashboard import jogging
from axisync_dashboard.jogging import Space
from axisync_dashboard.link import DaemonLink
from axisync_dashboard.words import of_error
from axisync_schemas.cell import Cell
from axisync_schemas.errors import ErrorCode

T = TypeVar("T")
Kind = Literal["positive", "negative", "warning", "info"]

SILENCE_S = 3.0
"""A page that shows no frames for so long has nobody before it: its lease is given back, what moves comes to held."""
ARMED_S = 30.0
"""Jog pads go dead again after so long without use."""


@dataclass(frozen=True)
class View:
    """What controls are enabled by.

    Attributes:
        groups: elementary groups of the chosen one. states: their states; empty while nothing fresh is known.
        operator: this page may move the chosen group. holding: it holds some lease.
        holder: who holds a lease on it, this page or another; None where it is free.
        jog: the daemon knows the verb. armed: the pads are live.
    """

    group: str
    groups: tuple[str, ...]
    states: tuple[str, ...]
    operator: bool
    holding: bool
    holder: str | None
    override: float
    jog: bool
    armed: bool

    @property
    def fresh(self) -> bool:
        """The daemon is there."""
        return bool(self.states)

    def may(self, *states: str) -> bool:
        """This page may command it, and every group is in one of the states."""
        return self.operator and self.fresh and all(state in states for state in self.states)

    def any(self, *states: str) -> bool:
        """This page may command it, and some group is in one of the states."""
        return self.operator and any(state in states for state in self.states)


class Tab:
    """Lives as long as its page. Everything here runs on the event loop, but for what is given to `command`."""

    def __init__(self, browser: Browser, link: DaemonLink, cell: Cell) -> None:
        self.link, self.cell = link, cell
        self.group = cell.groups[0].name
        self.space: Space = "joint"
        self.share = 0.2
        self.lease: Lease | None = None
        self.on_view: list[Callable[[View], None]] = []
        self.on_group: list[Callable[[], None]] = []
        self._browser = browser
        self._alive_s = time.monotonic()
        self._armed_until = 0.0
        self._jogging = False
        self._shown: View | None = None

    # What the page shows.

    def choose(self, group: str) -> None:
        """Controls are about this group, or compound, from now on."""
        self.group = group
        self.disarm()
        for tell in self.on_group:
            tell()
        self.refresh()

    def refresh(self) -> None:
        """Gives back what nobody watches; shows what is different."""
        if self.lease is not None and time.monotonic() - self._alive_s > SILENCE_S:
            self.release_unseen()
        view = self.view()
        if view != self._shown:
            self._shown = view
            for show in self.on_view:
                show(view)

    def view(self) -> View:
        """As it is now."""
        telemetry = self.link.telemetry
        names = tuple(self.cell.group_names[i] for i in self.cell.members(self.group))
        state = telemetry.state if telemetry.fresh else None
        reports = () if state is None else tuple(state.groups[name] for name in names)
        holders = {} if state is None else {name: state.lease.get(name) for name in names}
        return View(
            group=self.group,
            groups=names,
            states=tuple(report.state for report in reports),
            operator=self.operates(names),
            holding=self.holding,
            holder=next((holder for holder in holders.values() if holder), None),
            override=min((report.override for report in reports), default=1.0),
            jog=telemetry.info is not None and "jog" in telemetry.info.verbs,
            armed=time.monotonic() < self._armed_until,
        )

    @property
    def holding(self) -> bool:
        """This page holds a lease."""
        return self.lease is not None and not self.lease.lost

    def operates(self, groups: tuple[str, ...]) -> bool:
        """This page's lease covers them."""
        if self.lease is None or self.lease.lost:
            return False
        held = {i for name in self.lease.groups for i in self.cell.members(name)}
        return all(self.cell.group_names.index(group) in held for group in groups)

    def say(self, text: str, kind: Kind = "info") -> None:
        """A note that goes away by itself."""
        if self._browser.id in Browser.instances:
            with self._browser:
                lasting = kind in ("negative", "warning")
                ui.notify(
                    text, type=kind, position="bottom-left", timeout=10_000 if lasting else 3_000,
                    close_button="Close" if lasting else False, multi_line=True,
                )  # fmt: skip

    # The lease.

    async def take_control(self, take: bool = False) -> None:
        """Acquires the lease on the chosen group, giving another one back first."""
        await self.give_back()
        loop = asyncio.get_running_loop()

        def lost(_: Lease, why: LeaseLost) -> None:
            loop.call_soon_threadsafe(self._lost, why)

        lease = await self.command(lambda client: client.lease(self.group, take=take, on_lost=lost))
        if lease is None:
            return
        self.lease, self._alive_s = lease, time.monotonic()
        self.refresh()

    async def give_back(self) -> None:
        """Releases the lease; what moves comes to held."""
        lease, self.lease = self.lease, None
        self.disarm()
        if lease is not None:
            await self.command(lambda _: lease.release())
        self.refresh()

    def release_unseen(self) -> None:
        """The page is gone, or shows nothing any more."""
        lease, self.lease = self.lease, None
        self.disarm()
        if lease is not None:
            self.link.in_background(lease.release)
            self.say(f"Control of {', '.join(lease.groups)} was given back: this page showed nothing new.", "warning")

    def _lost(self, why: LeaseLost) -> None:
        self.lease = None
        self.disarm()
        self.refresh()
        self.say(of_error(why), "negative")

    # Commands.

    async def command(self, ask: Callable[[Client], T], done: str | None = None) -> T | None:
        """Runs `ask` in a thread; says `done`, or why it was refused, and then gives None."""
        try:
            result = await self.link.call(ask)
        except AxisyncError as error:
            self.say(of_error(error), "negative")
            self.refresh()
            return None
        if done:
            self.say(done, "positive")
        return result

    async def leased(self, ask: Callable[[Lease], T], done: str | None = None) -> T | None:
        """As `command`, with the lease of this page."""
        lease = self.lease
        if lease is None:
            self.say("Take control first.", "warning")
            return None
        return await self.command(lambda _: ask(lease), done)

    # Signs of life and jogging, from the page's socket.

    def alive(self) -> None:
        """The browser has shown a frame just now."""
        self._alive_s = time.monotonic()

    def arm(self) -> None:
        """The pads are live, until they are not used for a while."""
        self._armed_until = time.monotonic() + ARMED_S
        self.refresh()

    def disarm(self) -> None:
        """The pads are dead."""
        self._armed_until = 0.0

    async def jog(self, pad: int, sign: int) -> str | None:
        """One refresh of a held pad; a sentence where it must be let go."""
        if self._jogging:
            return None  # the one before is still under way: refreshes are dropped, never queued
        if self.lease is None or time.monotonic() > self._armed_until:
            return "The pads are not live."
        self._armed_until = time.monotonic() + ARMED_S
        self._jogging = True
        try:
            velocity = jogging.velocity_of(self.cell, self.group, self.space, pad, sign, self.share)
            call = jogging.jog_call(self.group, self.space, velocity, self.lease.token)
            await self.link.ask(call)
        except (AxisyncError, ValueError) as error:
            return None if isinstance(error, Refused) and error.code in PASSING else self._no_jog(error)
        finally:
            self._jogging = False
        return None

    def _no_jog(self, error: AxisyncError | ValueError) -> str:
        said = of_error(error) if isinstance(error, AxisyncError) else str(error)
        if isinstance(error, Refused) and error.code is ErrorCode.NOT_FOUND:
            said = "This daemon cannot jog."
        self.say(said, "negative")
        return said

    async def end_jog(self) -> None:
        """The pad was let go: the arm would stop by itself, and being told is quicker."""
        if self.lease is None or not self._armed_until:
            return
        try:
            await self.link.ask(jogging.release_call(self.cell, self.group, self.space, self.lease.token))
        except AxisyncError as error:
            self.say(of_error(error), "negative")
