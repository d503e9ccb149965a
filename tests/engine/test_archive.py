import random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_up import evaluation, examples

from engine.archive import GridArchive

SHAPE = (3, 4)
cells = st.tuples(st.integers(0, SHAPE[0] - 1), st.integers(0, SHAPE[1] - 1))
# few different fitnesses, so that ties are common
fitnesses = st.sampled_from([0.1, 0.2, 0.3, 0.4])
offers = st.lists(st.tuples(cells, fitnesses), max_size=40)


def fill(placed):
    archive = GridArchive(shape=SHAPE)
    for number, (cell, fitness) in enumerate(placed):
        archive.add(cell, evaluation(number, fitness))
    return archive


def best_of(placed):
    """The expected elites: per cell the smallest fitness, on a tie the smallest number."""
    ranked = {}
    for number, (cell, fitness) in enumerate(placed):
        ranked.setdefault(cell, []).append((fitness, number))
    return {cell: min(candidates) for cell, candidates in ranked.items()}


def ranks(archive):
    return {cell: (e.fitness, e.solution.number) for cell, e in archive}


def test_a_better_candidate_replaces_and_a_worse_one_does_not():
    archive = GridArchive(shape=SHAPE)
    assert archive.add((1, 2), evaluation(0, 0.3))
    assert not archive.add((1, 2), evaluation(1, 0.31))
    assert archive.add((1, 2), evaluation(2, 0.2))
    assert archive.add((2, 3), evaluation(3, 0.5))
    assert ranks(archive) == {(1, 2): (0.2, 2), (2, 3): (0.5, 3)}
    assert archive.get((1, 2)).solution.number == 2
    assert archive.get((0, 0)) is None


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_on_a_tie_the_older_one_stays(order):
    archive = GridArchive(shape=SHAPE)
    for number in order:
        archive.add((0, 0), evaluation(number, 0.3))
    assert ranks(archive) == {(0, 0): (0.3, 0)}


def test_the_same_evaluation_is_not_taken_twice():
    archive = GridArchive(shape=SHAPE)
    assert archive.add((0, 0), evaluation(4, 0.3))
    assert not archive.add((0, 0), evaluation(4, 0.3))


@examples(100)
@given(offers)
def test_every_cell_holds_the_best_that_was_offered(placed):
    assert ranks(fill(placed)) == best_of(placed)


@examples(100)
@given(offers, st.randoms(use_true_random=False))
def test_the_order_of_offers_does_not_matter(placed, rng):
    numbered = list(enumerate(placed))
    rng.shuffle(numbered)
    archive = GridArchive(shape=SHAPE)
    for number, (cell, fitness) in numbered:
        archive.add(cell, evaluation(number, fitness))
    assert ranks(archive) == best_of(placed)


@examples(100)
@given(offers, st.dictionaries(cells, cells))
def test_reinserted_elites_that_collide_compete(placed, moves):
    archive = fill(placed)
    moved = {}
    for cell, rank in ranks(archive).items():
        moved.setdefault(moves.get(cell, cell), []).append(rank)
    archive.reinsert([(moves.get(cell, cell), e) for cell, e in archive])
    assert ranks(archive) == {cell: min(candidates) for cell, candidates in moved.items()}


@pytest.mark.parametrize("cell", [(-1, 0), (3, 0), (0, 4), (0,), (0, 0, 0), ()])
def test_a_cell_outside_the_grid_is_refused(cell):
    archive = GridArchive(shape=SHAPE)
    with pytest.raises(ValueError, match="outside"):
        archive.add(cell, evaluation())
    assert len(archive) == 0


def test_a_failed_evaluation_is_refused():
    archive = GridArchive(shape=SHAPE)
    with pytest.raises(ValueError, match="failed"):
        archive.add((0, 0), evaluation(0, None))
    assert len(archive) == 0


@pytest.mark.parametrize("shape", [(), (0,), (3, 0), (-1, 2)])
def test_an_archive_without_cells_is_refused(shape):
    with pytest.raises(ValueError, match="at least one cell"):
        GridArchive(shape=shape)


def test_figures_of_a_hand_filled_archive():
    archive = fill([((2, 3), 0.2), ((0, 0), 0.5), ((0, 1), 0.1)])
    assert archive.n_cells == 12
    assert archive.coverage == pytest.approx(3 / 12)
    # 0.45 - 0.2, 0.45 - 0.5, 0.45 - 0.1
    assert archive.qd_score(0.45) == pytest.approx(0.25 - 0.05 + 0.35)
    assert archive.best().solution.number == 2
    assert [cell for cell, _ in archive] == [(0, 0), (0, 1), (2, 3)]
    assert [e.solution.number for e in archive.elites()] == [1, 2, 0]


def test_an_empty_archive():
    archive = GridArchive(shape=SHAPE)
    assert len(archive) == 0
    assert archive.best() is None
    assert archive.coverage == 0.0
    assert archive.qd_score(0.45) == 0.0
    with pytest.raises(IndexError):
        archive.sample(1, random.Random(0))


def test_the_best_of_equals_is_the_oldest():
    archive = GridArchive(shape=SHAPE)
    for number, cell in ((2, (0, 0)), (1, (2, 3)), (3, (1, 1))):
        archive.add(cell, evaluation(number, 0.3))
    assert archive.best().solution.number == 1


def test_parents_are_drawn_uniformly():
    archive = fill([((0, 0), 0.1), ((1, 1), 0.2), ((2, 2), 0.3), ((2, 3), 0.4)])
    n = 4000
    drawn = [e.solution.number for e in archive.sample(n, random.Random(1))]
    assert len(drawn) == n
    # 1000 expected each; five standard deviations are 137
    assert all(abs(drawn.count(k) - n / 4) < 137 for k in range(4))


@examples(20)
@given(offers.filter(bool), st.integers(0, 2**32))
def test_a_draw_depends_on_contents_and_seed_only(placed, seed):
    one, other = fill(placed), GridArchive(shape=SHAPE)
    other.reinsert(reversed(list(one)))
    drawn = [[e.solution.number for e in archive.sample(10, random.Random(seed))] for archive in (one, other)]
    assert drawn[0] == drawn[1]
