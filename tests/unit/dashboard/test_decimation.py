"""A few samples a second that keep the peaks, and the histogram of lateness."""

import numpy as np
import pytest

from axisync_client import Setpoints
from axisync_dashboard.decimation import LATENESS_EDGES_US, QUANTITIES, WINDOW_S, Decimator, Histogram
from axisync_schemas.ticks import TickLayout

LAYOUT = TickLayout(2, 1)
PERIOD_S = 0.002


def batch(first: int, count: int) -> Setpoints:
    """Ticks at 2 ms: axis 1 is at 1 rad a second, actuals follow a tick later; axis 2 stands."""
    records = np.repeat(LAYOUT.new()[None], count)
    ticks = np.arange(first, first + count)
    records["tick"] = ticks
    records["cycle_start_ns"] = (ticks * PERIOD_S * 1e9).astype(np.int64)
    records["position"][:, 0] = ticks * PERIOD_S
    records["position_actual"][:, 0] = (ticks - 1) * PERIOD_S
    records["velocity"][:, 0] = 1.0
    return Setpoints(1, records, ("a", "b"), ("g",))


def test_one_sample_for_each_window_however_the_ticks_are_batched() -> None:
    whole, parts = Decimator(), Decimator()
    expected = whole.add(batch(0, 500))
    got = [sample for first in range(0, 500, 7) for sample in parts.add(batch(first, min(7, 500 - first)))]
    assert len(expected) == pytest.approx(500 * PERIOD_S / WINDOW_S, abs=1)
    assert [time for time, _ in got] == [time for time, _ in expected]
    np.testing.assert_allclose([v for _, v in got], [v for _, v in expected])
    assert [time for time, _ in expected] == sorted({time for time, _ in expected})


def test_a_peak_of_one_tick_is_kept_with_its_sign() -> None:
    ticks = batch(0, 100)
    ticks.records["jerk"][30, 1] = -80.0
    jerks = [values[QUANTITIES.index("jerk")][1] for _, values in Decimator().add(ticks)]
    assert min(jerk for jerk in jerks if jerk is not None) == -80.0
    assert sum(jerk != 0.0 for jerk in jerks) == 1


def test_the_error_is_of_the_setpoint_at_the_sample_before() -> None:
    samples = Decimator().add(batch(1, 200))
    errors = [values[QUANTITIES.index("error")][0] for _, values in samples[1:]]
    assert errors == [0.0] * len(errors)


def test_what_is_not_known_is_null() -> None:
    ticks = batch(0, 50)
    ticks.records["position_actual"][:, 1] = np.nan
    (_, values), *_ = Decimator().add(ticks)
    assert values[QUANTITIES.index("actual")][1] is None
    assert values[QUANTITIES.index("position")][1] == 0.0


def test_lateness_is_counted_in_bins_and_forgotten() -> None:
    histogram, ticks = Histogram(), batch(0, 10)
    ticks.records["lateness_ns"][:] = 60_000
    ticks.records["lateness_ns"][0] = -5
    ticks.records["lateness_ns"][1] = 50_000_000
    ticks.records["skipped"][2] = 1
    histogram.add(ticks)
    counts = histogram.counts()
    assert (counts[0], counts[-1], counts[LATENESS_EDGES_US.index(50.0)]) == (1, 1, 7)
    histogram.add(batch(round(60 / PERIOD_S), 5))
    assert sum(histogram.counts()) == 5
