import json
import random
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.body.morphology import Morphology
from engine.search.viability import TIE, Member, ViabilityPopulation, fitness_of_merit, merit
from tests.support.made_up import examples

BODY = Morphology(5, (1, 2, 3))
seeds = st.integers(0, 2**32)
fitnesses = st.lists(st.floats(-0.1, 1.0).map(lambda f: f + 0.0), min_size=1, max_size=12)


def member(number, fitness, family=0):
    return Member(BODY, family, number, fitness)


def population(fitnesses, *, size=4, boundary_rate=0.1, families=None, **options):
    """Return a population that founders of these fitnesses have joined, each of its own family."""
    p = ViabilityPopulation(size=size, boundary_rate=boundary_rate, **options)
    p.tell([member(i, f, families[i] if families else i) for i, f in enumerate(fitnesses)])
    return p


def numbers(p):
    return [m.number for m in p.members]


# ---- the boundary


def test_the_boundary_starts_at_the_worst_founder_and_all_are_viable():
    p = population([0.5, 0.3, 0.6, 0.4])
    assert p.boundary == 0.6
    assert numbers(p) == [0, 1, 2, 3]


def test_who_is_worse_than_the_boundary_leaves_and_who_is_as_bad_stays():
    p = population([0.5, 0.3, 0.6, 0.4])
    p.tell([member(4, 0.60001), member(5, 0.6), member(6, 0.7), member(7, 0.2)])
    assert numbers(p) == [0, 1, 2, 3, 5, 7]
    assert p.boundary == 0.6


def test_the_boundary_rests_below_twice_the_initial_size():
    p = population([0.5, 0.3, 0.6, 0.4])
    p.tell([member(4, 0.2), member(5, 0.2), member(6, 0.2)])
    assert len(p.members) == 7
    assert p.boundary == 0.6


def test_at_twice_the_initial_size_it_moves_by_a_tenth_of_its_distance_to_the_best():
    p = population([0.5, 0.3, 0.6, 0.4])
    p.tell([member(i, 0.2) for i in range(4, 8)])
    # 0.6 - 0.1 (0.6 - 0.2) = 0.56: 2 leaves, seven are left
    assert p.boundary == pytest.approx(0.56, abs=1e-15)
    assert numbers(p) == [0, 1, 3, 4, 5, 6, 7]


def test_it_moves_again_until_the_population_is_below_twice_its_initial_size():
    p = population([0.5, 0.3, 0.5, 0.4])
    p.tell([member(i, 0.1) for i in range(4, 8)])
    # 0.5 -> 0.46: 0 and 2 leave
    assert p.boundary == pytest.approx(0.46, abs=1e-15)
    p.tell([member(8, 0.41), member(9, 0.45)])
    # 0.46 -> 0.424: 9 leaves
    assert p.boundary == pytest.approx(0.424, abs=1e-15)
    p.tell([member(10, 0.31)])
    # 0.424 -> 0.3916: 8 and 3 (0.4) leave
    assert p.boundary == pytest.approx(0.3916, abs=1e-15)
    assert numbers(p) == [1, 4, 5, 6, 7, 10]
    p = population([0.6, 0.30, 0.31, 0.32])
    p.tell([member(i, 0.1) for i in range(4, 9)])
    # 0.6 -> 0.55 leaves eight; 0.505, 0.4645, ... until 0.3 + something drops the first of the others
    steps = [0.6]
    while steps[-1] >= 0.32:
        steps.append(steps[-1] - 0.1 * (steps[-1] - 0.1))
    assert len(steps) == 9
    assert p.boundary == pytest.approx(steps[-1], abs=1e-14)
    assert numbers(p) == [1, 2, 4, 5, 6, 7, 8]


def test_another_rate_moves_it_by_another_part():
    p = population([0.5, 0.3, 0.6, 0.4], boundary_rate=0.5)
    p.tell([member(i, 0.2) for i in range(4, 8)])
    assert p.boundary == pytest.approx(0.4, abs=1e-15)
    assert numbers(p) == [1, 3, 4, 5, 6, 7]


