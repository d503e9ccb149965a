import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.analysis import published
from engine.analysis.statistics import (
    MAX_TREND_POINTS,
    describe,
    fewest_runs,
    rank_sum,
    smallest_rank_sum_p,
    trend,
)
from tests.support.made_up import examples


def test_statistics_by_hand():
    s = describe([2.0, 4.0, 4.0, 6.0, 9.0])
    assert (s.n, s.mean, s.min, s.max, s.median) == (5, 5.0, 2.0, 9.0, 4.0)
    assert s.std == pytest.approx(np.sqrt((9 + 1 + 1 + 1 + 16) / 4))
    assert describe([1.0, 2.0]).median == 1.5


def test_one_value_has_no_spread_and_none_no_statistics():
    assert describe([3.0]).std is None
    with pytest.raises(ValueError, match="no value"):
        describe([])


def test_rank_sum_gives_the_papers_p_for_ten_runs_that_beat_ten():
    # tables 4 to 7: 0.000157 is the smallest p-value of 10 against 10, and stands in one of them
    test = rank_sum(range(10), range(10, 20))
    assert test.p == pytest.approx(0.000157, abs=5e-7)
    assert test.p == pytest.approx(
        published.rank_sum_p("qd_score", "squeezing", "dm-me", "vie-neat"), abs=5e-7
    )
    assert test.significant
    assert test.sentence("A", "B") == "A and B differ."


def test_rank_sum_by_hand():
    # ranks of the first sample: 1, 3, 4, 6; W = 14, mean 4 * 9 / 2 = 18, variance 4 * 4 * 9 / 12 = 12
    from scipy.stats import norm

    test = rank_sum([1.0, 3.0, 4.0, 6.0], [2.0, 5.0, 7.0, 8.0])
    assert test.p == pytest.approx(2 * norm.cdf((14 - 18) / np.sqrt(12)))
    assert not test.significant
    assert test.sentence("A", "B") == "No difference between A and B is shown."


def test_too_few_runs_say_nothing_however_they_differ():
    assert smallest_rank_sum_p(1, 1) == 1.0
    assert smallest_rank_sum_p(3, 3) == pytest.approx(0.1)
    assert smallest_rank_sum_p(4, 4) == pytest.approx(2 / 70)
    assert smallest_rank_sum_p(2, 8) == pytest.approx(2 / 45)
    assert fewest_runs() == 4
    test = rank_sum([1.0, 2.0, 3.0], [10.0, 11.0, 12.0])
    assert test.p < 0.05  # the approximation would have it otherwise
    assert not test.enough
    assert not test.significant
    sentence = test.sentence("DM-ME", "MAP-Elites")
    assert sentence.startswith("3 runs of DM-ME and 3 runs of MAP-Elites are too few to say anything")
    assert "p would be 0.1" in sentence
    assert "4 of each" in sentence
    assert rank_sum([1.0], [2.0, 3.0]).sentence("A", "B").startswith("1 run of A and 2 runs of B")


def test_a_test_needs_two_samples():
    with pytest.raises(ValueError, match="two samples"):
        rank_sum([], [1.0])


def test_trend_by_hand():
    # steps last until the next one; only 20..30 is covered by both runs
    t = trend([([10, 20, 30], [1.0, 2.0, 3.0]), ([20, 25, 40], [4.0, 6.0, 8.0])])
    assert t.evaluations.tolist() == [20, 25, 30]
    assert t.mean.tolist() == [3.0, 4.0, 4.5]
    assert t.std == pytest.approx(np.array([2.0, 4.0, 3.0]) / np.sqrt(2))
    assert t.n == 2


def test_trend_of_one_run_and_of_none():
    t = trend([([5, 9], [0.5, 0.25])])
    assert (t.mean.tolist(), t.std.tolist()) == ([0.5, 0.25], [0.0, 0.0])
    assert trend([]).n == trend([([], [])]).n == 0


def test_runs_that_never_overlap_have_no_common_trend():
    assert not len(trend([([10, 20], [1.0, 2.0]), ([30, 40], [1.0, 2.0])]).evaluations)


def test_long_trends_are_thinned_and_keep_their_ends():
    x = list(range(5000))
    t = trend([(x, [float(i) for i in x])])
    assert len(t.evaluations) <= MAX_TREND_POINTS
    assert (t.evaluations[0], t.evaluations[-1]) == (0, 4999)
    assert (t.mean == t.evaluations).all()


steps = st.lists(
    st.tuples(st.integers(1, 50), st.floats(-1, 1)), min_size=1, max_size=8, unique_by=lambda s: s[0]
)


@given(st.lists(steps, min_size=1, max_size=4))
@examples(30)
def test_the_mean_lies_between_the_runs_everywhere(runs):
    runs = [([x for x, _ in sorted(r)], [y for _, y in sorted(r)]) for r in runs]
    t = trend(runs)
    for at, mean in zip(t.evaluations, t.mean, strict=True):
        values = [[y for x, y in zip(*r, strict=True) if x <= at][-1] for r in runs]
        assert min(values) - 1e-12 <= mean <= max(values) + 1e-12


def test_published_figures():
    assert published.statistics("best", "goal-reaching", "dm-me")["max"] == 39.36
    assert published.statistics("hours", "squeezing", "vie-neat") == {"mean": 70.9, "std": 6.07}
    assert published.statistics("best", "climbing", "dm-me") is None
    assert published.statistics("coverage", "squeezing", "dm-me") is None
    assert published.rank_sum_p("best", "goal-reaching", "map-elites", "vie-neat") == 0.034293
    assert published.rank_sum_p("best", "goal-reaching", "dm-me", "") is None
    assert (published.n_runs(), published.n_evaluations()) == (10, 45000)
