"""A kit's figures: what to buy, how it is fed, the form that feeds back."""

import dataclasses
import re

import pytest

from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.fabrication.bill_of_materials import parts
from engine.fabrication.dimensions.cables import cable_design
from engine.fabrication.dimensions.rubber import shear_modulus
from engine.fabrication.kit.lone_module import LoneModule
from engine.fabrication.kit.measured import measured_form, measures
from engine.fabrication.kit.power import LARGEST_DROP, RESISTIVITY, WIRES, power, tether_density
from engine.fabrication.kit.purchases import print_hours, purchases, total
from engine.fabrication.materials import PRESETS, load_materials, parse_materials, preset_text
from engine.fabrication.parts.printed_parts import printed_parts

MODULE = LoneModule.of(Morphology((2, 7, 4), (3, 1, 8)))


def test_a_lone_module_is_the_first_of_its_robot():
    assert (MODULE.n_modules, MODULE.stiffness_levels, MODULE.faces) == (1, (2,), (3,))
    assert LoneModule.of(Morphology((2, 7, 4), (3, 1, 8)), 2) == LoneModule(4, (8,))
    listed = parts(MODULE, load_materials())
    assert [p.quantity for p in listed if p.group == "passive cables"] == [1]
    for wrong in ((0, (1,)), (11, (1,)), ((2,), (1,)), (2, (1, 2))):
        with pytest.raises(InvalidData, match="a lone module has one stiffness and one face"):
            LoneModule(*wrong)


@pytest.mark.parametrize("servos", range(1, 11))
def test_wire_fuse_and_supply_bear_all_servos_blocked(servos):
    servo = load_materials().servo
    found = power(servos, servo, 1.5)
    assert found.current == pytest.approx(servos * servo.stall_current)
    assert found.drop == pytest.approx(2 * 1.5 * RESISTIVITY / found.section * found.current)
    assert found.drop <= LARGEST_DROP
    # the next thinner wire would lose too much
    thinner = [section for _, section in WIRES if section < found.section]
    if thinner:
        assert 2 * 1.5 * RESISTIVITY / thinner[-1] * found.current > LARGEST_DROP
    assert found.current <= found.fuse <= 2 * found.current + 1
    assert found.current <= found.supply


def test_a_tether_that_is_too_long_has_no_wire():
    servo = load_materials().servo
    assert power(10, servo, 1.5) is not None
    assert power(10, servo, 30.0) is None
    assert power(40, servo, 0.5).connector == "XT60"
    assert power(1, servo, 1.5).connector == "pin header of 2.54 mm"


def test_a_tether_weighs_what_its_wires_weigh():
    servo = load_materials().servo
    wires = dict(WIRES)
    copper = 2 * 8960e-6 * (wires[power(2, servo, 1.5).awg] + wires[28])
    assert copper < tether_density(2, servo) < 2 * copper
    assert tether_density(10, servo) > 2 * tether_density(4, servo)


@pytest.mark.parametrize("preset", PRESETS)
def test_all_that_a_module_needs_is_bought_with_spares(preset):
    materials = load_materials(preset)
    listed = purchases(MODULE, materials)
    bought = {p.what for p in listed}
    assert {materials.rod.material, materials.servo.model, materials.board.model} <= bought
    assert all(f.model in bought for f in materials.fasteners)
    assert any(materials.cable.material in what for what in bought)
    assert all(p.packs >= 1 and 0.0 < p.low <= p.high for p in listed)
    assert next(p for p in listed if p.what == materials.servo.model).packs == 2
    low, high = total(listed)
    again = total(listed, again=True)
    assert 30.0 < low < high < 400.0
    assert again[0] < low
    assert again[1] < high
    # a robot of more modules needs more
    more = purchases(Morphology(2, (1, 2, 3, 4, 5, 6)), materials)
    assert total(more)[0] > low
    assert 0.5 < print_hours(printed_parts(MODULE, materials)) < 10.0


@pytest.mark.parametrize("preset", PRESETS)
def test_the_form_is_a_materials_file_before_and_after_it_is_filled_in(preset):
    materials = load_materials(preset)
    text = measured_form(preset_text(preset), MODULE, materials)
    assert parse_materials(text, file=preset) == materials
    # every step is marked once, in order of the list, on the line of its key
    lines = text.splitlines()
    listed = measures(preset_text(preset))
    assert [m[0] for m in listed] == list(range(2, 2 + len(listed)))
    assert {"body_length_mm", "shaft_diameter_mm", "clearance_mm"} <= {m[2] for m in listed}
    for n, _, key, how in listed:
        marked = [line for line in lines if f"# MEASURE {n}: " in line]
        assert len(marked) == 1
        assert marked[0].startswith(f"{key} = ")
        assert marked[0].endswith(how)
    if materials.pull_test is None:
        filled = text.replace("# [pull_test]", "[pull_test]")
        for key in ("length_mm", "area_mm2", "force_n", "extension_mm", "max_strain_percent"):
            filled = filled.replace(f"# {key} = ", f"{key} = ")
        # as expected, it is the rubber that it was, at the strain of the cables
        again = parse_materials(filled, file=preset)
        assert again.pull_test is not None
        assert shear_modulus(again.cable) == pytest.approx(shear_modulus(materials.cable), rel=0.01)
        assert again.cable.modulus_strain == pytest.approx(
            cable_design(2, materials).strain_assembled, rel=0.01
        )
        assert again.cable.max_strain == pytest.approx(materials.cable.max_strain, rel=0.01)
        pulled = dataclasses.replace(again.pull_test, force=2 * again.pull_test.force)
        assert pulled.modulus == pytest.approx(2 * again.pull_test.modulus)


def test_the_form_asks_for_the_friction_of_feet_where_there_are_some():
    materials = load_materials()
    form = measured_form(preset_text("latex-sheet"), MODULE, materials, (0.3, 0.8))
    filled = re.sub(r"^# (?=\[feet_test\]|forward_degrees|backward_degrees)", "", form, flags=re.MULTILINE)
    found = parse_materials(filled, file="mine.toml")
    assert found.feet_test.friction == pytest.approx((0.3, 0.8), rel=0.03)
    assert parse_materials(form, file="mine.toml").feet_test is None
    assert "feet_test" not in measured_form(preset_text("latex-sheet"), MODULE, materials)
