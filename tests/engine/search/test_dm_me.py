import copy
import dataclasses
import json
import random
from collections import Counter

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from engine.config import RunConfig, replaced
from engine.errors import InvalidData
from engine.search.dm_me import DoubleMapMapElites
from engine.search.map_search import PAPER_REFITS, MapSearchConfig
from engine.search.variation import PUBLISHED
from tests.support.expected_map import ExpectedMap, compete, numbers
from tests.support.made_up import (
    REFITS,
    describe,
    evaluate,
    examples,
    generation,
    held,
    made_up_evaluation,
    map_search,
    nothing_else,
)

seeds = st.integers(0, 2**32)


def create(seed=0, **changes):
    return map_search(DoubleMapMapElites, seed, **changes)


class TwoMaps:
    """What the two archives should hold."""

    def __init__(self):
        self.morphology = {}
        self.trajectories = ExpectedMap(REFITS)

    def tell(self, number, evaluations):
        whole = [e for e in evaluations if e.fitness is not None]
        for e in whole:
            m = e.solution.morphology
            compete(self.morphology, (m.n_modules - 2, m.stiffness_level - 1), e)
        self.trajectories.tell(number, whole)

    def held(self):
        return {"morphology": numbers(self.morphology), "controller": numbers(self.trajectories.cells)}


@examples(15)
@given(seeds, st.sampled_from([0.0, 0.2, 0.5]))
def test_both_archives_hold_what_they_should(seed, failing):
    algorithm, expected = create(seed), TwoMaps()
    for number in range(9):
        solutions = algorithm.ask()
        # a generation 0 of which too little succeeds is repeated, so that the budget may end early
        assume(solutions)
        evaluations = evaluate(solutions, seed, failing)
        algorithm.tell(evaluations)
        expected.tell(number, evaluations)
        assume(expected.trajectories.meaningful)
        assert held(algorithm.archives) == expected.held()
        assert algorithm.generation == number + 1


@examples(15)
@given(seeds, st.sampled_from([0.0, 0.3]))
def test_the_projection_is_fitted_at_scheduled_generations_only(seed, failing):
    algorithm = create(seed)
    before = None
    for number in range(9):
        generation(algorithm, salt=seed, failing=failing)
        after = algorithm.state()["descriptor"]
        projection = {k: after[k] for k in ("mean", "scale", "components")}
        assert (projection != before) == (number in REFITS)
        before = projection


@examples(20)
@given(seeds)
def test_bounds_move_only_on_a_refit_or_for_a_value_outside(seed):
    algorithm = create(seed)
    generation(algorithm, salt=seed)
    for number in range(1, 9):
        before = algorithm.state()["descriptor"]
        elites = algorithm.archives["controller"].elites()
        evaluations = evaluate(algorithm.ask(), salt=seed)
        described, inside, _ = describe(algorithm, [*elites, *evaluations])
        algorithm.tell(evaluations)
        after = algorithm.state()["descriptor"]
        if number in REFITS:
            continue
        if inside.all():
            assert after == before
            continue
        low, high = described.min(axis=0), described.max(axis=0)
        width = (high - low) / np.array([8, 9])
        np.testing.assert_allclose(after["width"], width, rtol=1e-9)
        np.testing.assert_allclose(after["lower"], low - width / 2, rtol=1e-9, atol=1e-9)


def test_both_reasons_for_moving_bounds_occur():
    # what the tests above rely on: values inside and outside, on and off schedule
    seen = Counter()
    for seed in range(5):
        algorithm, expected = create(seed), TwoMaps()
        for number in range(9):
            expected.tell(number, generation(algorithm, salt=seed))
            seen[expected.trajectories.refitted, expected.trajectories.rebounded] += 1
    assert seen[True, True]
    assert seen[False, True]
    assert seen[False, False]


@examples(20)
@given(seeds)
def test_every_elite_sits_in_the_cell_that_describes_it(seed):
    algorithm = create(seed)
    for _ in range(9):
        generation(algorithm, salt=seed)
        for cell, e in algorithm.archives["morphology"]:
            m = e.solution.morphology
            assert cell == (m.n_modules - 2, m.stiffness_level - 1)
        placed = list(algorithm.archives["controller"])
        _, inside, cells = describe(algorithm, [e for _, e in placed])
        assert inside.all()
        assert cells == [cell for cell, _ in placed]


