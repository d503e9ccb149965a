import re

import pytest

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.fabrication.materials import (
    PRESETS,
    Source,
    least_certain,
    load_materials,
    parse_materials,
    preset_text,
)
from engine.fabrication.pull_test import coupon, pull_test_table

TPU = preset_text("tpu-85a")


def edited(pattern, replacement):
    text, count = re.subn(pattern, replacement, TPU, count=1, flags=re.MULTILINE)
    assert count == 1
    return text


@pytest.mark.parametrize("name", PRESETS)
def test_presets_are_read_in_si(name):
    materials = load_materials(name)
    assert materials.file == name
    assert 0.9e6 <= materials.cable.modulus <= 12e6
    assert materials.printer.nozzle == pytest.approx(0.0004)
    assert materials.servo.mass == pytest.approx(0.009)
    assert materials.cable_source is Source.ASSUMED


def test_the_printed_preset_is_the_tpu_that_data_sheets_describe():
    cable = load_materials().cable
    assert (cable.form, cable.modulus, cable.max_strain) == ("printed", 12e6, 0.65)


@pytest.mark.parametrize(
    ("pattern", "replacement", "message"),
    [
        (r"^modulus_mpa = 12", "modulus_mpa = -1", "cable.modulus_mpa must be positive, not -1"),
        (r"^modulus_mpa = 12", "modulus_mpa = 0", "cable.modulus_mpa must be positive, not 0"),
        (r"^modulus_mpa = 12", "modulus_mpa = nan", "cable.modulus_mpa must be finite, not nan"),
        (r"^modulus_mpa = 12", "modulus_mpa = inf", "cable.modulus_mpa must be finite, not inf"),
        (r"^modulus_mpa = 12", "modulus_mpa = true", "cable.modulus_mpa must be a number, not True"),
        (r"^modulus_mpa = 12", "modulus_mpa = '12'", "cable.modulus_mpa must be a number, not '12'"),
        (r"^modulus_mpa = 12.*\n", "", "cable.modulus_mpa is missing"),
        (r"^modulus_mpa", "modulus_gpa", "cable.modulus_gpa is unknown"),
        (r"^kerf_mm = 1.0", "kerf_mm = -1", "rod.kerf_mm must not be negative, not -1"),
        (r"^min_layers = 2", "min_layers = 1.5", "printer.min_layers must be a whole number, not 1.5"),
        (r"^max_tail_mm = 25", "max_tail_mm = 3", "cable.max_tail_mm must be from 6"),
        (r"^form = .*", 'form = "woven"', "cable.form must be printed or cord"),
        (r"^form = .*", 'form = "cord"', "cable.stock_diameters_mm must name the diameters"),
        (r"^stock_length_mm = 1000", "stock_length_mm = 70", "rod.stock_length_mm must be at least 79"),
        (r"^per_module = 2", "per_module = -2", r"fastener\[0\].per_module must be positive, not -2"),
        (r"^carried = false", "carried = 0", "board.carried must be true or false, not 0"),
        (r"^name = .*", 'name = ""', "name must be a line of text"),
        (r"^\[servo\]", "[motor]", "unknown key motor"),
        (r"^pulse_max_us = 2400", "pulse_max_us = 400", "servo.pulse_max_us must be more"),
        (r"^\[cable\]", "[cable", "not a TOML file"),
    ],
)
def test_a_wrong_file_gets_one_line_that_names_file_and_key(pattern, replacement, message):
    with pytest.raises(InvalidData, match=f"^mine.toml: {message}") as caught:
        parse_materials(edited(pattern, replacement), file="mine.toml")
    assert "\n" not in str(caught.value)


def test_a_number_too_large_for_a_float_is_refused():
    with pytest.raises(InvalidData, match="must be finite"):
        parse_materials(edited(r"^modulus_mpa = 12", "modulus_mpa = 1" + "0" * 400), file="mine.toml")


def test_an_unreadable_file_is_named(tmp_path):
    with pytest.raises(InvalidData, match=r"nowhere.toml cannot be read: No such file.*tpu-85a"):
        load_materials(tmp_path / "nowhere.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InvalidData, match="not UTF-8"):
        load_materials(tmp_path / "bytes.toml")


def test_a_pull_test_sets_modulus_and_strain(tmp_path):
    test = coupon(Morphology(5, (1, 2)), load_materials())
    table = pull_test_table(
        length=test.gauge_length, area=test.area, force=8.0, extension=test.extension, max_strain=0.8
    )
    path = tmp_path / "mine.toml"
    path.write_text(TPU + "\n" + table)
    materials = load_materials(path)
    expected = (8.0 / test.area) / (test.extension / test.gauge_length)
    assert materials.cable.modulus == pytest.approx(expected, rel=1e-4)
    assert materials.cable.max_strain == pytest.approx(0.8)
    assert materials.cable_source is Source.MEASURED
    # a coupon that pulls as the file expects gives the file's modulus back
    again = pull_test_table(
        length=test.gauge_length,
        area=test.area,
        force=test.expected_force,
        extension=test.extension,
        max_strain=0.65,
    )
    path.write_text(TPU + "\n" + again)
    assert load_materials(path).cable.modulus == pytest.approx(12e6, rel=1e-4)


def test_a_measured_reference_stiffness_is_used():
    from engine.fabrication.cables import design_cables

    materials = parse_materials(edited(r"^# k_ref_n_per_m = 115.2", "k_ref_n_per_m = 100"), file="mine.toml")
    (design, _) = design_cables(Morphology(7, (1, 2)), materials)
    assert design.stiffness == pytest.approx(70.0)
    assert design.stiffness_source is Source.MEASURED
    (design, _) = design_cables(Morphology(7, (1, 2)), load_materials())
    assert design.stiffness == pytest.approx(t.stiffness_n_per_m(0.7))


def test_the_least_certain_source_wins():
    assert least_certain(Source.SIMULATED, Source.MEASURED) is Source.MEASURED
    assert least_certain(Source.ASSUMED, Source.MEASURED) is Source.ASSUMED
