import copy
import dataclasses
import json
from collections import Counter

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from engine.body.morphology import Morphology
from engine.search.archive import GridArchive
from engine.search.body_space import PUBLISHED_BODIES, BodySpace
from engine.search.dm_me import DoubleMapMapElites
from engine.search.map_elites import MapElites
from engine.search.map_search import MapSearchConfig
from engine.search.trajectory_archive import TrajectoryArchive
from engine.simulation.evaluation import Solution
from tests.support.expected_map import ExpectedMap, numbers
from tests.support.made_up import (
    REFITS,
    describe,
    evaluate,
    evaluation,
    examples,
    generation,
    held,
    map_search,
    nothing_else,
    some_controller,
)

seeds = st.integers(0, 2**32)
PER_MODULE = BodySpace(stiffness="per-module")
maps = st.sampled_from([PUBLISHED_BODIES, PER_MODULE])


def create(seed=0, **changes):
    return map_search(MapElites, seed, **changes)


def body_cell(e):
    """Return where a body of one stiffness, or of one for each module, lies, worked out anew."""
    m = e.solution.morphology
    if isinstance(m.stiffness_level, int):
        return (len(m.faces) - 2, m.stiffness_level - 1)
    return (len(m.faces) - 2, min(m.stiffness_level) - 1, max(m.stiffness_level) - 1)


def state_and_contents(algorithm):
    """Return what a run file keeps of an algorithm."""
    state = json.loads(json.dumps(algorithm.state(), allow_nan=False))
    return state, {name: dict(archive) for name, archive in copy.deepcopy(dict(algorithm.archives)).items()}


# ---- indices, worked out by hand

CORNERS = {(0.0, 0.0): (0, 0), (8.0, 0.0): (8, 0), (0.0, 9.0): (0, 9), (8.0, 9.0): (8, 9)}
"""Points of a plane, and their cells once they are what the bounds are cut to: a unit is a cell."""


def crawled(number, x, y, morphology, fitness=0.3):
    """Return an evaluation whose head is at a place all the time, on every target."""
    solution = Solution(number=number, morphology=morphology, controller=some_controller())
    e = evaluation(number, fitness, trajectory=np.tile(np.float32([x, y]), (4, 40, 1)))
    return dataclasses.replace(e, solution=solution)


def hand_map():
    """Return a 4-D map whose principal components are known: x and y, scaled.

    x varies more than y does once standardised features are counted, because y is 0 on two targets; so
    the first component is along x and the second along y, up to their signs.
    """
    grid = TrajectoryArchive(
        archive=GridArchive(shape=(9, 10, 9, 10)),
        first_axes=lambda e: PUBLISHED_BODIES.cell(e.solution.morphology),
        refit_generations=(0, 2),
        sensory="positions",
    )
    bodies = [
        Morphology(1, (1, 1)),
        Morphology(10, (1,) * 10),
        Morphology(4, (1, 2, 3)),
        Morphology(7, (8, 8)),
    ]
    corners = []
    for number, ((x, y), body) in enumerate(zip(CORNERS, bodies, strict=True)):
        e = crawled(number, x, y, body)
        e.trajectory[2:, :, 1] = 0.0
        corners.append(e)
    grid.tell(0, corners)
    return grid, corners


def along(grid, cell):
    """Return a cell's last two indices, counted the way x and y grow."""
    d = grid.state()
    signs = np.sign(np.array(d["components"])[[0, 1], [0, 1]])
    return tuple(i if s > 0 else n - 1 - i for i, n, s in zip(cell[-2:], (9, 10), signs, strict=True))


def test_four_indices_are_the_body_s_and_then_the_trajectory_s():
    grid, corners = hand_map()
    assert len(grid.archive) == 4
    by_number = {e.solution.number: cell for cell, e in grid.archive}
    assert [by_number[k][:2] for k in range(4)] == [(0, 0), (8, 9), (1, 3), (0, 6)]
    assert [along(grid, by_number[k]) for k in range(4)] == list(CORNERS.values())
    for x, y, expected in ((3.4, 4.4, (3, 4)), (3.6, 4.6, (4, 5)), (0.4, 8.4, (0, 8)), (7.6, 8.6, (8, 9))):
        e = crawled(9, x, y, Morphology(6, (1,) * 5))
        e.trajectory[2:, :, 1] = 0.0
        grid.tell(1, [e])
        ((cell, _),) = [(c, held) for c, held in grid.archive if c[:2] == (3, 5)]
        assert along(grid, cell) == expected
        grid.archive.reinsert([(c, held) for c, held in grid.archive if c != cell])
    assert {e.solution.number for e in grid.archive.elites()} == {e.solution.number for e in corners}


