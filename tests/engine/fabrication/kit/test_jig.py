"""The jig holds every rod, and nothing else touches it."""

import itertools

import numpy as np
import pytest

from engine.body import module as t
from engine.fabrication.kit.jig import BELOW, LEAST_ROOM, PLATE, jig
from engine.fabrication.kit.lone_module import LoneModule
from engine.fabrication.materials import load_materials
from engine.fabrication.parts import solids
from engine.fabrication.parts.assembly import robot_glb

MATERIALS = load_materials()


def jig_of(level, materials=MATERIALS):
    return jig(level, robot_glb(LoneModule(level, (1,)), materials))


@pytest.fixture(scope="module")
def made():
    return jig_of(2)


def test_it_is_one_printable_piece_that_stands(made):
    assert len(made.solid.decompose()) == 1
    assert made.solid.genus() == 0
    low, high = np.array(made.solid.bounding_box()).reshape(2, 3)
    assert low[2] == pytest.approx(0.0, abs=1e-6)
    assert (high - low < 200.0).all()
    # its middle is over its plate: the module's, too
    middle = made.nodes[:, :2].mean(axis=0)
    assert (low[:2] + 10 < middle).all()
    assert (middle < high[:2] - 10).all()


def test_it_holds_every_rod(made):
    for a, b in t.RODS:
        rod = solids.bar(made.nodes[a], made.nodes[b], 1e3 * t.ROD_RADIUS)
        # it lies in its bore with a little play, and cannot leave it without a snap
        assert 0.0 < made.solid.min_gap(rod, 5.0) < 0.2
        axis = (made.nodes[b] - made.nodes[a]) / np.linalg.norm(made.nodes[b] - made.nodes[a])
        up = np.array([0.0, 0.0, 1.0]) - axis * axis[2]
        for height, meets in ((1.0, True), (6.0, False)):
            raised = rod.translate(tuple(height * up / np.linalg.norm(up)))
            assert ((raised ^ made.solid).volume() > 0.5) == meets
        assert made.nodes[[a, b], 2].min() >= PLATE + BELOW - 1e-6


def test_nothing_else_touches_it_and_the_module_comes_out(made):
    assert made.room >= LEAST_ROOM
    for a, b in t.CABLES:
        for height in (0.0, 20.0, 60.0):
            lifted = made.nodes[[a, b]] + [0.0, 0.0, height]
            assert made.solid.min_gap(solids.bar(*lifted, 0.5), 5.0) > 0.0, (a, b, height)


def test_rods_do_not_lie_in_each_others_way(made):
    for (a, b), (c, d) in itertools.combinations(t.RODS, 2):
        one = solids.bar(made.nodes[a], made.nodes[b], 1e3 * t.ROD_RADIUS)
        other = solids.bar(made.nodes[c], made.nodes[d], 1e3 * t.ROD_RADIUS)
        assert one.min_gap(other, 50.0) > 5.0


def test_where_posts_would_be_too_near_to_anything_there_is_none(made, monkeypatch):
    monkeypatch.setattr("engine.fabrication.kit.jig.LEAST_ROOM", made.room + 0.1)
    assert jig_of(2) is None
