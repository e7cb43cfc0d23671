"""Axis positions to counts and back."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from axisync_schemas.cell import parse_cell
from axisync_service.mapper.counts import CountMap, unwrap_int32, wrap_int32
from support.cells import eod_text

TEXT = eod_text()


def test_a_turn_is_the_encoders_counts() -> None:
    axes = parse_cell(TEXT).axes[:2]
    assert CountMap(axes).to_counts(np.array([2 * math.pi, -math.pi])).tolist() == [1048576, -524288]


def test_gear_direction_and_offset() -> None:
    text = TEXT.replace("node_id = 1,", "node_id = 1, gear_ratio = 100, direction = -1, offset_deg = 90,", 1)
    axes = parse_cell(text.replace("counts_per_turn = 1048576", "counts_per_turn = 4096", 1)).axes[:1]
    counts = CountMap(axes).to_counts(np.array([math.pi]))
    assert counts.tolist() == [-102400]
    assert CountMap(axes).to_position(counts)[0] == pytest.approx(math.pi, abs=2 * math.pi / 409600 / 8)


@settings(derandomize=True, deadline=None)
@given(st.lists(st.floats(-3.2, 3.2), min_size=12, max_size=12))
def test_a_round_trip_is_within_half_a_count_and_an_eighth(position: list[float]) -> None:
    counts = CountMap(parse_cell(TEXT).axes)
    again = counts.to_position(counts.to_counts(np.array(position)))
    assert np.abs(again - position).max() <= 2 * math.pi / 1048576 * (0.5 + 0.125)


@settings(derandomize=True, deadline=None)
@given(
    st.lists(st.integers(-(2**40), 2**40), min_size=12, max_size=12), st.floats(-10.0, 10.0), st.sampled_from([1, -1])
)
def test_positions_are_short_and_their_counts_come_back(counts: list[int], offset: float, direction: int) -> None:
    text = TEXT.replace("node_id = 1,", f"node_id = 1, direction = {direction}, offset_deg = {offset},")
    both = CountMap(parse_cell(text).axes)
    position = both.to_position(np.array(counts))
    assert both.to_counts(position).tolist() == counts
    assert all((at * 2.0**20).is_integer() for at in position.tolist())


@settings(derandomize=True, deadline=None)
@given(st.integers(-(2**40), 2**40), st.integers(-(2**31) + 1, 2**31 - 1))
def test_wrapping_int32_never_jumps(count: int, step: int) -> None:
    assert unwrap_int32(wrap_int32(count + step), count) == count + step