def test_the_published_schedule():
    assert PAPER_REFITS == (0, 50, 150, 350, 750, 1550)
    algorithm = DoubleMapMapElites(MapSearchConfig(), n_inputs=2, budget=45_000)
    assert len(algorithm.ask()) == 1080
    assert {name: a.shape for name, a in algorithm.archives.items()} == {
        "morphology": (9, 10),
        "controller": (9, 10),
    }


@examples(10)
@given(seeds)
def test_half_of_the_parents_come_from_each_archive(seed):
    algorithm = create(seed, batch_size=10, budget=52)
    generation(algorithm, salt=seed)
    for _ in range(4):
        numbers = {name: set(cells.values()) for name, cells in held(algorithm.archives).items()}
        elites = {e.solution.number: e.solution for a in algorithm.archives.values() for e in a.elites()}
        solutions = algorithm.ask()
        assert Counter(s.source for s in solutions) == {"morphology": 5, "controller": 5}
        assert all(s.parent in numbers[s.source] for s in solutions)
        assert all(s.parent in elites for s in solutions)
        algorithm.tell(evaluate(solutions, salt=seed))


@pytest.mark.parametrize(("share", "from_controller"), [(0.0, 0), (0.25, 2), (0.5, 5), (1.0, 10)])
def test_another_share_of_the_parents_comes_from_the_controller_archive(share, from_controller):
    algorithm = create(3, batch_size=10, budget=22, controller_share=share)
    generation(algorithm)
    sources = Counter(s.source for s in algorithm.ask())
    assert (sources["controller"], sources["morphology"]) == (from_controller, 10 - from_controller)


def test_a_share_beyond_all_is_refused():
    for share in (-0.1, 1.5):
        with pytest.raises(InvalidData, match=f"controller_share must be from 0 to 1, not {share}"):
            create(3, controller_share=share)


def test_parents_are_drawn_uniformly_from_the_elites_of_their_archive():
    algorithm = create(3, initial=30, batch_size=1500, budget=1530)
    generation(algorithm)
    numbers = held(algorithm.archives)
    drawn = {"morphology": Counter(), "controller": Counter()}
    for s in algorithm.ask():
        drawn[s.source][s.parent] += 1
    for name, cells in numbers.items():
        p = 1 / len(cells)
        five_sigma = 5 * (750 * p * (1 - p)) ** 0.5
        assert set(drawn[name]) <= set(cells.values())
        assert all(abs(drawn[name][k] - 750 * p) < five_sigma for k in cells.values())


def test_a_mutation_changes_what_it_names_and_always_something():
    n = 1500
    algorithm = create(5, batch_size=n, budget=12 + n)
    parents = {e.solution.number: e.solution for e in generation(algorithm)}
    children = algorithm.ask()
    for child in children:
        parent = parents[child.parent]
        changed = (
            child.morphology != parent.morphology,
            child.controller != parent.controller,
        )
        if child.operator == "morphology":
            assert changed == (True, False)
        elif child.operator == "controller":
            assert changed == (False, True)
        else:
            assert any(changed)
    kinds = Counter(child.operator for child in children)
    assert set(kinds) == {"morphology", "controller", "both"} == set(PUBLISHED.operators)
    # a third each; five standard deviations are 91
    assert all(abs(kinds[k] - n / 3) < 91 for k in kinds)
    # with "both", a body stays what it was only by chance, and rarely
    both = [c for c in children if c.operator == "both"]
    assert sum(c.morphology != parents[c.parent].morphology for c in both) > len(both) / 2
    assert sum(c.controller != parents[c.parent].controller for c in both) > len(both) * 0.9


def test_random_solutions_have_no_parent_and_mutants_do():
    algorithm = create()
    solutions = algorithm.ask()
    assert {(s.parent, s.operator, s.source) for s in solutions} == {(None, "random", None)}
    algorithm.tell(evaluate(solutions))
    assert all(s.parent is not None and s.source for s in algorithm.ask())


