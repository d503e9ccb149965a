import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.search.archive import GridArchive
from engine.search.axes import project, section
from tests.support.made_up import evaluation, examples

HELD = {
    (0, 0, 0, 0): (0.30, 1),
    (0, 0, 2, 1): (0.20, 2),  # the best body of 0,0
    (0, 1, 2, 1): (0.25, 3),
    (3, 1, 0, 0): (0.10, 4),  # beats the first on the last two axes
}


def itself(value):
    return value


def test_a_hand_worked_projection_shows_the_best_along_the_other_axes():
    assert project(HELD, (0, 1), itself) == {
        (0, 0): (0, 0, 2, 1),
        (0, 1): (0, 1, 2, 1),
        (3, 1): (3, 1, 0, 0),
    }
    assert project(HELD, (2, 3), itself) == {(0, 0): (3, 1, 0, 0), (2, 1): (0, 0, 2, 1)}
    assert project(HELD, (1, 0), itself) == {
        (0, 0): (0, 0, 2, 1),
        (1, 0): (0, 1, 2, 1),
        (1, 3): (3, 1, 0, 0),
    }


def test_a_hand_worked_section():
    assert section(HELD, {0: 0, 1: 0}) == {(0, 0): (0, 0, 0, 0), (2, 1): (0, 0, 2, 1)}
    assert section(HELD, {2: 2}) == {(0, 0, 1): (0, 0, 2, 1), (0, 1, 1): (0, 1, 2, 1)}
    assert section(HELD, {0: 8}) == {}


@pytest.mark.parametrize("order", [1, -1])
def test_a_tie_does_not_depend_on_the_order_of_the_mapping(order):
    held = dict(list({(0, 0, 5): 1.0, (0, 0, 2): 1.0}.items())[::order])
    assert project(held, (0, 1), itself) == {(0, 0): (0, 0, 2)}


cells = st.tuples(*[st.integers(0, 2)] * 4)


@examples(40)
@given(st.dictionaries(cells, st.integers(0, 4), max_size=30), st.permutations(range(4)), st.integers(1, 4))
def test_a_projection_is_the_archive_that_every_elite_was_offered_to(fitness, axes, n):
    held = {cell: evaluation(number, fitness[cell]) for number, cell in enumerate(sorted(fitness))}
    axes = axes[:n]
    archive = GridArchive(shape=(3,) * n)
    for cell, elite in held.items():
        archive.add(tuple(cell[a] for a in axes), elite)
    shown = project(held, axes, lambda e: (e.fitness, e.solution.number))
    assert {onto: held[cell] for onto, cell in shown.items()} == dict(archive)
