import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.analysis.comparison import published
from engine.analysis.comparison.statistics import (
    MAX_TREND_POINTS,
    describe,
    trend,
)
from tests.support.made_up import examples


def test_statistics_by_hand():
    s = describe([2.0, 4.0, 4.0, 6.0, 9.0])
    assert (s.n, s.mean, s.min, s.max, s.median) == (5, 5.0, 2.0, 9.0, 4.0)
    assert s.std == pytest.approx(np.sqrt((9 + 1 + 1 + 1 + 16) / 4))
    assert describe([1.0, 2.0]).median == 1.5
    assert s.quartiles == (4.0, 6.0)
    assert describe([1.0, 2.0, 4.0, 8.0]).quartiles == (1.75, 5.0)


def test_one_value_has_no_spread_and_none_no_statistics():
    assert describe([3.0]).std is None
    with pytest.raises(ValueError, match="no value"):
        describe([])


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
