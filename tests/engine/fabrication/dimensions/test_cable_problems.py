import dataclasses
import re

from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cable_problems import cable_problems, makeable
from engine.fabrication.materials import PRESETS, load_materials

MATERIALS = {name: load_materials(name) for name in PRESETS}
TOUGH = dataclasses.replace(
    MATERIALS["tpu-85a"], cable=dataclasses.replace(MATERIALS["tpu-85a"].cable, max_strain=1.4)
)
"""A filament that springs back from all that the cables ask for."""


def test_what_cannot_be_printed_is_said_with_what_would_work():
    body = Morphology((1, 5, 1), (1, 2, 3))
    (problem,) = cable_problems(body, TOUGH)
    assert problem.modules == (0, 2)
    assert "0.081 mm2 thin" in problem.text
    softer, finer, other = problem.proposals
    modulus = float(softer.removeprefix("a softer material: a modulus of ").removesuffix(" MPa"))
    soft = dataclasses.replace(TOUGH, cable=dataclasses.replace(TOUGH.cable, modulus=1e6 * modulus))
    assert not cable_problems(body, soft)
    nozzle = float(finer.removeprefix("a finer nozzle: ").removesuffix(" mm"))
    fine = dataclasses.replace(TOUGH, printer=dataclasses.replace(TOUGH.printer, nozzle=nozzle / 1e3))
    assert not cable_problems(body, fine)
    assert "latex-sheet" in other
    assert not cable_problems(body, MATERIALS["latex-sheet"])


def test_too_much_strain_is_said():
    (problem,) = cable_problems(Morphology(8, (1, 2)), MATERIALS["tpu-85a"])
    assert "springs back up to 65 %" in problem.text
    assert "latex-sheet" in problem.proposals[0]


def test_sheets_too_thick_or_too_thin_are_said_with_another_material():
    latex = MATERIALS["latex-sheet"]
    cable = dataclasses.replace(latex.cable, stock_thicknesses=(0.0008,))
    few = dataclasses.replace(latex, cable=cable)
    for level, word, kind in ((1, "thin", "softer"), (9, "thick", "stiffer")):
        (problem,) = cable_problems(Morphology(level, (1, 2)), few)
        assert f"that can be bought is {word} enough" in problem.text
        assert problem.proposals[0].startswith(f"a {kind} material: a modulus of ")
        modulus = float(re.search(r"of ([\d.]+) MPa", problem.proposals[0])[1])
        other = dataclasses.replace(few, cable=dataclasses.replace(cable, modulus=1e6 * modulus))
        assert not cable_problems(Morphology(level, (1, 2)), other)


def test_a_preset_that_cables_cannot_be_made_of_is_replaced_and_that_is_said():
    body, printed = Morphology((1, 5), (1, 2)), MATERIALS["tpu-85a"]
    made = makeable(body, printed)
    assert made.file == "latex-sheet"
    assert not cable_problems(body, made)
    assert made.instead.startswith(
        "Made of latex sheet, not of printed TPU, Shore 85A, which was asked for: At"
    )
    assert dataclasses.replace(made, instead="") == MATERIALS["latex-sheet"]
    # what can be made is made of what was asked for
    silicone = MATERIALS["silicone-sheet"]
    assert makeable(Morphology(5, (1, 2)), silicone) is silicone
    assert makeable(Morphology(1, (1, 2)), silicone).file == "latex-sheet"
    # what somebody has measured is not replaced
    own = dataclasses.replace(printed, file="mine.toml")
    assert makeable(body, own) is own
