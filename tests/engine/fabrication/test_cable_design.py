import dataclasses
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.cables import EYELET_WALL, cable_problems, design_cables
from engine.fabrication.cut_lists import cables
from engine.fabrication.joints import joints, orientations
from engine.fabrication.materials import MAX_TAIL, MIN_TAIL, PRESETS, load_materials
from engine.fabrication.rods import rods, stock_plan
from engine.simulation.model import build_spec, module_placements
from engine.simulation.physics import Physics

MATERIALS = {name: load_materials(name) for name in PRESETS}


def test_names_rest_lengths_and_stiffness_are_those_of_the_simulated_model():
    body = Morphology((3, 8), (1, 2))
    model = build_spec(body, physics=Physics()).compile()
    rows = cables(body, MATERIALS["tpu-85a"])
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
    lengths = [c.assembled for c in cables(Morphology(5, (1, 2)), MATERIALS["tpu-85a"])]
    assert max(lengths) - min(lengths) < 5e-5
    # the six-rod icosahedron's equilibrium: cables of sqrt(3/8) of a rod, between nodes
    assert lengths[0] == pytest.approx(math.sqrt(3 / 8) * t.ROD_LENGTH - 2 * t.ANCHOR_OFFSET, rel=0.03)


@given(
    level=st.integers(1, 10),
    modulus=st.floats(0.2e6, 50e6),
    strain=st.floats(0.2, 5.0),
    nozzle=st.sampled_from([0.0002, 0.0004, 0.0006]),
    name=st.sampled_from(PRESETS),
)
@settings(max_examples=40, deadline=None)
def test_a_cable_without_problems_is_the_simulated_spring(level, modulus, strain, nozzle, name):
    m = MATERIALS[name]
    m = dataclasses.replace(
        m,
        cable=dataclasses.replace(m.cable, modulus=modulus, max_strain=strain),
        printer=dataclasses.replace(m.printer, nozzle=nozzle),
    )
    design = design_cables(Morphology(level, (1, 2)), m)[0]
    assert MIN_TAIL - 1e-12 <= design.tail <= MAX_TAIL
    assert design.path == pytest.approx(t.CABLE_REST_LENGTH + 2 * design.tail)
    assert design.area == pytest.approx(design.stiffness * design.free / modulus)
    assert math.pi / 4 * design.round_diameter**2 == pytest.approx(design.square_side**2)
    if not design.problems:
        assert design.stiffness_made == pytest.approx(design.stiffness, rel=0.01)
        assert max(design.strain_assembled, design.strain_contracted) <= strain * (1 + 1e-6)
        if not design.section.round:
            assert design.section.width >= nozzle - 1e-12
            assert design.section.thickness >= m.printer.min_layers * m.printer.layer - 1e-12
        else:
            assert design.section.width in m.cable.stock_diameters
    else:
        for problem in design.problems:
            assert problem.text.endswith(".")
            assert problem.proposals


def test_what_cannot_be_printed_is_said_with_what_would_work():
    body = Morphology((1, 5, 1), (1, 2, 3))
    (problem,) = cable_problems(body, MATERIALS["tpu-85a"])
    assert problem.modules == (0, 2)
    assert "0.064 mm2 thin" in problem.text
    softer, finer, other = problem.proposals
    m = MATERIALS["tpu-85a"]
    assert softer == "a softer material: a modulus of 4.8 MPa"
    soft = dataclasses.replace(m, cable=dataclasses.replace(m.cable, modulus=4.8e6))
    assert not cable_problems(body, soft)
    assert finer == "a finer nozzle: 0.15 mm"
    fine = dataclasses.replace(m, printer=dataclasses.replace(m.printer, nozzle=0.00015))
    assert not cable_problems(body, fine)
    assert "latex-cord" in other
    assert not cable_problems(body, MATERIALS["latex-cord"])


def test_too_much_strain_is_said_and_a_longer_path_proposed():
    m = MATERIALS["tpu-85a"]
    short = dataclasses.replace(m, cable=dataclasses.replace(m.cable, max_tail=0.008))
    (problem,) = cable_problems(Morphology(8, (1, 2)), short)
    assert "springs back up to 65 %" in problem.text
    assert problem.proposals[0].startswith("a longer path: max_tail_mm = 15 ")
    longer = dataclasses.replace(m, cable=dataclasses.replace(m.cable, max_tail=0.015))
    assert not cable_problems(Morphology(8, (1, 2)), longer)


def test_printed_rings_count_as_rigid():
    design = design_cables(Morphology(5, (1, 2)), MATERIALS["tpu-85a"])[0]
    assert design.free == pytest.approx(design.path - 2 * EYELET_WALL)
    cord = design_cables(Morphology(5, (1, 2)), MATERIALS["latex-cord"])[0]
    assert cord.free == pytest.approx(cord.path)


def test_rods_are_the_simulated_ones_less_their_caps():
    body = Morphology(5, (1, 2, 3))
    rows = rods(body, MATERIALS["tpu-85a"])
    assert [r.nodes for r in rows[:6]] == list(t.RODS)
    assert [r.kind for r in rows].count("servo") == 3
    assert all(r.length == t.ROD_LENGTH and r.cut == pytest.approx(0.079) for r in rows)
    plan = stock_plan(body, MATERIALS["tpu-85a"])
    # 12 pieces of 79 mm and 11 cuts of 1 mm between them are 959 mm
    assert (plan.pieces, plan.pieces_per_stock, plan.stock_rods) == (18, 12, 2)


@given(faces=st.lists(st.integers(1, 8), min_size=2, max_size=5).map(tuple))
@settings(max_examples=12, deadline=None)
def test_the_orientation_table_is_that_of_the_model(faces):
    body = Morphology(5, faces)
    model = build_spec(body, physics=Physics()).compile()
    table = joints(body)
    assert len(table) == len(faces) - 1
    placements = module_placements(body)
    for j in table:
        assert {a for a, _ in j.node_pairs} == set(t.FACES[j.face])
        assert {b for _, b in j.node_pairs} == set(t.FACES[j.next_face])
        for k, (a, b) in enumerate(j.node_pairs):
            # the model's link k ends on the rods of these nodes
            tendon = model.tendon(f"link{j.module}_{k}")
            first = model.tendon_adr[tendon.id]
            bodies = [model.body(model.site_bodyid[model.wrap_objid[first + i]]).name for i in (0, 1)]
            assert bodies == [f"m{j.module}_rod{a // 2}", f"m{j.module + 1}_rod{b // 2}"]
    before = None
    for o, (turn, centre) in zip(orientations(body), placements, strict=True):
        servo = turn.apply(t.NODES[[0, 1]].mean(axis=0))
        # looking along +x with z up, clockwise: the right hand is -y
        angle = math.radians(o.servo_angle)
        across = math.hypot(servo[1], servo[2])
        assert -servo[1] / across == pytest.approx(math.sin(angle), abs=1e-6)
        assert servo[2] / across == pytest.approx(math.cos(angle), abs=1e-6)
        assert o.centre == pytest.approx(centre)
        if before is None:
            assert o.turn is None
        else:
            assert (before + o.turn - o.servo_angle) % 360 == pytest.approx(0, abs=1e-5)
        before = o.servo_angle
