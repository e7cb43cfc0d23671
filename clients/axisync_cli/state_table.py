"""What `axisync state`, `axisync watch` and `axisync lease` show."""

import math
from collections import Counter
from collections.abc import Callable

from rich.console import Group
from rich.table import Table
from rich.text import Text

from axisync_schemas.replies import BusReport, CycleReport, DriveReport, GroupReport, State

_STYLES = {"fault": "bold red", "moving": "green", "held": "yellow", "stopping": "yellow", "disabled": "dim"}


def state_table(state: State) -> Group:
    """Groups, positions in degrees, drives' health, drives that need attention, then the service in a line each."""
    return Group(_groups(state), _positions(state), *_health(state), *_drive_lines(state), *_service_lines(state))


def live_table(state: State) -> Group:
    """What changes while one looks on: groups, how far moves are, positions, drives with an error, the service."""
    return Group(_groups(state), _positions(state), *_drive_lines(state), *_service_lines(state))


def lease_table(lease: dict[str, str | None]) -> Table:
    """Who may move what."""
    table = Table()
    table.add_column("group")
    table.add_column("lease")
    for group, holder in lease.items():
        table.add_row(group, holder or "free")
    return table


def _groups(state: State) -> Table:
    table = Table()
    for name in ("group", "state", "move", "drives", "lease"):
        table.add_column(name)
    for name, group in state.groups.items():
        label = Text(group.state, style=_STYLES.get(group.state, ""))
        table.add_row(name, label, _move(group), _drives(group.drives), state.lease.get(name) or "free")
    return table


def _move(group: GroupReport) -> str:
    if group.move_id is None:
        return group.reason or ""
    share = "" if group.progress is None else f" {group.progress:.0%}"
    reason = f" ({group.reason})" if group.reason else ""
    return f"{group.move_id}{share}{reason}"


def _drives(drives: tuple[DriveReport, ...]) -> str:
    counts = Counter(drive.state.replace("_", " ") for drive in drives)
    return ", ".join(f"{count} {label}" for label, count in counts.items())


def _positions(state: State) -> Table:
    most = max((len(group.position) for group in state.groups.values()), default=0)
    table = Table(caption="measured positions, degrees", caption_justify="left")
    table.add_column("axis")
    for number in range(1, most + 1):
        table.add_column(str(number), justify="right")
    for name, group in state.groups.items():
        table.add_row(name, *(f"{math.degrees(value):.2f}" for value in group.position))
    return table


def _health(state: State) -> list[Table]:
    """One row a drive, with the columns that any drive has something to say in; none without such a column."""
    drives = [drive for group in state.groups.values() for drive in group.drives]
    cells = {title: [say(drive) for drive in drives] for title, say in _HEALTH.items()}
    shown = {title: column for title, column in cells.items() if any(column)}
    if not shown:
        return []
    table = Table("drive", *shown)
    for row in zip((drive.axis for drive in drives), *shown.values(), strict=True):
        table.add_row(*row)
    return [table]


def _flag(value: bool | None, yes: str, no: str) -> str:
    return "" if value is None else yes if value else no


_HEALTH: dict[str, Callable[[DriveReport], str]] = {
    "temperature": lambda drive: "" if drive.temperature is None else f"{drive.temperature:.0f} degC",
    "voltage": lambda drive: "" if drive.voltage is None else f"{drive.voltage:.1f} V",
    "torque": lambda drive: "" if drive.torque is None else f"{drive.torque:z.0%}",
    "safe torque off": lambda drive: _flag(drive.safe_torque_off, "active", ""),
    "homed": lambda drive: _flag(drive.homed, "yes", "no"),
}
"""Columns: what a drive says in each, or nothing."""


def _drive_lines(state: State) -> list[Text]:
    """One line for each drive with an error."""
    return [
        _line(f"{drive.axis}: {drive.error or 'error'} (0x{drive.error_code:04X}), {drive.state}", "red")
        for group in state.groups.values()
        for drive in group.drives
        if drive.error_code or drive.error
    ]


def _service_lines(state: State) -> list[Text]:
    recorder = state.recorder
    lost = f", {recorder.lost_ticks} ticks lost" if recorder.lost_ticks else ""
    lines = [
        _line(_cycle(state.cycle)),
        _line("buses: " + ("; ".join(_bus(name, bus) for name, bus in state.buses.items()) or "unknown")),
        _line(f"recorder: {recorder.state}, on disk up to tick {recorder.cursor_tick} of {state.tick}{lost}"),
    ]
    return lines if state.controller == "up" else [_line("the controller is down: nothing moves", "bold red"), *lines]


def _line(text: str, style: str = "") -> Text:
    """A sentence; on a narrow terminal it goes on in the next line."""
    return Text(text, style=style)


def _cycle(cycle: CycleReport | None) -> str:
    if cycle is None:
        return "cycle: no timing yet"
    late = cycle.lateness_us
    scheduling = "real time" if cycle.realtime else "no real-time scheduling"
    causes = ", ".join(f"{count} by {cause.replace('_', ' ')}" for cause, count in cycle.late_by.items() if count)
    return (
        f"cycle: {cycle.period_s * 1e3:g} ms, {scheduling}, {cycle.skipped_ticks} ticks skipped, "
        f"late by {late.p50:.0f} us (p50), {late.p99:.0f} us (p99), {late.max:.0f} us (max)"
        + (f"; {cycle.late_ticks} late ticks: {causes}" if causes else "")
    )


def _bus(name: str, bus: BusReport) -> str:
    return f"{name} {bus.state}, load {bus.load:.0%}, {bus.lost} frames lost"
