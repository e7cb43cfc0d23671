"""Percentiles of samples that may come with counts, as a histogram's do."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Distribution:
    """Sorted distinct values and how often each occurred; any unit."""

    values: NDArray[np.float64]
    counts: NDArray[np.int64]

    @classmethod
    def of(cls, samples: Sequence[float] | NDArray[np.float64]) -> "Distribution":
        """Of single samples."""
        values, counts = np.unique(np.asarray(samples, dtype=np.float64), return_counts=True)
        return cls(values, counts.astype(np.int64))

    @classmethod
    def of_histogram(cls, histogram: Mapping[float, int]) -> "Distribution":
        """Of value -> count; values that did not occur are left out."""
        present = sorted((value, count) for value, count in histogram.items() if count > 0)
        return cls(np.array([v for v, _ in present], dtype=np.float64), np.array([c for _, c in present], np.int64))

    @property
    def total(self) -> int:
        """Number of samples."""
        return int(self.counts.sum())

    def percentile(self, percent: float) -> float:
        """Nearest rank: the smallest value that at least `percent` % of the samples do not exceed; NaN without samples.

        Nothing is interpolated, so it is always a value that was measured.
        """
        if self.total == 0:
            return float("nan")
        # Exactly: 99.9 % of 1,000 samples is rank 999, while 0.999 * 1000 in floats may come out above it.
        rank = -(-Fraction(str(percent)) * self.total // 100)
        return float(self.values[int(np.searchsorted(self.counts.cumsum(), max(1, rank)))])

    @property
    def maximum(self) -> float:
        """Largest value; NaN without samples."""
        return float(self.values[-1]) if self.total else float("nan")

    def periods_lost(self, period: float, latest: float | None = None) -> int:
        """How many periods passed while a loop of that period woke up late, by these latenesses.

        A loop that goes on with the next period that is still to come has one sample for a pause of any length.
        `latest`: for how long after its begin a period can still be used; otherwise, for all of it.
        """
        lost = self.values // period if latest is None else np.ceil((self.values - latest) / period)
        return int((lost.clip(min=0) * self.counts).sum())

    def summary(self, *percents: float) -> dict[str, float]:
        """{"p50": ..., "max": ..., "samples": ...}."""
        result = {f"p{percent:g}": self.percentile(percent) for percent in percents}
        return {**result, "max": self.maximum, "samples": float(self.total)}