def test_the_whole_distance_leaves_only_the_best():
    p = population([0.5, 0.3], size=2, boundary_rate=1.0)
    p.tell([member(2, 0.25), member(3, 0.25)])
    assert p.boundary == 0.25
    assert numbers(p) == [2, 3]
    # a difference that rounds must not carry the boundary past the best
    p = population([0.0, 0.25], size=2, boundary_rate=1.0)
    p.tell([member(2, -0.054319562424930454), member(3, 0.0)])
    assert p.boundary == -0.054319562424930454
    assert numbers(p) == [2]


def test_ties_at_the_boundary_are_cut_back_to_the_initial_size_youngest_first():
    p = population([0.3] * 4)
    p.tell([member(i, 0.3) for i in (4, 5, 6)])
    assert len(p.members) == 7
    p.tell([member(7, 0.3 - TIE / 2), member(8, 0.3)])
    assert numbers(p) == [5, 6, 7, 8]
    assert p.boundary == 0.3


@examples(60)
@given(st.integers(2, 6), st.lists(fitnesses, min_size=1, max_size=8), st.floats(0.05, 1.0))
def test_rules_that_always_hold(size, generations, rate):
    p = ViabilityPopulation(size=size, boundary_rate=rate)
    best, boundary, number = float("inf"), float("inf"), 0
    for generation in generations:
        new = [member(number + i, f) for i, f in enumerate(generation)]
        number += len(new)
        known = {m.number: m for m in (*p.members, *new)}
        p.tell(new)
        best = min([best, *generation])
        assert p.boundary is not None
        # the boundary never retreats and never passes the best, who always stays
        assert best <= p.boundary <= boundary
        assert min(m.fitness for m in p.members) == best
        boundary = p.boundary
        assert all(m.fitness <= boundary for m in p.members)
        assert len(p.members) < 2 * size
        assert numbers(p) == sorted(set(numbers(p)))
        assert all(known[m.number] == m for m in p.members)
        # nobody viable was sent away, except where only ties were left
        if max(m.fitness for m in p.members) - best > TIE:
            gone = set(known) - set(numbers(p))
            assert all(known[n].fitness > boundary for n in gone)


# ---- families


def test_founders_start_a_family_each():
    p = ViabilityPopulation(size=5)
    founders = p.candidates(random.Random(0))
    assert [c.family for c in founders] == [0, 1, 2, 3, 4]
    assert {c.parent for c in founders} == {None}


def test_families_are_drawn_with_probability_inverse_to_their_size():
    # sizes 1, 2 and 4: weights 1, 1/2, 1/4
    p = population([0.5] * 7, families=[0, 1, 1, 2, 2, 2, 2])
    assert p.family_probabilities() == pytest.approx({0: 4 / 7, 1: 2 / 7, 2: 1 / 7})


def test_a_family_that_died_out_has_no_probability():
    p = population([0.5, 0.3, 0.6, 0.4])
    p.tell([member(i, 0.2, family=1) for i in range(4, 8)])
    # sizes 1, 5, 1: weights 1, 1/5, 1
    assert p.family_probabilities() == pytest.approx({0: 5 / 11, 1: 1 / 11, 3: 5 / 11})


def test_mutants_come_from_families_and_members_as_often_as_they_should():
    n = 6000
    p = population([0.5] * 7, families=[0, 1, 1, 2, 2, 2, 2], n_mutants=n)
    mutants = p.candidates(random.Random(1))
    drawn = Counter(m.parent for m in mutants)
    families = [0, 1, 1, 2, 2, 2, 2]
    assert len(mutants) == n
    assert all(m.family == families[m.parent] for m in mutants)
    for number, expected in enumerate((4 / 7, 1 / 7, 1 / 7, *4 * (1 / 28,))):
        five_sigma = 5 * (n * expected * (1 - expected)) ** 0.5
        assert abs(drawn[number] - n * expected) < five_sigma


