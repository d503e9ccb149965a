import pytest

from engine.body.morphology import Morphology
from engine.fabrication.dimensions.pull_test import coupon
from engine.fabrication.dimensions.rubber import shear_modulus
from engine.fabrication.materials import Source, load_materials, preset_text

TPU = preset_text("tpu-85a")


def pull_test_table(*, length, area, force, extension, max_strain):
    """Return what a maker writes into the materials file; arguments in SI units."""
    return (
        "[pull_test]\n"
        f"length_mm = {1e3 * length:g}\n"
        f"area_mm2 = {1e6 * area:g}\n"
        f"force_n = {force:g}\n"
        f"extension_mm = {1e3 * extension:g}\n"
        f"max_strain_percent = {100 * max_strain:g}\n"
    )


def test_a_pull_test_sets_modulus_and_strain(tmp_path):
    test = coupon(Morphology(5, (1, 2)), load_materials("tpu-85a"))
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
    # a coupon that pulls as the file expects is the file's material, named by another point of its curve
    again = pull_test_table(
        length=test.gauge_length,
        area=test.area,
        force=test.expected_force,
        extension=test.extension,
        max_strain=0.65,
    )
    path.write_text(TPU + "\n" + again)
    same, materials = load_materials(path).cable, load_materials("tpu-85a")
    assert shear_modulus(same) == pytest.approx(shear_modulus(materials.cable), rel=1e-4)
    assert same.modulus_strain == pytest.approx(test.extension / test.gauge_length, rel=1e-4)