@pytest.mark.parametrize(
    ("budget", "sizes"), [(12, [12]), (13, [12, 1]), (24, [12, 6, 6]), (27, [12, 6, 6, 3])]
)
def test_the_budget_is_spent_exactly(budget, sizes):
    algorithm = create(budget=budget)
    asked = []
    while solutions := algorithm.ask():
        asked.append(solutions)
        algorithm.tell(evaluate(solutions))
    assert [len(s) for s in asked] == sizes
    assert [s.number for batch in asked for s in batch] == list(range(budget))
    assert algorithm.ask() == []


def test_a_last_odd_batch_is_shared_as_evenly_as_possible():
    algorithm = create(budget=12 + 5)
    generation(algorithm)
    sources = Counter(s.source for s in algorithm.ask())
    assert sorted(sources.values()) == [2, 3]


@examples(8)
@given(seeds, st.randoms(use_true_random=False))
def test_the_order_of_evaluations_does_not_matter(seed, rng):
    one, other = create(seed), create(seed)
    for _ in range(4):
        evaluations = generation(one, salt=seed)
        assert [e.solution for e in evaluations] == other.ask()
        rng.shuffle(evaluations)
        other.tell(evaluations)
        assert held(one.archives) == held(other.archives)
        assert one.state() == other.state()


@examples(5)
@given(seeds)
def test_equal_seeds_give_equal_searches(seed):
    one, other, different = create(seed), create(seed), create(seed + 1)
    for _ in range(4):
        assert repr(generation(one)) == repr(generation(other))
        generation(different)
    assert one.state() == other.state()
    assert one.state() != different.state()


def test_asking_twice_is_refused():
    algorithm = create()
    algorithm.ask()
    with pytest.raises(ValueError, match="tell"):
        algorithm.ask()


def missing(evaluations):
    return evaluations[:-1]


def additional(evaluations):
    stranger = dataclasses.replace(evaluations[0].solution, number=999)
    return [*evaluations, made_up_evaluation(stranger)]


def repeated(evaluations):
    return [*evaluations[:-1], evaluations[0]]


def twice(evaluations):
    return [*evaluations, evaluations[0]]


def exchanged(evaluations):
    first, second = evaluations[0].solution, evaluations[1].solution
    stranger = dataclasses.replace(first, controller=second.controller)
    return [made_up_evaluation(stranger), *evaluations[1:]]


def none(evaluations):
    return []


@pytest.mark.parametrize("damage", [missing, additional, repeated, twice, exchanged, none])
@pytest.mark.parametrize("at", [0, 2])
def test_wrong_evaluations_are_refused_and_change_nothing(damage, at):
    algorithm, undisturbed = create(1), create(1)
    for _ in range(at):
        generation(algorithm)
        generation(undisturbed)
    evaluations = evaluate(algorithm.ask())
    with pytest.raises(ValueError, match="exactly the solutions asked for"):
        algorithm.tell(damage(evaluations))
    assert algorithm.generation == at
    algorithm.tell(evaluations)
    generation(undisturbed)
    assert held(algorithm.archives) == held(undisturbed.archives)
    assert algorithm.state() == undisturbed.state()


def test_evaluations_of_the_last_generation_are_refused():
    algorithm = create()
    old = generation(algorithm)
    algorithm.ask()
    with pytest.raises(ValueError, match="exactly the solutions asked for"):
        algorithm.tell(old)


def test_failed_evaluations_enter_no_archive():
    algorithm = create()
    evaluations = evaluate(algorithm.ask(), failing=0.5)
    failed = {e.solution.number for e in evaluations if e.fitness is None}
    assert 0 < len(failed) < 12
    algorithm.tell(evaluations)
    for cells in held(algorithm.archives).values():
        assert cells
        assert not failed & set(cells.values())


@pytest.mark.parametrize("n_whole", [0, 1])
def test_solutions_stay_random_until_there_is_something_to_project(n_whole):
    algorithm = create()
    evaluations = evaluate(algorithm.ask())
    broken = [dataclasses.replace(e, fitness=None, failure="x") for e in evaluations[n_whole:]]
    algorithm.tell([*evaluations[:n_whole], *broken])
    assert algorithm.state()["descriptor"] is None
    again = algorithm.ask()
    assert {s.operator for s in again} == {"random"}
    assert [s.number for s in again] == list(range(12, 24))
    algorithm.tell(evaluate(again))
    assert {s.operator for s in algorithm.ask()} <= set(PUBLISHED.operators)


