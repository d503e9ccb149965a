"""Numbers about runs: descriptive statistics, rank-sum tests, trends over evaluations."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy import stats

ALPHA: Final = 0.05
"""Level of significance, as in the paper."""
MAX_TREND_POINTS: Final = 400
"""Largest number of points of a drawn trend."""


@dataclasses.dataclass(frozen=True, slots=True)
class Statistics:
    """A measure over n runs, in its own unit; ``std`` is the sample's (n - 1), None for a single run."""

    n: int
    mean: float
    std: float | None
    min: float
    max: float
    median: float


def describe(values: Sequence[float]) -> Statistics:
    """Return the statistics of at least one value.

    Raises:
        ValueError: there is no value.
    """
    if not values:
        raise ValueError("no value to describe")
    v = np.asarray(values, dtype=float)
    return Statistics(
        n=len(v),
        mean=float(v.mean()),
        std=float(v.std(ddof=1)) if len(v) > 1 else None,
        min=float(v.min()),
        max=float(v.max()),
        median=float(np.median(v)),
    )


@dataclasses.dataclass(frozen=True, slots=True)
class RankSum:
    """A two-sided Wilcoxon rank-sum test of two samples.

    Attributes:
        n: sizes of the samples.
        p: p-value by the normal approximation without correction for ties, as the paper's are.
        smallest_p: the exact p-value if every value of one sample exceeded all of the other.
    """

    n: tuple[int, int]
    p: float
    smallest_p: float

    @property
    def enough(self) -> bool:
        """Whether samples of these sizes could show a difference at all."""
        return self.smallest_p <= ALPHA

    @property
    def significant(self) -> bool:
        """Whether the samples differ at ``ALPHA``; never if they are too small to show it."""
        return self.enough and self.p < ALPHA

    def sentence(self, first: str, second: str) -> str:
        """Say in a sentence what the test has shown.

        Args:
            first: name of the first sample.
            second: name of the second.
        """
        if not self.enough:
            return (
                f"{_runs(self.n[0])} of {first} and {_runs(self.n[1])} of {second} are too few to say"
                f" anything: even if all of one beat all of the other, p would be {self.smallest_p:.2g}."
                f" {fewest_runs()} of each are the fewest that could reach {ALPHA:g}."
            )
        if self.significant:
            return f"{first} and {second} differ."
        return f"No difference between {first} and {second} is shown."


def rank_sum(first: Sequence[float], second: Sequence[float]) -> RankSum:
    """Test whether two samples, neither of them empty, come from one distribution.

    Raises:
        ValueError: a sample is empty.
    """
    if not first or not second:
        raise ValueError("a rank-sum test needs two samples")
    p = float(stats.ranksums(first, second).pvalue)
    return RankSum((len(first), len(second)), p, smallest_rank_sum_p(len(first), len(second)))


def smallest_rank_sum_p(n: int, m: int) -> float:
    """Return the smallest exact two-sided p-value of samples of n and m: 2 of all ways to rank them."""
    return min(2.0 / math.comb(n + m, n), 1.0)


def fewest_runs() -> int:
    """Return the fewest runs of each of two algorithms that could differ at ``ALPHA``."""
    n = 1
    while smallest_rank_sum_p(n, n) > ALPHA:
        n += 1
    return n


def too_few_runs() -> str:
    """Say in a sentence that no test among some algorithms can show anything."""
    return (
        f"There are too few runs to say which algorithm is better: {fewest_runs()} of each of two are the"
        f" fewest whose difference could reach {ALPHA:g}, even if all of one beat all of the other."
    )


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Trend:
    """A measure over evaluations, over n runs.

    Attributes:
        n: how many runs.
        evaluations: (k,) at which it is known of all of them.
        mean: (k,).
        std: (k,) the sample's; zero for a single run.
    """

    n: int
    evaluations: np.ndarray
    mean: np.ndarray
    std: np.ndarray


def trend(runs: Sequence[tuple[Sequence[int], Sequence[float]]]) -> Trend:
    """Return the mean and the spread of steps that last until the next one.

    Only the span of evaluations that all runs cover counts: a mean over changing sets of runs would rise and
    fall for reasons that are not the algorithm's.

    Args:
        runs: of each run the numbers of evaluations, ascending, and the values reached by then.
    """
    runs = [r for r in runs if r[0]]
    if not runs:
        empty = np.empty(0)
        return Trend(0, empty, empty, empty)
    first, last = max(x[0] for x, _ in runs), min(x[-1] for x, _ in runs)
    at = np.unique(np.concatenate([np.asarray(x, dtype=float) for x, _ in runs]))
    at = at[(at >= first) & (at <= last)]
    if len(at) > MAX_TREND_POINTS:
        at = at[np.unique(np.linspace(0, len(at) - 1, MAX_TREND_POINTS).round().astype(int))]
    values = np.array([np.asarray(y)[np.searchsorted(x, at, side="right") - 1] for x, y in runs])
    if not len(at):  # no number of evaluations that all have reached
        return Trend(len(runs), at, at, at)
    std = values.std(axis=0, ddof=1) if len(runs) > 1 else np.zeros(len(at))
    return Trend(len(runs), at, values.mean(axis=0), std)


def _runs(n: int) -> str:
    return f"{n} run" if n == 1 else f"{n} runs"
