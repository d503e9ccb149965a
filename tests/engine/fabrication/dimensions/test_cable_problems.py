import dataclasses
import re

from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cable_problems import cable_problems
from engine.fabrication.materials import PRESETS, load_materials

MATERIALS = {name: load_materials(name) for name in PRESETS}
TOUGH = dataclasses.replace(
    MATERIALS["tpu-85a"], cable=dataclasses.replace(MATERIALS["tpu-85a"].cable, max_strain=1.0)
)
"""A filament that springs back from all that the cables ask for."""


def test_what_cannot_be_printed_is_said_with_what_would_work():
    body = Morphology((1, 5, 1), (1, 2, 3))
    (problem,) = cable_problems(body, TOUGH)
    assert problem.modules == (0, 2)
    assert "0.091 mm2 thin" in problem.text
    softer, finer, other = problem.proposals
    modulus = float(softer.removeprefix("a softer material: a modulus of ").removesuffix(" MPa"))
    soft = dataclasses.replace(TOUGH, cable=dataclasses.replace(TOUGH.cable, modulus=1e6 * modulus))
    assert not cable_problems(body, soft)
    nozzle = float(finer.removeprefix("a finer nozzle: ").removesuffix(" mm"))
    fine = dataclasses.replace(TOUGH, printer=dataclasses.replace(TOUGH.printer, nozzle=nozzle / 1e3))
    assert not cable_problems(body, fine)
    assert "latex-cord" in other
    assert not cable_problems(body, MATERIALS["latex-cord"])


def test_too_much_strain_is_said_and_a_longer_path_proposed():
    short = dataclasses.replace(TOUGH, cable=dataclasses.replace(TOUGH.cable, max_tail=0.008))
    (problem,) = cable_problems(Morphology(8, (1, 2)), short)
    assert "springs back up to 100 %" in problem.text
    named = re.match(r"a longer path: max_tail_mm = ([0-9.]+) ", problem.proposals[0])
    tail = float(named[1]) / 1e3
    for longer, works in ((tail, True), (tail - 0.0006, False)):
        changed = dataclasses.replace(TOUGH, cable=dataclasses.replace(TOUGH.cable, max_tail=longer))
        assert (not cable_problems(Morphology(8, (1, 2)), changed)) == works
