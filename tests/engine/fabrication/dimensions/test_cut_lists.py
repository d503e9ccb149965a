import math

import pytest

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cut_lists import cables, rods, stock_plan
from engine.fabrication.materials import load_materials
from engine.simulation.model import build_spec
from engine.simulation.physics import Physics

MATERIALS = load_materials("tpu-85a")


def test_names_rest_lengths_and_stiffness_are_those_of_the_simulated_model():
    body = Morphology((3, 8), (1, 2))
    model = build_spec(body, physics=Physics()).compile()
    rows = cables(body, MATERIALS)
    assert len(rows) == 48
    for row in rows:
        tendon = model.tendon(row.name)
        assert row.stiffness == pytest.approx(model.tendon_stiffness[tendon.id].ravel()[0])
        assert row.rest == pytest.approx(model.tendon_lengthspring[tendon.id, 1])
        assert row.pretension == pytest.approx(row.stiffness * (row.assembled - row.rest))
        # longer than in a contracted module or shorter, but pulled in every state
        assert row.contracted > row.rest
    assert {r.nodes for r in rows} == set(t.CABLES)


def test_all_cables_of_an_assembled_module_are_equally_long():
    lengths = [c.assembled for c in cables(Morphology(5, (1, 2)), MATERIALS)]
    assert max(lengths) - min(lengths) < 5e-5
    # the six-rod icosahedron's equilibrium: cables of sqrt(3/8) of a rod, between nodes
    assert lengths[0] == pytest.approx(math.sqrt(3 / 8) * t.ROD_LENGTH - 2 * t.ANCHOR_OFFSET, rel=0.03)


def test_rods_are_the_simulated_ones_less_their_caps():
    body = Morphology(5, (1, 2, 3))
    rows = rods(body, MATERIALS)
    assert [r.nodes for r in rows[:6]] == list(t.RODS)
    assert [r.kind for r in rows].count("servo") == 3
    assert all(r.length == t.ROD_LENGTH and r.cut == pytest.approx(0.079) for r in rows)
    plan = stock_plan(body, MATERIALS)
    # 12 pieces of 79 mm and 11 cuts of 1 mm between them are 959 mm
    assert (plan.pieces, plan.pieces_per_stock, plan.stock_rods) == (18, 12, 2)