def test_a_generation_of_failures_only_changes_no_archive():
    algorithm = create()
    generation(algorithm)
    before = held(algorithm.archives)
    generation(algorithm, failing=1.0)
    assert held(algorithm.archives) == before
    assert algorithm.generation == 2


@examples(10)
@given(
    seeds,
    st.integers(0, 6),
    st.sampled_from([0.0, 0.3]),
    st.sampled_from(["positions", "displacements"]),
)
def test_a_restored_search_goes_on_identically(seed, n, failing, sensory):
    original = create(seed, sensory=sensory)
    for _ in range(n):
        generation(original, salt=seed, failing=failing)
    state = json.loads(json.dumps(original.state(), allow_nan=False))
    contents = {name: dict(archive) for name, archive in original.archives.items()}
    # the seed given here must not matter any more
    restored = create(seed + 1, sensory=sensory)
    restored.restore(state, copy.deepcopy(contents), nothing_else)
    assert restored.generation == n
    assert held(restored.archives) == held(original.archives)
    assert restored.state() == original.state()
    for _ in range(8 - n):
        one, other = original.ask(), restored.ask()
        assert repr(one) == repr(other)
        original.tell(evaluate(one, seed, failing))
        restored.tell(evaluate(other, seed, failing))
        assert held(original.archives) == held(restored.archives)
        assert original.state() == restored.state()
        assert original.axes("controller") == restored.axes("controller")


def test_an_interrupted_generation_is_asked_for_again():
    original, restored = create(4), create(4)
    for _ in range(3):
        generation(original)
    state = json.loads(json.dumps(original.state()))
    contents = {name: dict(archive) for name, archive in original.archives.items()}
    lost = original.ask()
    restored.restore(state, contents, nothing_else)
    assert repr(restored.ask()) == repr(lost)


def test_displacements_describe_other_cells_than_positions():
    one, other = create(2), create(2, sensory="displacements")
    generation(one)
    generation(other)
    assert held(one.archives)["morphology"] == held(other.archives)["morphology"]
    assert held(one.archives)["controller"] != held(other.archives)["controller"]


def test_axes_for_people():
    algorithm = create()
    generation(algorithm)
    modules, stiffness = algorithm.axes("morphology")
    # cell centres are 2..10 modules and 0.1..1.0
    for axis, first, last in ((modules, 2, 10), (stiffness, 0.1, 1.0)):
        cell = (axis.upper - axis.lower) / axis.n
        assert axis.lower + cell / 2 == pytest.approx(first)
        assert axis.upper - cell / 2 == pytest.approx(last)
    described, _, _ = describe(algorithm, algorithm.archives["controller"].elites())
    for k, axis in enumerate(algorithm.axes("controller")):
        assert axis.n == (9, 10)[k]
        assert axis.lower < described[:, k].min()
        assert described[:, k].max() < axis.upper


@pytest.mark.parametrize(
    ("evaluations", "initial", "batch_size", "refits"),
    [
        (1, 1, 2, (0,)),
        (10, 11, 2, (0,)),
        (10, 1, 2, (0,)),
        (10, 5, 3, (0,)),
        (10, 5, 0, (0,)),
        (10, 5, -2, (0,)),
        (10, 5, 2, ()),
        (10, 5, 2, (1, 2)),
        (10, 5, 2, (0, -1)),
    ],
)
def test_contradicting_numbers_are_refused(evaluations, initial, batch_size, refits):
    with pytest.raises(InvalidData):
        replaced(
            RunConfig(),
            evaluations=evaluations,
            initial=initial,
            batch_size=batch_size,
            refit_generations=refits,
        )
    with pytest.raises(InvalidData):
        create(budget=evaluations, initial=initial, batch_size=batch_size, refit_generations=refits)


def test_the_smallest_schedule_is_allowed():
    algorithm = create(budget=2, initial=2, batch_size=2, refit_generations=(0,))
    generation(algorithm)
    assert algorithm.ask() == []


def test_the_global_random_state_does_not_matter():
    one, other = create(9), create(9)
    for k in range(3):
        random.seed(k)
        generation(one)
        random.seed(100 + k)
        generation(other)
    assert one.state() == other.state()
