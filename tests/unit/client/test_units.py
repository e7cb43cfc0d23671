import math

import numpy as np
import pytest

from axisync_client import InvalidArgument, deg, mm, to_deg, to_mm
from axisync_client.units import as_floats


def test_degrees_of_values_a_sequence_and_an_array() -> None:
    expected = [math.radians(-90), math.radians(60)]
    assert deg(-90, 60).tolist() == expected
    assert deg([-90, 60]).tolist() == expected
    assert deg(np.array([-90, 60])).tolist() == expected
    assert deg(180).tolist() == [math.pi]


def test_degrees_and_back() -> None:
    assert to_deg(deg(12.5, -3.0)) == pytest.approx([12.5, -3.0], abs=1e-12)


def test_millimetres_and_back() -> None:
    assert mm(300, 0, -0.5).tolist() == [0.3, 0.0, -0.0005]
    assert mm([300]).tolist() == mm(300).tolist() == [0.3]
    assert to_mm(mm(12.5, -3.0)) == pytest.approx([12.5, -3.0], abs=1e-12)


@pytest.mark.parametrize("values", [(1, 2.5), [1, 2.5], np.array([1, 2.5]), np.array([1, 2.5], dtype=np.float32)])
def test_targets_become_tuples_of_plain_floats(values: object) -> None:
    target = as_floats(values, "target")  # type: ignore[arg-type]
    assert target == (1.0, 2.5)
    assert {type(value) for value in target} == {float}


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([0.0, math.nan], r"target\[1\]: nan is not finite"),
        ([math.inf], r"target\[0\]: inf is not finite"),
        (["1", "2"], "must be numbers"),
        ([True, False], "must be numbers"),
        ([], "shape"),
        ([[1.0, 2.0]], r"shape \(1, 2\)"),
        ([[1.0], [2.0, 3.0]], "flat sequence"),
        (1.0, "shape"),
    ],
)
def test_other_targets_are_refused_before_anything_is_sent(values: object, message: str) -> None:
    with pytest.raises(InvalidArgument, match=message):
        as_floats(values, "target")  # type: ignore[arg-type]
