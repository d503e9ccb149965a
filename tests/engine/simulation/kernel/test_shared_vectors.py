"""Robots of one size in the lanes of one vector: what links join is at the same places in all."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from engine.body.morphology import Morphology
from engine.simulation.kernel.guard import read_robot
from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.robots import model as m
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics
from tests.support.made_up import examples

PHYSICS = Physics()


@njit
def _through_places(model, n_rods, array, out, back):
    """Read what an array has by places for every rod, and write it again by way of the rods."""
    for k in range(n_rods):
        found = m.load3_of(model, array, 3, k, 0)
        for i in range(3):
            simd.store(out, 3 * k + i, found[i])
        m.store3_of(model, back, 3, k, 0, found)


@njit
def _apart(model, n_rods, out):
    for i in range(n_rods):
        for j in range(n_rods):
            simd.store(out, n_rods * i + j, simd.mask_to_integer(m.are_apart(model, i, j)))


def robot(levels, faces):
    return read_robot(build_robot(Morphology(levels, faces), PHYSICS))


def rods_at_places(robots):
    """Return (lanes, places) which rod is where, as compiled code finds it."""
    model = m.model_of(robots)
    n = 6 * model.n_modules
    array, out, back = (simd.reals(3 * n, width=len(robots)) for _ in range(3))
    simd.by_lane(array)[:] = np.arange(3 * n)[:, None]
    _through_places(model, n, array, out, back)
    assert simd.by_lane(back).tobytes() == simd.by_lane(array).tobytes()
    places = simd.by_lane(out).reshape(n, 3, -1)[:, 0].astype(int).T // 3
    return model, places.argsort(axis=1)


FOUR = st.lists(
    st.tuples(st.integers(1, 10), st.tuples(*[st.integers(1, 8)] * 3)), min_size=4, max_size=4
).map(lambda genes: [robot(*g) for g in genes])


@examples(20)
@given(FOUR)
def test_links_join_the_same_places_of_every_robot(robots):
    model, rods = rods_at_places(robots)
    assert model.n_links == 6
    assert model.n_islands == 12
    for lane, own in enumerate(robots):
        joined = rods[lane, :12].reshape(6, 2)
        np.testing.assert_array_equal(joined, own.links)
        np.testing.assert_array_equal(simd.by_lane(model.link_arms)[:, lane], own.link_arms.ravel())
        np.testing.assert_array_equal(simd.by_lane(model.link_weight)[:, lane], own.link_weight)
        np.testing.assert_array_equal(simd.by_lane(model.stiffness)[:, lane], own.stiffness)
        np.testing.assert_array_equal(
            simd.by_lane(model.place_mass)[:, lane], own.inverse_mass[rods[lane] % 6]
        )


@examples(10)
@given(FOUR)
def test_rods_pass_through_each_other_in_their_own_lanes(robots):
    model = m.model_of(robots)
    out = simd.integers(18 * 18, width=4)
    _apart(model, 18, out)
    for lane, own in enumerate(robots):
        np.testing.assert_array_equal(simd.by_lane(out)[:, lane], own.apart.ravel())


def test_robots_alike_need_no_choice():
    model = m.model_of([robot(2, (1, 2, 3)), robot(9, (1, 2, 3))])
    assert model.orders.tolist() == [0, 1, 2, 3]


def test_only_robots_of_one_size_and_physics_share():
    one, longer = robot(5, (1, 2)), robot(5, (1, 2, 3))
    slower = read_robot(build_robot(Morphology(5, (1, 2)), Physics(friction=0.4)))
    assert m.may_share(one, robot(1, (7, 8)))
    for other in (longer, slower):
        assert not m.may_share(one, other)
        with pytest.raises(ValueError, match="one size"):
            m.model_of([one, other])
