"""Nearest-rank percentiles of samples and histograms."""

import math
import random

import pytest
from percentiles import Distribution


@pytest.mark.parametrize(
    ("percent", "expected"), [(50, 500.0), (99, 990.0), (99.9, 999.0), (100, 1000.0), (0, 1.0), (99.91, 1000.0)]
)
def test_nearest_rank_of_one_to_a_thousand(percent: float, expected: float) -> None:
    samples = [float(i) for i in range(1, 1001)]
    random.Random(1).shuffle(samples)
    assert Distribution.of(samples).percentile(percent) == expected


def test_a_histogram_gives_what_its_samples_give() -> None:
    histogram = {1.0: 3, 7.5: 1, 4.0: 0, 2.0: 6}
    samples = [1.0] * 3 + [7.5] + [2.0] * 6
    for percent in (10, 30, 31, 50, 90, 91, 99.9):
        assert Distribution.of_histogram(histogram).percentile(percent) == Distribution.of(samples).percentile(percent)
    assert Distribution.of_histogram(histogram).total == 10


def test_without_samples_there_is_no_number() -> None:
    nothing = Distribution.of([])
    assert math.isnan(nothing.percentile(50))
    assert math.isnan(nothing.maximum)
    assert nothing.total == 0


def test_summary_names_what_it_holds() -> None:
    assert Distribution.of([1.0, 2.0]).summary(50, 99.9) == {"p50": 1.0, "p99.9": 2.0, "max": 2.0, "samples": 2.0}


def test_a_pause_costs_the_periods_that_pass_in_it() -> None:
    found = Distribution.of_histogram({1.0: 5, 2.0: 3, 7.0: 2})
    assert [found.periods_lost(period) for period in (1.0, 2.0, 3.5, 8.0)] == [25, 9, 4, 0]
    assert [found.periods_lost(2.0, latest) for latest in (0.5, 1.5, 1.999, 7.0)] == [16, 9, 9, 0]
