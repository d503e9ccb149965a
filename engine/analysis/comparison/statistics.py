"""Numbers about runs: descriptive statistics, trends over evaluations."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Final

import numpy as np

MAX_TREND_POINTS: Final = 400
"""Largest number of points of a drawn trend."""


@dataclasses.dataclass(frozen=True, slots=True)
class Statistics:
    """A measure over n runs, in its own unit.

    ``std`` is the sample's (n - 1), None for a single run; the authors' scripts divide by n. The quartiles
    lie between values where they must, in proportion.
    """

    n: int
    mean: float
    std: float | None
    min: float
    max: float
    median: float
    quartiles: tuple[float, float]


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
        quartiles=(float(np.quantile(v, 0.25)), float(np.quantile(v, 0.75))),
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
