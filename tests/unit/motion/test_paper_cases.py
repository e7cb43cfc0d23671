"""The numbers of section V.A of the MASA paper, as printed and to full precision."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisync_motion import (
    Profile,
    duration,
    lowest_acceleration,
    lowest_jerk,
    lowest_velocity,
    max_distance,
    time_optimal,
)

pytestmark = pytest.mark.usefixtures("each_backend")

LIMITS = (20.0, 20.0, 30.0)
CASES = {case["name"]: case for case in json.loads(Path(__file__).with_name("paper_cases.json").read_text())["cases"]}
MAPS = {"f_V^-1": lowest_velocity, "f_A^-1": lowest_acceleration, "f_J^-1": lowest_jerk}


def optimum() -> float:
    return duration(100.0, *LIMITS)


def inverse(name: str, t: float, distance: float = 100.0) -> Profile:
    return MAPS[name](t, distance, *LIMITS)


def expected_values() -> dict[str, Callable[[], Any]]:
    values: dict[str, Callable[[], Any]] = {
        "F S=100 T": lambda: time_optimal(100.0, *LIMITS).T,
        "F S=100 U": lambda: time_optimal(100.0, *LIMITS).U,
        "F S=0 T": lambda: time_optimal(0.0, *LIMITS).T,
        "t for S=100": optimum,
        "f_V^-1 tr=20 v_peak": lambda: inverse("f_V^-1", 20.0).peak_velocity,
        "f_J^-1 tr=20 a_peak": lambda: inverse("f_J^-1", 20.0).peak_acceleration,
    }
    for name in MAPS:
        values[f"{name} S=100 tr=f"] = lambda name=name: inverse(name, optimum()).T
        values[f"{name} S=100 tr=6.6667"] = lambda name=name: inverse(name, 6.6667).T
        for t in (7.0, 20.0):
            values[f"{name} S=100 tr={t:g} T"] = lambda name=name, t=t: inverse(name, t).T
            values[f"{name} S=100 tr={t:g} U"] = lambda name=name, t=t: inverse(name, t).U
        values[f"(85) {name} S=0 tr=1 T"] = lambda name=name: inverse(name, 1.0, 0.0).T
        values[f"(85) {name} S=0 tr=1 U"] = lambda name=name: inverse(name, 1.0, 0.0).U
    return values


VALUES = expected_values()
# The file holds the Cartesian example too, which belongs to the arm's kinematics.
OF_AN_ARM = {"L = |0.38-0.5710|", "FK x,y", "FK Euler (ZYZ intrinsic)"}


def test_every_case_is_tested() -> None:
    assert set(VALUES) == set(CASES) - OF_AN_ARM


@pytest.mark.parametrize("name", VALUES)
def test_case(name: str) -> None:
    case = CASES[name]
    value = np.asarray(VALUES[name]())
    assert value == pytest.approx(np.asarray(case["computed"]), rel=1e-14, abs=2e-15)
    # Half a unit of the last digit printed; a time given with four decimals moves the digits of T further.
    digits = 3e-4 if "6.6667" in name else 5.1e-5
    assert value == pytest.approx(np.asarray(case["printed"]), abs=digits)


def test_line_length_case_plans() -> None:
    """Section V.B.2: the line and the three angles, minimum times to the 5 digits that are known."""
    length = CASES["L = |0.38-0.5710|"]["computed"]
    assert duration(length, 0.15, 0.2, 0.3) == pytest.approx(2.73172, abs=5e-6)
    assert duration(30.0, 30.0, 40.0, 80.0) == pytest.approx(2.30278, abs=5e-6)
    assert duration(45.0, 30.0, 40.0, 80.0) == pytest.approx(2.75, rel=1e-14)
    assert duration(20.0, 30.0, 40.0, 80.0) == pytest.approx(2.0, rel=1e-14)


@pytest.mark.parametrize("distance", [100.0, 25.0, 10.0, 1e-9])
def test_max_distance_inverts_duration(distance: float) -> None:
    """(44): one distance for each of its three branches, and a tiny one."""
    assert max_distance(duration(distance, *LIMITS), *LIMITS) == pytest.approx(distance, rel=1e-14)


def test_opposite_direction_only_changes_signs() -> None:
    there, back = time_optimal(100.0, *LIMITS), time_optimal(-100.0, *LIMITS)
    assert back.T == there.T
    assert tuple(-u for u in there.U) == back.U
    assert back.distance == -100.0


def test_acceleration_out_of_reach_is_capped() -> None:
    """(23): A = 100 cannot be reached within V = 2 at J = 30; sqrt(60) can."""
    profile = time_optimal(10.0, 2.0, 100.0, 30.0)
    assert profile.peak_acceleration == pytest.approx(60.0**0.5, rel=1e-15)
    assert profile.T[1] == pytest.approx(0.0, abs=1e-16)
    assert profile.peak_velocity == pytest.approx(2.0, rel=1e-15)
