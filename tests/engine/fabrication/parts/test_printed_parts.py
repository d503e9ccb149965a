import dataclasses
import io

import numpy as np
import pytest
import trimesh

from engine.body.morphology import Morphology
from engine.fabrication.dimensions.feet import Foot
from engine.fabrication.materials import PRESETS, load_materials
from engine.fabrication.parts.mesh_files import stl_bytes
from engine.fabrication.parts.printed_parts import printed_parts

BODY = Morphology((3, 9), (1, 2))
FEET = tuple(
    Foot(number=k, module=0, node=k, lean=lean, clock=0, share=1.0, forward=0.1, backward=0.0, off=0.0)
    for k, lean in enumerate((30, 60, 60, 120))
)


@pytest.mark.parametrize("name", PRESETS)
def test_every_part_is_one_closed_body_that_can_be_printed(name):
    materials = load_materials(name)
    # the net of a material that stretches little is larger than most beds
    printer = dataclasses.replace(materials.printer, bed_x=0.25, bed_y=0.25)
    materials = dataclasses.replace(materials, printer=printer)
    for part in printed_parts(BODY, materials, FEET):
        mesh = trimesh.load(io.BytesIO(stl_bytes(part.solid, part.name)), file_type="stl")
        assert mesh.is_watertight, part.name
        assert mesh.is_winding_consistent
        assert len(part.solid.decompose()) == 1
        assert mesh.volume == pytest.approx(1e9 * part.volume, rel=1e-3)
        assert mesh.volume > 0
        assert (part.fits, part.walls_hold) == (True, True), part.name
        assert mesh.bounds[0] == pytest.approx([0, 0, 0], abs=1e-3)
        assert mesh.extents == pytest.approx(1e3 * np.array(part.size), abs=1e-3)


def test_a_kind_of_foot_is_printed_once_for_each_rod_end_and_thrice_for_the_test():
    found = {part.name: part.quantity for part in printed_parts(BODY, load_materials(), FEET)}
    assert {n: q for n, q in found.items() if n.startswith("f")} == {
        "foot_030": 1,
        "foot_060": 2,
        "foot_090": 3,
        "foot_120": 1,
        "friction_sled": 1,
    }
    assert not [p for p in printed_parts(BODY, load_materials()) if p.name.startswith("f")]
