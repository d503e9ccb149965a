import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.body.morphology import Morphology, mutate_morphology, random_morphology
from engine.search.axes import body_cell
from engine.search.body_space import PUBLISHED_BODIES, BodySpace
from tests.support.made_up import examples, morphologies, per_module_morphologies

PER_MODULE = BodySpace(stiffness="per-module")
spaces = st.builds(
    BodySpace,
    stiffness=st.sampled_from(["shared", "per-module"]),
    rhythms=st.booleans(),
    feet=st.sampled_from([("none",), ("end",), ("none", "start", "end")]),
    feet_axis=st.booleans(),
)


def test_corners_of_the_map():
    assert PUBLISHED_BODIES.shape == (9, 10)
    assert PUBLISHED_BODIES.cell(Morphology(1, (1, 1))) == (0, 0)
    assert PUBLISHED_BODIES.cell(Morphology(10, (8,) * 10)) == (8, 9)
    assert PUBLISHED_BODIES.cell(Morphology(3, (1, 2, 3, 4))) == (2, 2)


@examples(50)
@given(morphologies)
def test_faces_do_not_move_a_body_on_the_map(m):
    other = Morphology(m.stiffness_level, (1,) * m.n_modules)
    assert PUBLISHED_BODIES.cell(m) == PUBLISHED_BODIES.cell(other)


def test_a_body_of_unlike_modules_lies_where_its_softest_and_its_stiffest_say():
    assert PER_MODULE.shape == (9, 10, 10)
    assert PER_MODULE.cell(Morphology((4, 10, 1), (1, 1, 1))) == (1, 0, 9)
    assert PER_MODULE.cell(Morphology((10, 1, 4), (1, 1, 1))) == (1, 0, 9)
    assert PER_MODULE.cell(Morphology((7, 7), (1, 1))) == (0, 6, 6)
    assert PER_MODULE.cell(Morphology((2,) * 9 + (3,), (8,) * 10)) == (8, 1, 2)


@examples(50)
@given(per_module_morphologies())
def test_no_module_is_softer_than_the_softest(m):
    _, softest, stiffest = PER_MODULE.cell(m)
    assert 0 <= softest <= stiffest <= 9
    assert {softest + 1, stiffest + 1} <= set(m.stiffness_levels)
    assert all(softest < level <= stiffest + 1 for level in m.stiffness_levels)


def test_possible_cells_are_those_that_bodies_reach():
    reached = {
        PER_MODULE.cell(Morphology((a, b) + (a,) * (n - 2), (1,) * n))
        for n in range(2, 11)
        for a in range(1, 11)
        for b in range(1, 11)
    }
    assert len(reached) == PER_MODULE.n_possible == 495
    assert PUBLISHED_BODIES.n_possible == 90


def test_feet_are_one_more_axis_where_they_are_asked_for():
    body, own = Morphology(3, (1, 2, 3), feet="start"), Morphology((4, 9), (1, 1), feet="end")
    assert PUBLISHED_BODIES.cell(body) == (1, 2)
    shared, per_module = BodySpace(feet_axis=True), BodySpace(stiffness="per-module", feet_axis=True)
    assert shared.cell(body) == (1, 2, 1)
    assert per_module.cell(own) == (0, 3, 8, 2)
    assert shared.cell(Morphology(3, (1, 2, 3))) == (1, 2, 0)
    assert shared.shape == (9, 10, 3)
    assert per_module.n_possible == 3 * 495
    assert shared.archive().n_cells == 270


@examples(50)
@given(spaces, st.integers(0, 2**32))
def test_every_body_of_a_space_lies_on_its_map_where_the_axes_say(space, seed):
    body = space.draw(random.Random(seed))
    child = space.mutate(body, random.Random(seed))
    assert tuple(axis.n for axis in space.axes) == space.shape
    for m in (body, child):
        assert (m.stiffness_mode, bool(m.rhythms)) == (space.stiffness, space.rhythms)
        assert m.feet in space.feet
        cell = space.cell(m)
        assert all(0 <= k < n for k, n in zip(cell, space.shape, strict=True))
        assert body_cell(space.axes, m) == cell
        levels = [min(m.stiffness_levels), max(m.stiffness_levels)][: len(space.shape) - 1 - space.feet_axis]
        expected = [m.n_modules - 2, *(level - 1 for level in levels)]
        assert list(cell) == expected + [("none", "start", "end").index(m.feet)] * space.feet_axis


@pytest.mark.parametrize("feet", [("none",), ("none", "start", "end")])
def test_bodies_are_drawn_and_mutated_as_everywhere(feet):
    space = BodySpace(feet=feet)
    ours, plain = random.Random(4), random.Random(4)
    for _ in range(20):
        body = space.draw(ours)
        assert body == random_morphology(plain, feet=feet)
        assert space.mutate(body, ours) == mutate_morphology(body, plain, feet=feet)
