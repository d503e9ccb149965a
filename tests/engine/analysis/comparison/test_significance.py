import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from engine.analysis.comparison import published
from engine.analysis.comparison.significance import (
    effect_size,
    fewest,
    holm,
    rank_sum,
    signed_rank,
    smallest_rank_sum_p,
    smallest_signed_rank_p,
)
from tests.support.made_up import examples

# few values, so that many are equal
samples = st.lists(st.integers(0, 6).map(float), min_size=1, max_size=6)


def test_rank_sum_by_hand():
    # ranks of the first sample: 1, 2, 4; their sum is 7. Two of the 20 ways to choose three of six ranks
    # add up to 7 or less, 123 and 124. So p = 2 * 2 / 20.
    test = rank_sum([1.0, 2.0, 4.0], [3.0, 5.0, 6.0])
    assert test.p == pytest.approx(2 * 2 / 20)
    assert (test.kind, test.n, test.smallest_p) == ("rank-sum", (3, 3), 2 / 20)


def test_ten_runs_that_beat_ten():
    # tables 4 to 7 of the paper have 0.000157 for it, by the normal approximation
    test = rank_sum(range(10), range(10, 20))
    assert test.p == test.smallest_p == pytest.approx(2 / 184756)
    theirs = published.rank_sum_p("qd_score", "squeezing", "dm-me", "vie-neat")
    assert stats.ranksums(range(10), range(10, 20)).pvalue == pytest.approx(theirs, abs=5e-7)


def test_signed_rank_by_hand():
    # differences 3, -1, 2, 4: their ranks with signs. The positive ones add up to 9 of 10. Of 16 ways to give
    # signs two reach 9: all positive, and all but the 1. So p = 2 * 2 / 16.
    test = signed_rank([(4.0, 1.0), (1.0, 2.0), (5.0, 3.0), (5.0, 1.0)])
    assert test.p == pytest.approx(2 * 2 / 16)
    assert (test.kind, test.n, test.smallest_p) == ("signed-rank", (4, 4), 2 / 16)


@given(samples, samples)
@examples(60)
def test_rank_sum_is_what_dealing_out_all_ranks_gives(first, second):
    ranks = stats.rankdata([*first, *second])
    sums = [sum(c) for c in itertools.combinations(ranks, len(first))]
    found = sum(ranks[: len(first)])
    tails = [np.mean([s <= found + 1e-9 for s in sums]), np.mean([s >= found - 1e-9 for s in sums])]
    assert rank_sum(first, second).p == pytest.approx(min(1.0, 2 * min(tails)))


@pytest.mark.parametrize("seed", range(5))
def test_without_ties_the_tests_are_scipys_exact_ones(seed):
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=7), rng.normal(0.8, size=9)
    assert rank_sum(list(a), list(b)).p == pytest.approx(stats.mannwhitneyu(a, b, method="exact").pvalue)
    pairs = list(zip(a, b[:7], strict=True))
    assert signed_rank(pairs).p == pytest.approx(stats.wilcoxon(a, b[:7], method="exact").pvalue)


def test_with_ties_the_signed_rank_test_is_scipys_over_all_signs():
    pairs = [(1.0, 3.0), (2.0, 1.0), (5.0, 3.0), (4.0, 1.0), (6.0, 4.0), (2.0, 2.0)]
    differences = [a - b for a, b in pairs if a != b]
    theirs = stats.wilcoxon(differences, method=stats.PermutationMethod(n_resamples=10**5)).pvalue
    assert signed_rank(pairs).p == pytest.approx(theirs)
    assert signed_rank([(1.0, 1.0), (2.0, 2.0)]).p == 1.0


def test_many_values_are_tested_by_the_normal_approximation():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=40), rng.normal(0.5, size=40)
    assert rank_sum(list(a), list(b)).p == stats.mannwhitneyu(a, b, method="asymptotic").pvalue
    c = rng.normal(size=70)
    assert signed_rank([(v, 0.1) for v in c]).p == pytest.approx(
        stats.wilcoxon(c - 0.1, method="approx").pvalue
    )