@examples(20)
@given(seeds)
def test_a_mutant_differs_from_its_parent(seed):
    p = population([0.5] * 4, n_mutants=30)
    assert all(m.morphology != BODY for m in p.candidates(random.Random(seed)))


def test_own_ways_to_draw_and_to_mutate():
    chain = [Morphology(1, (1, 1)), Morphology(1, (1, 1)), Morphology(2, (1, 1))]
    left = iter(chain)
    p = ViabilityPopulation(size=1, n_mutants=1, draw=lambda _: chain[0], mutate=lambda *_: next(left))
    assert [c.morphology for c in p.candidates(random.Random(0))] == chain[:1]
    p.tell([Member(chain[0], 0, 0, 0.5)])
    # the two that change nothing are tried over
    assert [c.morphology for c in p.candidates(random.Random(0))] == chain[2:]


# ---- failures, state


def test_without_a_success_the_population_is_founded_again_with_new_families():
    p = ViabilityPopulation(size=3)
    rng = random.Random(0)
    first = p.candidates(rng)
    p.tell([])
    assert p.members == ()
    assert p.boundary is None
    assert p.family_probabilities() == {}
    second = p.candidates(rng)
    assert [c.family for c in second] == [3, 4, 5]
    assert [c.morphology for c in second] != [c.morphology for c in first]


def test_few_surviving_founders_grow_to_twice_the_initial_size():
    p = population([0.5], size=4)
    p.tell([member(i, 0.4) for i in range(1, 7)])
    assert len(p.members) == 7
    assert p.boundary == 0.5


def test_a_generation_without_a_success_changes_nothing():
    p = population([0.5, 0.3, 0.6, 0.4])
    before = p.state()
    p.tell([])
    assert p.state() == before


@examples(20)
@given(seeds, st.lists(fitnesses, max_size=4))
def test_a_restored_population_goes_on_identically(seed, generations):
    one, other = ViabilityPopulation(size=3), ViabilityPopulation(size=3)
    number = 0
    for generation in generations:
        candidates = one.candidates(random.Random(number))
        one.tell(
            [
                Member(c.morphology, c.family, number + i, f)
                for i, (c, f) in enumerate(zip(candidates, generation, strict=False))
            ]
        )
        number += len(generation)
    other.restore(json.loads(json.dumps(one.state(), allow_nan=False)))
    assert other.state() == one.state()
    assert other.members == one.members
    assert other.candidates(random.Random(seed)) == one.candidates(random.Random(seed))
    assert other.state() == one.state()


# ---- the scale of the boundary


def test_the_boundary_moves_in_1_over_fitness_where_asked():
    # from 1/0.5 = 2 a tenth of the way to 1/0.25 = 4; who is at 0.5 leaves, and three are less than 2 x 2
    p = population([0.25, 0.5], size=2, maximise="inverse")
    p.tell([member(10, 0.43), member(11, 0.43)])
    assert p.boundary == pytest.approx(1 / 2.2)
    assert [m.fitness for m in p.members] == [0.25, 0.43, 0.43]


@examples(50)
@given(st.floats(-0.2, 2.0), st.floats(-0.2, 2.0))
def test_merits_keep_the_order_of_fitnesses_and_are_undone(one, other):
    for kind in ("negative", "inverse"):
        assert fitness_of_merit(merit(one, kind), kind) == pytest.approx(one, rel=1e-12, abs=1e-15)
        if one < other - 1e-9:
            assert merit(one, kind) > merit(other, kind)


def test_1_over_fitness_goes_on_as_a_straight_line_below_1_cm():
    assert merit(0.02, "inverse") == 50.0
    assert merit(0.01, "inverse") == 100.0
    assert merit(0.0, "inverse") == pytest.approx(200.0)
    assert merit(-0.01, "inverse") == pytest.approx(300.0)
