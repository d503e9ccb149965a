import dataclasses

from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cable_problems import cable_problems
from engine.fabrication.materials import PRESETS, load_materials

MATERIALS = {name: load_materials(name) for name in PRESETS}


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