def test_too_few_values_show_nothing_however_they_differ():
    assert smallest_rank_sum_p(1, 1) == 1.0
    assert smallest_rank_sum_p(4, 4) == pytest.approx(2 / 70)
    assert smallest_rank_sum_p(2, 8) == pytest.approx(2 / 45)
    assert smallest_signed_rank_p(1) == 1.0
    assert smallest_signed_rank_p(5) == 2 / 32
    assert not rank_sum([1.0, 2.0, 3.0], [10.0, 11.0, 12.0]).enough
    assert rank_sum([1.0, 2.0, 3.0, 4.0], [10.0, 11.0, 12.0, 13.0]).enough
    assert (fewest("rank-sum"), fewest("signed-rank")) == (4, 6)
    # 9 tests: 9 * 2 / comb(12, 6) is the first below 0.05, and 9 * 2 / 2**9
    assert (fewest("rank-sum", 9), fewest("signed-rank", 9)) == (6, 9)


def test_a_test_needs_values():
    with pytest.raises(ValueError, match="two samples"):
        rank_sum([], [1.0])
    with pytest.raises(ValueError, match="needs pairs"):
        signed_rank([])


def test_holm_by_hand():
    # 0.01 * 4, 0.02 * 3, 0.03 * 2, 0.04 * 1, and none less than the one before
    assert holm([0.04, 0.01, 0.03, 0.02]) == pytest.approx([0.06, 0.04, 0.06, 0.06])
    assert holm([0.4, 0.5]) == pytest.approx([0.8, 0.8])
    assert holm([0.9, 0.6]) == [1.0, 1.0]
    assert holm([]) == []


@given(st.lists(st.floats(0, 1), max_size=8))
@examples(50)
def test_holm_lies_between_no_correction_and_bonferronis(p_values):
    for p, corrected in zip(p_values, holm(p_values), strict=True):
        assert p <= corrected <= min(1.0, len(p_values) * p) + 1e-12


def test_effect_size_by_hand():
    # of 6 pairs: 1 > nothing; 3 > 2; 5 > 2, 3; one tie 3 = 3
    assert effect_size([1.0, 3.0, 5.0], [2.0, 3.0]).value == pytest.approx((0 + 1 + 0.5 + 2) / 6)
    beaten = effect_size([1.0, 2.0], [3.0, 4.0])
    assert (beaten.value, beaten.low, beaten.high) == (0.0, 0.0, 0.0)
    single = effect_size([1.0], [0.0, 1.0])
    assert (single.value, single.low, single.high) == (0.75, None, None)


@given(samples, samples)
@examples(30)
def test_effect_size_is_the_rank_sum_statistic_and_lies_in_its_interval(first, second):
    found = effect_size(first, second)
    assert found.value == pytest.approx(
        stats.mannwhitneyu(first, second).statistic / (len(first) * len(second))
    )
    assert effect_size(second, first).value == pytest.approx(1 - found.value)
    assert found == effect_size(first, second)  # the same interval every time
    if found.low is not None:
        assert found.low <= found.value + 1e-9
        assert found.value <= found.high + 1e-9


def test_the_interval_is_scipys_bootstrap():
    rng = np.random.default_rng(3)
    a = rng.normal(size=12)
    b = a + rng.normal(0.3, 0.2, size=12)  # pairs much alike: drawn together they differ less

    def a12(x, y):
        return float((np.asarray(x)[:, None] > np.asarray(y)[None]).mean())

    found = {}
    for paired in (False, True):
        rng = np.random.default_rng(1)
        theirs = stats.bootstrap(
            (a, b), a12, n_resamples=4000, method="percentile", paired=paired, vectorized=False, rng=rng
        ).confidence_interval
        found[paired] = effect_size(list(a), list(b), paired=paired)
        ours = (found[paired].low, found[paired].high)
        assert ours == pytest.approx((theirs.low, theirs.high), abs=0.03)
    assert found[True].high - found[True].low < 0.6 * (found[False].high - found[False].low)
