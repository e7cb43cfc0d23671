"""What people read: degrees, millimetres, sentences."""

import math
from collections.abc import Sequence

from axisync_client import AxisyncError, ErrorCode, Refused
from axisync_schemas.replies import DriveReport, GroupReport, MoveReply

MISSING = "–"

FIXES = {
    ErrorCode.NOT_ENABLED: "enable it first",
    ErrorCode.NOT_HOMED: "home it first",
    ErrorCode.FAULTED: "reset it, then enable it",
    ErrorCode.LEASE_HELD: "take it over, or ask the holder",
    ErrorCode.LEASE_FENCED: "take control again",
    ErrorCode.BUSY: "wait for the end, or stop it",
}


def degrees(value: float | None, places: int = 2) -> str:
    """An angle in rad as degrees, without a minus before zero."""
    if value is None or not math.isfinite(value):
        return MISSING
    return f"{round(math.degrees(value), places) + 0.0:.{places}f}"


def millidegrees(value: float | None) -> str:
    """A following error in rad as millidegrees."""
    if value is None or not math.isfinite(value):
        return MISSING
    return f"{math.degrees(value) * 1e3 + 0.0:.1f}"


def optional(value: float | None, form: str, scale: float = 1.0) -> str:
    """A number in a form, or a dash where nothing is known."""
    return MISSING if value is None else form.format(round(value * scale, 6) + 0.0).replace("-0 ", "0 ")


def label(name: str) -> str:
    """`operation_enabled` as people write it."""
    return name.replace("_", " ")


def of_error(error: AxisyncError) -> str:
    """One sentence: what is wrong, and the fix where there is one."""
    fix = error.fix
    if fix is None and isinstance(error, Refused):
        fix = FIXES.get(error.code)
    message = error.message.rstrip(". \n")
    return f"{message}." if fix is None or fix in message else f"{message}: {fix}."


def of_plan(reply: MoveReply) -> list[tuple[str, str]]:
    """What a plan is about: names and values."""
    rows = [("Duration", f"{reply.duration_s:.3f} s"), ("Limited by", reply.limiting or "nothing moves")]
    if reply.scale > 1.0:
        rows.append(("Slowed for joints", f"{reply.scale:.2f} times"))
    if reply.steps:
        rows.append(("Steps", str(len(reply.steps))))
    if reply.min_distance_m is not None:
        pair = f" ({reply.nearest[0]} to {reply.nearest[1]})" if reply.nearest else ""
        rows.append(("Least distance", f"{reply.min_distance_m * 1e3:.0f} mm{pair}"))
    rows += [("Note", warning) for warning in reply.warnings]
    return rows


def of_move(group: GroupReport) -> str:
    """The move and how far it is, or why the group stands as it does."""
    if group.move_id is None:
        return group.reason or ""
    share = "" if group.progress is None else f" {group.progress:.0%}"
    return f"{group.move_id}{share}" + (f": {group.reason}" if group.reason else "")


def of_drive(drive: DriveReport) -> str:
    """What is wrong with a drive, in words; nothing where all is well."""
    said = [drive.error or ""] if drive.error_code or drive.error else []
    if drive.safe_torque_off:
        said.append("safe torque off")
    if drive.homed is False:
        said.append("not homed")
    return ", ".join(filter(None, said)) or ("error" if drive.error_code else "")


def of_tool(pose: dict[str, tuple[float, ...]] | None) -> str:
    """The tool's place in mm."""
    if pose is None or "position" not in pose:
        return MISSING
    return "  ".join(f"{name} {value * 1e3 + 0.0:.1f}" for name, value in zip("xyz", pose["position"], strict=True))


def bytes_in_words(size: int) -> str:
    """`12.3 MB`."""
    return f"{size / 1e6:.1f} MB" if size >= 1e5 else f"{size / 1e3:.1f} kB"


def numbers(values: Sequence[float | None], names: Sequence[str]) -> list[float]:
    """The values, all there and finite.

    Raises:
        ValueError: one sentence that names the first that is not.
    """
    good: list[float] = []
    for name, value in zip(names, values, strict=True):
        if value is None or isinstance(value, str) or not math.isfinite(value):
            raise ValueError(f"{name}: enter a number.")
        good.append(float(value))
    return good