def test_a_value_outside_moves_everybody_of_all_bodies():
    grid, _ = hand_map()
    far = crawled(4, 16.0, 0.0, Morphology(5, (1, 1)))
    grid.tell(1, [far])
    by_number = {e.solution.number: along(grid, cell) for cell, e in grid.archive}
    # nine cells now have centres at 0, 2, ..., 16
    assert by_number == {0: (0, 0), 1: (4, 0), 2: (0, 9), 3: (4, 9), 4: (8, 0)}


def test_elites_that_new_bounds_bring_together_compete_within_their_body_only():
    grid, _ = hand_map()
    one, other = Morphology(5, (1, 1)), Morphology(5, (2, 1, 1))
    near = [
        crawled(10, 3.0, 0.0, one, 0.3),
        crawled(11, 4.0, 0.0, one, 0.2),
        crawled(12, 3.0, 0.0, other, 0.4),
    ]
    grid.tell(1, near)
    assert {10, 11, 12} <= {e.solution.number for e in grid.archive.elites()}
    # with centres 20 apart, 3 and 4 fall into one cell
    grid.tell(3, [crawled(13, 160.0, 0.0, Morphology(9, (1, 1)))])
    left = {e.solution.number for e in grid.archive.elites()}
    assert {11, 12, 13} <= left
    assert 10 not in left


# ---- the search


@examples(15)
@given(seeds, st.sampled_from([0.0, 0.3]), maps)
def test_the_archive_holds_what_it_should(seed, failing, bodies):
    algorithm, expected = create(seed, bodies=bodies), ExpectedMap(REFITS, body_cell)
    for number in range(9):
        solutions = algorithm.ask()
        # a generation 0 of which too little succeeds is repeated, so that the budget may end early
        assume(solutions)
        evaluations = evaluate(solutions, seed, failing)
        algorithm.tell(evaluations)
        expected.tell(number, [e for e in evaluations if e.fitness is not None])
        assume(expected.meaningful)
        assert held(algorithm.archives) == {"grid": numbers(expected.cells)}
        assert algorithm.generation == number + 1


def test_refits_and_new_bounds_move_elites():
    # what the test above relies on
    moved = Counter()
    for seed in range(5):
        algorithm, expected = create(seed), ExpectedMap(REFITS, body_cell)
        for number in range(9):
            before = {n: cell for cell, n in held(algorithm.archives)["grid"].items()}
            expected.tell(number, generation(algorithm, salt=seed))
            after = {n: cell for cell, n in held(algorithm.archives)["grid"].items()}
            kind = "refit" if expected.refitted else "bounds" if expected.rebounded else "neither"
            moved[kind] += sum(after.get(n, cell) != cell for n, cell in before.items())
    assert moved["refit"]
    assert moved["bounds"]
    assert not moved["neither"]


@examples(15)
@given(seeds, maps)
def test_every_elite_sits_in_the_cell_that_describes_it(seed, bodies):
    algorithm = create(seed, bodies=bodies)
    for _ in range(9):
        generation(algorithm, salt=seed)
        placed = list(algorithm.archives["grid"])
        _, inside, cells = describe(algorithm, [e for _, e in placed])
        assert inside.all()
        assert [(*body_cell(e), *last) for (_, e), last in zip(placed, cells, strict=True)] == [
            cell for cell, _ in placed
        ]


@examples(15)
@given(seeds)
def test_a_body_s_best_is_never_lost(seed):
    """Whatever moves, the fittest robot of each size and stiffness wins its cell."""
    algorithm, best = create(seed), {}
    for _ in range(9):
        for e in generation(algorithm, salt=seed):
            key = body_cell(e)
            best[key] = min(best.get(key, (9.0, 0)), (e.fitness, e.solution.number))
        found = {}
        for cell, e in algorithm.archives["grid"]:
            found[cell[:2]] = min(found.get(cell[:2], (9.0, 0)), (e.fitness, e.solution.number))
        assert found == best


def test_the_published_numbers():
    algorithm = MapElites(MapSearchConfig(), n_inputs=2, budget=45_000)
    assert len(algorithm.ask()) == 1080
    assert {name: a.shape for name, a in algorithm.archives.items()} == {"grid": (9, 10, 9, 10)}
    assert algorithm.archives["grid"].n_cells == 8100
    own = MapElites(MapSearchConfig(), n_inputs=2, budget=45_000, bodies=PER_MODULE).archives["grid"]
    assert (own.shape, own.n_cells) == ((9, 10, 10, 9, 10), 495 * 90)


