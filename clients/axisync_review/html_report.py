"""A review as one HTML file without anything from elsewhere: tables, curves to zoom, the tool's path."""

import base64
import json
import zlib
from collections.abc import Callable
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisync_review.errors import NotWritten
from axisync_review.findings import Findings
from axisync_review.limits import COMMANDED
from axisync_review.models import Review
from axisync_review.series import Series
from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import GroupState

Array = NDArray[np.float64]

LEVELS = 65535
"""Values are drawn with 16 bits between their least and greatest: finer than any screen, zoomed in a hundredfold."""
PATH_POINTS = 4000
"""Of each tool's path, at most."""
STILL_M = 1e-5
"""Points of a path nearer to each other than this are one."""
MOVES_MAX = 500
EVENTS_MAX = 1000
CURVES = {
    "position": ("position", "deg", 180.0 / np.pi),
    "velocity": ("velocity", "deg/s", 180.0 / np.pi),
    "acceleration": ("acceleration", "deg/s²", 180.0 / np.pi),
    "jerk": ("jerk", "deg/s³", 180.0 / np.pi),
    "following_error": ("following error", "mdeg", 180e3 / np.pi),
    "lateness": ("lateness", "µs", 1e-3),
}
"""Title, unit, and factor from SI (ns for lateness)."""


def save(review: Review, found: Findings, path: Path) -> None:
    """Writes the report; replaces a file of that name.

    Raises:
        NotWritten: it cannot be written.
    """
    text = page(review, found)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise NotWritten(f"{path} cannot be written: {error.strerror or error}") from None


def page(review: Review, found: Findings) -> str:
    """The whole file."""
    folder = resources.files("axisync_review").joinpath("page")
    html, css, script = (
        folder.joinpath(name).read_text("utf-8") for name in ("report.html", "report.css", "report.js")
    )
    data = json.dumps(_data(review, found), separators=(",", ":")).replace("</", "<\\/")
    for mark, text in (("/*css*/", css), ("/*script*/", script), ("/*data*/", data)):
        html = html.replace(mark, text, 1)
    return html


def _data(review: Review, found: Findings) -> dict[str, Any]:
    shown = review.model_copy(update={"moves": review.moves[:MOVES_MAX], "events": _notable(review)})
    return {
        "review": shown.model_dump(mode="json"),
        "counts": {"moves": len(review.moves), "events": len(review.events)},
        "states": [state.label for state in GroupState],
        **_curves(found),
    }


def _notable(review: Review) -> tuple[object, ...]:
    """All events, or the graver ones where there are too many."""
    events = review.events
    if len(events) > EVENTS_MAX:
        events = tuple(event for event in events if event.severity != "info")
    return tuple(events[:EVENTS_MAX])


# --- curves ---------------------------------------------------------------------------------------------------------


def _curves(found: Findings) -> dict[str, Any]:
    series, cell = found.series, found.run.cell
    groups = [
        {"name": group.name, "axes": list(cell.axis_indices(group.name)), "base": list(group.base.position)}
        for group in cell.groups
    ]
    names = [axis.name for axis in cell.axes]
    if series is None or not series.count:
        return {"groups": groups, "axes": names, "curves": [], "t": None, "paths": []}
    times = (series.times_ns - found.begin_ns) / 1e9
    return {
        "groups": groups,
        "axes": names,
        "bucket_s": series.ticks * cell.period,
        "t": packed(times.astype("<f8")),
        "count": series.count,
        "state": packed(series.states.T.astype(np.uint8)),
        "curves": [_curve(series, cell, name) for name in CURVES],
        "paths": _paths(series, cell),
    }


def _curve(series: Series, cell: Cell, name: str) -> dict[str, Any]:
    title, unit, factor = CURVES[name]
    low, high = (np.nan_to_num(values, posinf=0.0, neginf=0.0) for values in series.envelope(name))
    one = np.array_equal(low, high)
    least, greatest = low.min(axis=0), high.max(axis=0)
    return {
        "name": name,
        "title": title,
        "unit": unit,
        "least": (least * factor).tolist(),
        "greatest": (greatest * factor).tolist(),
        "limits": _limits(cell, name, factor),
        "stop_limits": _stop_limits(cell, name, factor),
        "low": packed(quantised(low, least, greatest)),
        "high": None if one else packed(quantised(high, least, greatest)),
    }


def _limits(cell: Cell, name: str, factor: float) -> list[float] | None:
    """Of each axis: what 100 % is."""
    if name == "following_error":
        return [axis.drive.following_error_max * factor for axis in cell.axes]
    if name in ("velocity", "acceleration", "jerk"):
        return [getattr(axis.limits, name) * factor for axis in cell.axes]
    return None


def _stop_limits(cell: Cell, name: str, factor: float) -> list[float] | None:
    if name in ("acceleration", "jerk"):
        return [getattr(axis.stop_limits, name) * factor for axis in cell.axes]
    return None


def quantised(values: Array, least: Array, greatest: Array) -> NDArray[np.uint16]:
    """[count, n] -> [n, count]: 0 at `least`, 65535 at `greatest`; differences to the one before, modulo 2^16."""
    span = np.where(greatest > least, greatest - least, 1.0)
    levels = np.rint((values - least) / span * LEVELS).astype(np.int64).T
    return np.diff(levels, axis=1, prepend=0).astype("<u2")


def packed(values: NDArray[Any]) -> str:
    """Deflated bytes as base64."""
    return base64.b64encode(zlib.compress(np.ascontiguousarray(values).tobytes(), 9)).decode()


# --- tool path ------------------------------------------------------------------------------------------------------


def _paths(series: Series, cell: Cell) -> list[dict[str, Any]]:
    """Where each arm's tool frame was; nothing for groups that are no arms, or without pinocchio."""
    if find_spec("pinocchio") is None:
        return []
    from axisync_robot.arm import Arm

    found = []
    for index, group in enumerate(cell.groups):
        arm = Arm.of(group)
        if arm is None:
            continue
        commanded = np.flatnonzero(np.isin(series.states[:, index], COMMANDED))
        if not len(commanded):  # Disabled all the time: where it was at the end.
            commanded = np.array([series.count - 1])
        poses = series.poses[:, list(cell.axis_indices(group.name))]
        rows, points = _tool_path(arm.placement, poses, commanded)
        found.append({"group": index, "rows": rows.tolist(), "points": np.round(points, 5).tolist()})
    return found


def _tool_path(
    placement: Callable[[Array], Array], poses: Array, rows: NDArray[np.intp]
) -> tuple[NDArray[np.intp], Array]:
    """Buckets, of `rows`, and points [k, 3], m; where the arm rests, one point."""
    moved = np.any(np.diff(poses[rows], axis=0) != 0.0, axis=1)
    rows = rows[np.concatenate([[True], moved])]
    rows = rows[:: -(-len(rows) // PATH_POINTS)]
    points = np.array([placement(poses[row])[:3, 3] for row in rows])
    return _apart(rows, points)


def _apart(rows: NDArray[np.intp], points: Array) -> tuple[NDArray[np.intp], Array]:
    kept = [0]
    for index in range(1, len(points)):
        if np.linalg.norm(points[index] - points[kept[-1]]) > STILL_M:
            kept.append(index)
    return rows[kept], points[kept]
