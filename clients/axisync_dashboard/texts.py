"""A state as the short texts that the page shows, by key; elements name their key and the browser fills them in."""

from collections.abc import Sequence

from axisync_dashboard.words import MISSING, degrees, label, millidegrees, of_drive, of_move, of_tool, optional
from axisync_schemas.replies import BusReport, CycleReport, GroupReport, State

Texts = dict[str, str]


def texts_of(state: State, errors: Sequence[float | None]) -> Texts:
    """Every text of a state. Axes are numbered through all groups, as in the cell file.

    Args:
        errors: following error of each axis, rad; empty where no tick was heard yet.
    """
    texts: Texts = {
        "controller": "" if state.controller == "up" else "The controller is down: nothing moves.",
        "recorder": _recorder(state),
        **_cycle(state.cycle),
    }
    axis = 0
    for name, group in state.groups.items():
        texts |= _group(name, group, state.lease.get(name))
        for i in range(len(group.drives)):
            texts |= _axis(f"a{axis}", group, i, errors[axis] if axis < len(errors) else None)
            axis += 1
    for name, bus in state.buses.items():
        texts |= _bus(f"b.{name}", bus)
    return texts


def _group(name: str, group: GroupReport, holder: str | None) -> Texts:
    key = f"g.{name}"
    return {
        f"{key}.state": label(group.state),
        f"{key}.move": of_move(group),
        f"{key}.progress": f"{100.0 * (group.progress or 0.0):.1f}%",
        f"{key}.rate": f"{group.path_rate:.0%}",
        f"{key}.override": f"{group.override:.0%}",
        f"{key}.lease": holder or "free",
        f"{key}.tool": of_tool(group.pose),
    }


def _axis(key: str, group: GroupReport, i: int, error: float | None) -> Texts:
    drive = group.drives[i]
    return {
        f"{key}.position": degrees(group.position[i]),
        f"{key}.setpoint": degrees(group.setpoint[i]),
        f"{key}.velocity": degrees(group.velocity[i]),
        f"{key}.error": millidegrees(error),
        f"{key}.drive": label(drive.state),
        f"{key}.nmt": label(drive.nmt),
        f"{key}.torque": optional(drive.torque, "{:z.0f} %", 100.0),
        f"{key}.temperature": optional(drive.temperature, "{:.0f} °C"),
        f"{key}.voltage": optional(drive.voltage, "{:.1f} V"),
        f"{key}.fault": of_drive(drive),
    }


def _bus(key: str, bus: BusReport) -> Texts:
    return {
        f"{key}.state": label(bus.state),
        f"{key}.load": f"{bus.load:.0%}",
        f"{key}.width": f"{min(100.0, 100.0 * bus.load):.0f}%",
        f"{key}.lost": str(bus.lost),
    }


def _cycle(cycle: CycleReport | None) -> Texts:
    if cycle is None:
        return {"c.late": MISSING, "c.skipped": MISSING, "c.period": MISSING, "c.realtime": ""}
    late = cycle.lateness_us
    return {
        "c.late": f"{late.p50:.0f} / {late.p99:.0f} / {late.max:.0f} µs",
        "c.skipped": str(cycle.skipped_ticks),
        "c.period": f"{cycle.period_s * 1e3:g} ms",
        "c.realtime": "" if cycle.realtime else "no real-time scheduling",
    }


def _recorder(state: State) -> str:
    lost = f", {state.recorder.lost_ticks} ticks lost" if state.recorder.lost_ticks else ""
    return f"{label(state.recorder.state)}{lost}"


def changes(before: Texts, now: Texts) -> Texts:
    """What is new or different; what is gone becomes empty."""
    changed = {key: text for key, text in now.items() if before.get(key) != text}
    return changed | {key: "" for key in before if key not in now}
