"""Whether two groups of runs differ, and by how much: rank tests, effect sizes, many tests at once.

The tests are exact: a p-value is twice the share of all ways to deal out the ranks whose sum is as small, or
as large, as the one found. Equal values share the mean of their ranks.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
from scipy import stats

ALPHA: Final = 0.05
"""Level of significance, as in the paper."""
CONFIDENCE: Final = 0.95
"""Of the intervals."""
RESAMPLES: Final = 2000
"""Samples that an interval is made from."""
_SEED: Final = 20210710
"""Of the samples; any fixed number gives the same interval every time."""
_MOST_EXACT: Final = 60
"""Values up to which all ways to deal out the ranks are counted; above, the normal approximation is good."""

TestKind = Literal["signed-rank", "rank-sum"]


@dataclasses.dataclass(frozen=True, slots=True)
class RankTest:
    """A two-sided test of two samples.

    Attributes:
        kind: ``signed-rank`` of pairs (Wilcoxon) or ``rank-sum`` (Mann-Whitney).
        n: sizes of the samples; of pairs, twice their number.
        p: p-value.
        smallest_p: of samples of these sizes, if all of one exceeded all of the other.
    """

    kind: TestKind
    n: tuple[int, int]
    p: float
    smallest_p: float

    @property
    def enough(self) -> bool:
        """Whether samples of these sizes could show a difference at all."""
        return self.smallest_p <= ALPHA


def rank_sum(first: Sequence[float], second: Sequence[float]) -> RankTest:
    """Test whether two samples, neither of them empty, come from one distribution (Mann-Whitney).

    Raises:
        ValueError: a sample is empty.
    """
    if not first or not second:
        raise ValueError("a rank-sum test needs two samples")
    n, m = len(first), len(second)
    if n + m > _MOST_EXACT:
        p = float(stats.mannwhitneyu(first, second, method="asymptotic").pvalue)
    else:
        ranks = _doubled_ranks([*first, *second])
        # ways[k, w]: to choose k of the ranks so that they add up to w
        ways = np.zeros((n + 1, sum(ranks) + 1))
        ways[0, 0] = 1.0
        for rank in ranks:
            ways[1:, rank:] += ways[:-1, : ways.shape[1] - rank].copy()
        p = _two_sided(ways[n], sum(ranks[:n]))
    return RankTest("rank-sum", (n, m), p, smallest_rank_sum_p(n, m))


def signed_rank(pairs: Sequence[tuple[float, float]]) -> RankTest:
    """Test whether the differences of pairs lie about zero (Wilcoxon).

    Pairs without a difference are left out, as Wilcoxon did.

    Raises:
        ValueError: there is no pair.
    """
    if not pairs:
        raise ValueError("a signed-rank test needs pairs")
    differences = [a - b for a, b in pairs if a != b]
    n = len(pairs)
    if not differences:
        p = 1.0
    elif len(differences) > _MOST_EXACT:
        p = float(stats.wilcoxon(differences, method="approx").pvalue)
    else:
        ranks = _doubled_ranks([abs(d) for d in differences])
        # ways[w]: to give the ranks signs so that the positive ones add up to w
        ways = np.zeros(sum(ranks) + 1)
        ways[0] = 1.0
        for rank in ranks:
            ways[rank:] += ways[: len(ways) - rank].copy()
        positive = sum(r for r, d in zip(ranks, differences, strict=True) if d > 0.0)
        p = _two_sided(ways, positive)
    return RankTest("signed-rank", (n, n), p, smallest_signed_rank_p(n))


def _doubled_ranks(values: Sequence[float]) -> list[int]:
    """Return twice the ranks of values, which are whole numbers even where values share a rank."""
    return [round(2.0 * r) for r in stats.rankdata(values)]


def _two_sided(ways: np.ndarray, found: int) -> float:
    """Return twice the share of ways whose sum, their index, is at most, or at least, the one found."""
    return min(1.0, 2.0 * float(min(ways[: found + 1].sum(), ways[found:].sum()) / ways.sum()))


def smallest_rank_sum_p(n: int, m: int) -> float:
    """Return the smallest two-sided p-value of samples of n and m: 2 of all ways to rank them."""
    return min(2.0 / math.comb(n + m, n), 1.0)


def smallest_signed_rank_p(n: int) -> float:
    """Return the smallest two-sided p-value of n pairs: 2 of all ways to sign their differences."""
    return min(2.0 / 2**n, 1.0)


def fewest(kind: TestKind, n_tests: int = 1) -> int:
    """Return the fewest runs of each of two groups, or pairs, whose difference could reach ``ALPHA``.

    Args:
        kind: of the test.
        n_tests: of the family, by Holm's correction.
    """
    n = 1
    while (
        n_tests * (smallest_signed_rank_p(n) if kind == "signed-rank" else smallest_rank_sum_p(n, n)) > ALPHA
    ):
        n += 1
    return n


def holm(p_values: Sequence[float]) -> list[float]:
    """Return the p-values of a family of tests, corrected for their number.

    The smallest of k counts k times, the next k - 1 times and so on, none less than a smaller one: the
    chance that any of them falls below ``ALPHA`` by luck is then at most ``ALPHA`` (Holm, "A simple
    sequentially rejective multiple test procedure", Scandinavian Journal of Statistics 1979).
    """
    corrected = [0.0] * len(p_values)
    so_far = 0.0
    for k, i in enumerate(sorted(range(len(p_values)), key=lambda i: p_values[i])):
        so_far = max(so_far, min(1.0, (len(p_values) - k) * p_values[i]))
        corrected[i] = so_far
    return corrected


@dataclasses.dataclass(frozen=True, slots=True)
class EffectSize:
    """How often a value of one sample exceeds one of another, ties counting half.

    A of Vargha and Delaney, "A critique and improvement of the CL common language effect size statistics of
    McGraw and Wong", Journal of Educational and Behavioral Statistics 2000: 0.5 where neither is larger, 1
    where all of the first exceed all of the second.

    Attributes:
        value: from 0 to 1.
        low, high: its bootstrap interval of ``CONFIDENCE``; None where a sample is a single value.
    """

    value: float
    low: float | None
    high: float | None


def effect_size(first: Sequence[float], second: Sequence[float], *, paired: bool = False) -> EffectSize:
    """Return A12 of two samples, neither of them empty, with its interval.

    The interval is the percentile bootstrap's. It is a single point where all of one sample exceed all of
    the other: so few values cannot show how much the two might overlap.

    Args:
        first: one sample.
        second: the other.
        paired: whether values in the same place belong together, and are drawn together.
    """
    a, b = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    value = float(_a12(a[None], b[None])[0])
    if len(a) < 2 or len(b) < 2:
        return EffectSize(value, None, None)
    rng = np.random.default_rng(_SEED)
    of_a = rng.integers(0, len(a), size=(RESAMPLES, len(a)))
    of_b = of_a if paired else rng.integers(0, len(b), size=(RESAMPLES, len(b)))
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.quantile(_a12(a[of_a], b[of_b]), [tail, 1.0 - tail])
    return EffectSize(value, float(low), float(high))


def _a12(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return A12 of (k, n) and (k, m) samples, (k,)."""
    difference = first[:, :, None] - second[:, None, :]
    return ((difference > 0).mean(axis=(1, 2)) + (difference == 0).mean(axis=(1, 2)) / 2).astype(float)
