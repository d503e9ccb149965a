import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.errors import InvalidData
from engine.search.archive import DeepGridArchive, GridArchive, parent_weights
from tests.support.made_up import evaluation, examples

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


def test_cells_that_nobody_can_lie_in_do_not_count():
    archive = GridArchive(shape=SHAPE, n_possible=6)
    archive.add((0, 0), evaluation(0, 0.2))
    archive.add((2, 3), evaluation(1, 0.2))
    archive.add((2, 2), evaluation(2, 0.2))
    assert archive.n_cells == 6
    assert archive.coverage == pytest.approx(0.5)


# ---- deep grids

CAPACITY = 3


def deep(placed=(), capacity=CAPACITY, seed=0):
    archive = DeepGridArchive(shape=SHAPE, capacity=capacity, rng=random.Random(seed))
    for number, (cell, fitness) in enumerate(placed):
        archive.add(cell, evaluation(number, fitness))
    return archive


def members(archive):
    return {cell: [e.solution.number for e in held] for cell, held in archive.members().items()}


def test_individuals_are_appended_until_a_cell_is_full():
    archive = deep([((0, 1), 0.3), ((0, 0), 0.5), ((0, 1), 0.1), ((0, 1), 0.4)])
    assert members(archive) == {(0, 0): [1], (0, 1): [0, 2, 3]}
    assert [e.solution.number for e in archive.individuals()] == [1, 0, 2, 3]
    # the map and its figures show the best of each cell
    assert ranks(archive) == {(0, 0): (0.5, 1), (0, 1): (0.1, 2)}
    assert [e.solution.number for e in archive.elites()] == [1, 2]
    assert archive.qd_score(0.45) == pytest.approx(-0.05 + 0.35)
    assert (len(archive), archive.best().solution.number) == (2, 2)


def test_in_a_full_cell_the_replaced_one_is_drawn_uniformly_however_good():
    lost = []
    rng = random.Random(4)
    for _ in range(3000):
        archive = DeepGridArchive(shape=SHAPE, capacity=CAPACITY, rng=rng)
        for number, fitness in enumerate((0.1, 0.2, 0.3, 0.9)):
            archive.add((1, 1), evaluation(number, fitness))
        (held,) = members(archive).values()
        (gone,) = {0, 1, 2} - set(held)
        # the newcomer takes the other's place
        assert held == [3 if k == gone else k for k in range(3)]
        assert archive.get((1, 1)).solution.number == min(set(held))
        lost.append(gone)
    # 1000 each; five standard deviations are 129
    assert all(abs(lost.count(k) - 1000) < 129 for k in range(3))


def test_being_taken_is_not_being_the_elite():
    archive = deep()
    assert archive.add((0, 0), evaluation(0, 0.3))
    assert not archive.add((0, 0), evaluation(1, 0.4))
    assert not archive.add((0, 0), evaluation(2, 0.3))
    assert len(archive.individuals()) == 3
    assert archive.get((0, 0)).solution.number == 0


def test_chances_of_parents_of_a_hand_case():
    # 1/0.2 : 1/0.4 : 1/0.5 = 10 : 5 : 4, though the last one's f_s is negative
    held = [evaluation(0, 0.2), evaluation(1, 0.4), evaluation(2, 0.5)]
    weights = parent_weights(held)
    assert [w / sum(weights) for w in weights] == pytest.approx([10 / 19, 5 / 19, 4 / 19])


@pytest.mark.parametrize(
    ("fitnesses", "expected"),
    [
        # raised by 3 cm, so that the best counts as 1 cm: 1/1 : 1/2 : 1/4
        ((-0.02, -0.01, 0.01), (4 / 7, 2 / 7, 1 / 7)),
        # raised by 1 cm
        ((0.0, 0.03), (4 / 5, 1 / 5)),
        # 1 cm is enough
        ((0.01, 0.03), (3 / 4, 1 / 4)),
        ((-0.04,), (1.0,)),
    ],
)
def test_chances_of_parents_where_a_bonus_leaves_hardly_any_distance(fitnesses, expected):
    weights = parent_weights([evaluation(k, f) for k, f in enumerate(fitnesses)])
    assert [w / sum(weights) for w in weights] == pytest.approx(expected)


def test_parents_are_drawn_by_cell_and_then_in_proportion_to_fitness():
    archive = deep([((0, 0), 0.2), ((2, 3), 0.3), ((2, 3), 0.6)])
    n = 6000
    drawn = [e.solution.number for e in archive.sample(n, random.Random(2))]
    # a half to each cell; in the second 1/0.3 : 1/0.6 = 2 : 1; five standard deviations are 194 at most
    for number, share in ((0, 1 / 2), (1, 1 / 3), (2, 1 / 6)):
        assert abs(drawn.count(number) - share * n) < 194
    with pytest.raises(IndexError):
        deep().sample(1, random.Random(0))


@examples(60)
@given(offers, st.integers(1, 4), st.integers(0, 2**32))
def test_a_deep_cell_holds_as_many_as_fit_and_shows_the_best(placed, capacity, seed):
    archive = deep(placed, capacity, seed)
    by_cell = {}
    for number, (cell, fitness) in enumerate(placed):
        by_cell.setdefault(cell, {})[number] = fitness
    held = members(archive)
    assert set(held) == set(by_cell)
    for cell, numbers in held.items():
        assert len(set(numbers)) == len(numbers) == min(len(by_cell[cell]), capacity)
        assert set(numbers) <= set(by_cell[cell])
        # the last one to come is always there
        assert max(by_cell[cell]) in numbers
        best = min((by_cell[cell][n], n) for n in numbers)
        assert ranks(archive)[cell] == best


@examples(40)
@given(offers, st.integers(0, 2**32))
def test_a_deep_grid_of_unlimited_cells_loses_nobody_when_re_described(placed, seed):
    archive = deep(placed, 100, seed)
    rng = random.Random(seed)
    moved = [((rng.randrange(3), rng.randrange(4)), e) for e in archive.individuals()]
    archive.reinsert(moved)
    expected = {}
    for cell, e in moved:
        expected.setdefault(cell, []).append(e.solution.number)
    assert members(archive) == expected
    assert {cell: n for cell, (_, n) in ranks(archive).items()} == {
        cell: min((placed[n][1], n) for n in numbers)[1] for cell, numbers in expected.items()
    }


def test_a_re_described_cell_that_overflows_replaces_as_ever():
    archive = deep([((0, k % 4), 0.3) for k in range(8)])
    archive.reinsert([((1, 1), e) for e in archive.individuals()])
    (held,) = members(archive).values()
    assert len(set(held)) == CAPACITY
    # the last one in the order of cells and places, always
    assert 7 in held


@examples(40)
@given(offers, st.integers(0, 2**32))
def test_a_deep_grid_goes_back_to_its_members(placed, seed):
    one, other = deep(placed, seed=seed), deep()
    other.restore(one.members())
    assert members(other) == members(one)
    assert ranks(other) == ranks(one)
    if placed:
        assert one.sample(5, random.Random(seed)) == other.sample(5, random.Random(seed))


@pytest.mark.parametrize("held", [[], [evaluation(k, 0.3) for k in range(4)]])
def test_impossible_members_are_refused(held):
    with pytest.raises(InvalidData, match="deep grid of 3"):
        deep().restore({(0, 0): held})
    with pytest.raises(ValueError, match="outside"):
        deep().restore({(0, 9): [evaluation()]})


def test_a_deep_grid_refuses_failures():
    archive = deep()
    with pytest.raises(ValueError, match="failed"):
        archive.add((0, 0), evaluation(0, None))
    assert len(archive) == 0