def test_parents_are_drawn_uniformly_from_the_archive():
    algorithm = create(3, initial=30, batch_size=1500, budget=1530)
    generation(algorithm)
    elites = set(held(algorithm.archives)["grid"].values())
    solutions = algorithm.ask()
    assert {s.source for s in solutions} == {"grid"}
    assert {s.operator for s in solutions} == {"morphology", "controller", "both"}
    drawn = Counter(s.parent for s in solutions)
    p = 1 / len(elites)
    five_sigma = 5 * (1500 * p * (1 - p)) ** 0.5
    assert set(drawn) <= elites
    assert all(abs(drawn[k] - 1500 * p) < five_sigma for k in elites)


def test_random_solutions_are_those_of_dm_me():
    assert map_search(MapElites, 4).ask() == map_search(DoubleMapMapElites, 4).ask()


@pytest.mark.parametrize(("budget", "sizes"), [(12, [12]), (24, [12, 6, 6]), (27, [12, 6, 6, 3])])
def test_the_budget_is_spent_exactly(budget, sizes):
    algorithm = create(budget=budget)
    asked = []
    while solutions := algorithm.ask():
        asked.append(solutions)
        algorithm.tell(evaluate(solutions))
    assert [len(s) for s in asked] == sizes
    assert [s.number for batch in asked for s in batch] == list(range(budget))


def test_axes_for_people():
    algorithm = create()
    generation(algorithm)
    assert [(a.name, a.n) for a in algorithm.axes("grid")] == [
        ("modules", 9),
        ("stiffness", 10),
        ("PCA 1", 9),
        ("PCA 2", 10),
    ]
    modules, stiffness = algorithm.axes("grid")[:2]
    assert (modules.lower, modules.upper) == (1.5, 10.5)
    assert (stiffness.lower, stiffness.upper) == pytest.approx((0.05, 1.05))
    own = create(bodies=PER_MODULE)
    assert [a.name for a in own.axes("grid")] == ["modules", "softest", "stiffest", "PCA 1", "PCA 2"]
    with pytest.raises(KeyError):
        algorithm.axes("morphology")


@examples(10)
@given(seeds, st.integers(0, 6), st.sampled_from([0.0, 0.3]), maps)
def test_a_restored_search_goes_on_identically(seed, n, failing, bodies):
    original = create(seed, bodies=bodies)
    for _ in range(n):
        generation(original, salt=seed, failing=failing)
    state, contents = state_and_contents(original)
    # the seed given here must not matter any more
    restored = create(seed + 1, bodies=bodies)
    restored.restore(state, contents, nothing_else)
    assert restored.state() == original.state()
    for _ in range(8 - n):
        one, other = original.ask(), restored.ask()
        assert repr(one) == repr(other)
        original.tell(evaluate(one, seed, failing))
        restored.tell(evaluate(other, seed, failing))
        assert held(original.archives) == held(restored.archives)
        assert original.state() == restored.state()
        assert original.axes("grid") == restored.axes("grid")


@pytest.mark.parametrize("kind", [MapElites, DoubleMapMapElites])
def test_a_search_of_unlike_modules_breeds_unlike_modules(kind):
    algorithm = map_search(kind, 0, bodies=PER_MODULE)
    while solutions := algorithm.ask():
        assert all(s.morphology.stiffness_mode == "per-module" for s in solutions)
        algorithm.tell(evaluate(solutions))


def test_dm_me_of_unlike_modules_has_three_axes_of_bodies():
    algorithm = map_search(DoubleMapMapElites, 0, bodies=PER_MODULE)
    everybody = []
    while solutions := algorithm.ask():
        everybody += evaluate(solutions)
        algorithm.tell(everybody[-len(solutions) :])
    archive = algorithm.archives["morphology"]
    assert (archive.shape, archive.n_cells) == ((9, 10, 10), 495)
    assert [a.name for a in algorithm.axes("morphology")] == ["modules", "softest", "stiffest"]
    best = {}
    for e in everybody:
        best[body_cell(e)] = min(best.get(body_cell(e), (9.0, 0)), (e.fitness, e.solution.number))
    assert {cell: (e.fitness, e.solution.number) for cell, e in archive} == best
    assert archive.coverage == pytest.approx(len(best) / 495)
