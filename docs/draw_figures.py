"""Draws the pictures of planner.md and writes its tables, from the library: `python docs/draw_figures.py`."""

from collections.abc import Callable
from pathlib import Path

import mapping_table
import numpy as np
from numpy.typing import NDArray

from axisync_cli import plan_plot
from axisync_cli.plan_curves import POINTS, Curves
from axisync_motion import (
    Profile,
    Pulse,
    lowest_acceleration,
    lowest_jerk,
    lowest_velocity,
    synchronise,
    time_optimal,
)

DOCS = Path(__file__).parent
FIGURES = DOCS / "figures"
PAGE = DOCS / "planner.md"
SIZE = (5.2, 3.2)
V, A, J = 20.0, 20.0, 30.0
"""Limits of section V.A."""
P1, P2 = (0.0, -150.0, 60.0, -45.0, -45.0, 45.0), (100.0, -90.0, -60.0, -120.0, 45.0, 45.0)
KINGKONG = ([30.0] * 6, [40.0] * 6, [80.0] * 6)
"""Section V.B.1: start, end (deg) and limits (deg/s, deg/s^2, deg/s^3)."""
INSIDE = 1e-12
"""Of the duration: how far inside of its ends a segment is sampled, since its neighbour owns them."""


def between_knots(series: tuple[float, ...]) -> NDArray[np.float64]:
    """Times [k] in all segments of T that are not empty, and just outside of them, at rest."""
    ends = np.cumsum(series)
    inside = INSIDE * ends[-1]
    spans = [(end - h, end) for end, h in zip(ends, series, strict=True) if h > 2.0 * inside]
    moving = [np.linspace(begin + inside, end - inside, POINTS) for begin, end in spans]
    return np.concatenate([[-inside], *moving, [ends[-1]]])


def of_profiles(profiles: dict[str, Profile], unit: str, start: tuple[float, ...] | None = None) -> Curves:
    """Sampled by the library."""
    times = tuple(between_knots(profile.T) for profile in profiles.values())
    values = [np.array(profile.sample(at)) for at, profile in zip(times, profiles.values(), strict=True)]
    for states, position in zip(values, start or (), strict=False):
        states[0] += position
    return Curves(tuple(profiles), times, tuple(values), unit)


def time_optimal_to(distance: float) -> Curves:
    """Figures 6 to 8."""
    return of_profiles({"": time_optimal(distance, V, A, J)}, "units")


def in_time(inverse: Callable[..., Profile], t: float) -> Curves:
    """Figures 9 to 14."""
    return of_profiles({"": inverse(t, 100.0, V, A, J)}, "units")


def kingkong() -> Curves:
    """Figure 16, with the map that the paper's jerks belong to."""
    move = synchronise([b - a for a, b in zip(P1, P2, strict=True)], *KINGKONG, minimise="jerk")
    return of_profiles({f"axis {i + 1}": move.axis(i) for i in range(6)}, "deg", P1)


def pulses() -> Curves:
    """The two pulses, each at its shortest time."""
    shapes: tuple[Pulse, ...] = ("constant", "parabolic")
    return of_profiles({pulse: time_optimal(25.0, V, A, J, pulse=pulse) for pulse in shapes}, "units")


DRAWINGS: dict[str, Callable[[], Curves]] = {
    "figure-06": lambda: time_optimal_to(100.0),
    "figure-07": lambda: time_optimal_to(25.0),
    "figure-08": lambda: time_optimal_to(10.0),
    "figure-09": lambda: in_time(lowest_velocity, 7.0),
    "figure-10": lambda: in_time(lowest_velocity, 20.0),
    "figure-11": lambda: in_time(lowest_acceleration, 7.0),
    "figure-12": lambda: in_time(lowest_acceleration, 20.0),
    "figure-13": lambda: in_time(lowest_jerk, 7.0),
    "figure-14": lambda: in_time(lowest_jerk, 20.0),
    "figure-16": kingkong,
    "pulses": pulses,
}
TABLES: dict[str, Callable[[], str]] = {
    "mappings": mapping_table.main_table,
    "distances": mapping_table.size_table,
}


def marks(name: str) -> tuple[str, str]:
    """What stands around a table in the page."""
    return f"<!-- {name}: written by make figures -->\n", "\n<!-- end -->"


def table_in(page: str, name: str) -> str:
    """The table as it is in the page. ValueError without its marks."""
    begin, end = marks(name)
    first = page.index(begin) + len(begin)
    return page[first : page.index(end, first)]


def main() -> None:
    FIGURES.mkdir(exist_ok=True)
    for name, curves in DRAWINGS.items():
        plan_plot.write(plan_plot.draw(curves(), SIZE), FIGURES / f"{name}.svg")
    page = PAGE.read_text(encoding="utf-8")
    for name, table in TABLES.items():
        begin, _ = marks(name)
        page = page.replace(begin + table_in(page, name), begin + table())
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
