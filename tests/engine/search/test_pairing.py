import random
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.search.vie_neat import pair_randomly, paired_fitness
from tests.support.made_up import examples

sizes = st.integers(1, 60)


@examples(100)
@given(sizes, sizes, st.integers(0, 2**32))
def test_everybody_is_paired_and_as_evenly_as_possible(n_left, n_right, seed):
    pairs = pair_randomly(n_left, n_right, random.Random(seed))
    assert len(pairs) == len(set(pairs)) == max(n_left, n_right)
    for n, side in ((n_left, 0), (n_right, 1)):
        counts = Counter(pair[side] for pair in pairs)
        assert set(counts) == set(range(n))
        assert max(counts.values()) - min(counts.values()) <= 1
        if n == max(n_left, n_right):
            assert set(counts.values()) == {1}


@pytest.mark.parametrize(("n_left", "n_right"), [(0, 3), (3, 0), (0, 0)])
def test_nobody_to_pair_with(n_left, n_right):
    assert pair_randomly(n_left, n_right, random.Random(0)) == []


def test_every_pair_is_as_likely_and_so_is_being_paired_twice():
    rng, n = random.Random(1), 4000
    pairs, twice = Counter(), Counter()
    for _ in range(n):
        drawn = pair_randomly(3, 4, rng)
        pairs.update(drawn)
        twice.update(k for k, count in Counter(left for left, _ in drawn).items() if count == 2)
    assert set(pairs) == {(i, k) for i in range(3) for k in range(4)}
    assert all(abs(count - n / 3) < 5 * (n * 2 / 9) ** 0.5 for count in pairs.values())
    assert all(abs(twice[i] - n / 3) < 5 * (n * 2 / 9) ** 0.5 for i in range(3))


@pytest.mark.parametrize(
    ("fitnesses", "expected"),
    [
        ([0.4], 0.4),
        ([0.2, 0.4], 0.35),  # mean 0.3, max 0.4
        ([0.1, 0.2, 0.6], 0.45),  # mean 0.3, max 0.6
        ([-0.1, 0.3], 0.2),
        ([0.5, 0.5], 0.5),
    ],
)
def test_paired_fitness_by_hand(fitnesses, expected):
    assert paired_fitness(fitnesses) == pytest.approx(expected, abs=1e-15)


@examples(50)
@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=5))
def test_paired_fitness_lies_between_the_mean_and_the_worst(fitnesses):
    f = paired_fitness(fitnesses)
    mean = sum(fitnesses) / len(fitnesses)
    assert mean - 1e-15 <= f <= max(fitnesses) + 1e-15
    assert str(f) != "-0.0"


@given(st.floats(-1.0, 1.0))
def test_a_single_partner_decides_to_the_last_bit(f):
    assert paired_fitness([f]) == f


def test_without_a_partner_there_is_no_fitness():
    with pytest.raises(ValueError, match="partner"):
        paired_fitness([])
