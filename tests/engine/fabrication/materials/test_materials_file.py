import re

import pytest

from engine.errors import InvalidData
from engine.fabrication.materials import (
    PRESETS,
    Source,
    load_materials,
    parse_materials,
    preset_text,
)

TPU = preset_text("tpu-85a")


def edited(pattern, replacement):
    text, count = re.subn(pattern, replacement, TPU, count=1, flags=re.MULTILINE)
    assert count == 1
    return text


@pytest.mark.parametrize("name", PRESETS)
def test_presets_are_read_in_si(name):
    materials = load_materials(name)
    assert materials.file == name
    assert 0.8e6 <= materials.cable.modulus <= 12e6
    assert materials.printer.nozzle == pytest.approx(0.0004)
    assert materials.servo.mass == pytest.approx(0.0048)
    assert materials.cable_source is Source.ASSUMED


def test_the_printed_preset_is_the_tpu_that_data_sheets_describe():
    cable = load_materials("tpu-85a").cable
    # the secant to where it yields
    assert cable.modulus == pytest.approx(4e6 / 0.65, rel=0.02)
    assert (cable.form, cable.modulus, cable.max_strain) == ("printed", 6.2e6, 0.65)


@pytest.mark.parametrize(
    ("pattern", "replacement", "message"),
    [
        (r"^modulus_mpa = 6.2", "modulus_mpa = -1", "cable.modulus_mpa must be positive, not -1"),
        (r"^modulus_mpa = 6.2", "modulus_mpa = 0", "cable.modulus_mpa must be positive, not 0"),
        (r"^modulus_mpa = 6.2", "modulus_mpa = nan", "cable.modulus_mpa must be finite, not nan"),
        (r"^modulus_mpa = 6.2", "modulus_mpa = inf", "cable.modulus_mpa must be finite, not inf"),
        (r"^modulus_mpa = 6.2", "modulus_mpa = true", "cable.modulus_mpa must be a number, not True"),
        (r"^modulus_mpa = 6.2", "modulus_mpa = '12'", "cable.modulus_mpa must be a number, not '12'"),
        (r"^modulus_mpa = 6.2.*\n", "", "cable.modulus_mpa is missing"),
        (r"^modulus_mpa", "modulus_gpa", "cable.modulus_gpa is unknown"),
        (r"^kerf_mm = 1.0", "kerf_mm = -1", "rod.kerf_mm must not be negative, not -1"),
        (r"^min_layers = 2", "min_layers = 1.5", "printer.min_layers must be a whole number, not 1.5"),
        (r"^modulus_strain_percent = 65", "modulus_strain_percent = 0", "cable.modulus_strain_percent"),
        (r"^form = .*", 'form = "woven"', "cable.form must be sheet or printed"),
        (r"^form = .*", 'form = "sheet"', "cable.stock_thicknesses_mm must name the sheets"),
        (r"^stock_length_mm = 1000", "stock_length_mm = 70", "rod.stock_length_mm must be at least 79"),
        (r"^per_module = 3", "per_module = -2", r"fastener\[0\].per_module must be positive, not -2"),
        (r"^carried = false", "carried = 0", "board.carried must be true or false, not 0"),
        (r"^name = .*", 'name = ""', "name must be a line of text"),
        (r"^\[servo\]", "[motor]", "unknown key motor"),
        (r"^pulse_max_us = 2400", "pulse_max_us = 400", "servo.pulse_max_us must be more"),
        (r"^\[cable\]", "[cable", "not a TOML file"),
        (r"^body_width_mm = 8.6", "body_width_mm = 900", "servo.body_width_mm must be from 4 to 16, not 900"),
        (r"^mass_g = 4.8", "mass_g = 4800", "servo.mass_g must be from 1 to 20, not 4800"),
        (r"^nozzle_mm = 0.4", "nozzle_mm = 40", "printer.nozzle_mm must be from 0.1 to 1.5, not 40"),
        (r"^travel_degrees = 180", "travel_degrees = 20", "servo.travel_degrees must be from 120 to 360"),
        (r"^relaxation_percent = 15", "relaxation_percent = 100", "cable.relaxation_percent must be from 0"),
        (r"^shaft_height_mm = 9.5", "shaft_height_mm = 3", "servo: the shaft must stand 1.5 to 7.5 mm above"),
    ],
)
def test_a_wrong_file_gets_one_line_that_names_file_and_key(pattern, replacement, message):
    with pytest.raises(InvalidData, match=f"^mine.toml: {message}") as caught:
        parse_materials(edited(pattern, replacement), file="mine.toml")
    assert "\n" not in str(caught.value)


def test_a_pull_test_that_no_cable_gives_is_refused():
    test = "[pull_test]\nlength_mm = 60\narea_mm2 = 1.6\nforce_n = 0.0096\nextension_mm = 30\n"
    with pytest.raises(InvalidData, match=r"pull_test gives a modulus of 0.012 MPa, and no cable has less"):
        parse_materials(TPU + test + "max_strain_percent = 65\n", file="mine.toml")


def test_a_number_too_large_for_a_float_is_refused():
    with pytest.raises(InvalidData, match="must be finite"):
        parse_materials(edited(r"^modulus_mpa = 6.2", "modulus_mpa = 1" + "0" * 400), file="mine.toml")


def test_an_unreadable_file_is_named(tmp_path):
    with pytest.raises(InvalidData, match=r"nowhere.toml cannot be read: No such file.*tpu-85a"):
        load_materials(tmp_path / "nowhere.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InvalidData, match="not UTF-8"):
        load_materials(tmp_path / "bytes.toml")


FEET = "[feet_test]\nforward_degrees = [16, 17.5, 18]\nbackward_degrees = [38, 41]\n"


def test_a_friction_test_gives_coefficients_and_their_spread():
    test = parse_materials(TPU + FEET, file="mine.toml").feet_test
    # tangents of 16, 17.5 and 18 degrees: 0.2867, 0.3153, 0.3249
    assert test.friction == pytest.approx((0.3090, 0.8253), abs=1e-4)
    assert test.spread == pytest.approx((0.0643, 0.0755), abs=1e-3)
    assert load_materials("tpu-85a").feet_test is None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "[38, 41]",
            "[12, 13]",
            "hold backward at least as well as forward; friction forward is 0.31, backward",
        ),
        ("[38, 41]", "[-38, 41]", r"backward_degrees\[0\] must be positive, not -38"),
        ("[38, 41]", "[38, 79]", "backward_degrees must be at most 78.7, which is friction 5, not 79"),
        ("[38, 41]", "[38]", "backward_degrees must hold at least two angles"),
        ("[38, 41]", "38", "backward_degrees must be a list of numbers, not 38"),
        ("backward_degrees = [38, 41]\n", "", "backward_degrees is missing"),
    ],
)
def test_a_wrong_friction_test_gets_one_line(old, new, message):
    with pytest.raises(InvalidData, match=f"^mine.toml: feet_test.? ?(must )?{message}") as caught:
        parse_materials(TPU + FEET.replace(old, new), file="mine.toml")
    assert "\n" not in str(caught.value)
