import pytest

from engine.body import module as t
from engine.fabrication.materials import load_materials
from engine.fabrication.parts import head_tag, solids

PRINTER = load_materials().printer


def test_the_clip_holds_a_rod_and_the_wire_fits():
    clip, plate = head_tag.tag_clip(PRINTER), head_tag.tag_plate()
    rod = solids.bar((0, 0, -20), (0, 0, 30), 1e3 * t.ROD_RADIUS)
    assert (clip ^ rod).volume() < 1e-6
    # it does not fall off: on its way out of the mouth the rod is in the way
    assert (clip ^ rod.translate((-1.5, 0, 0))).volume() > 1.0
    wire = solids.bar((0, 0, head_tag.THICK + 0.1), (0, 0, 20), head_tag.WIRE / 2)
    assert (plate ^ wire).volume() < 1e-6
    assert len(clip.decompose()) == len(plate.decompose()) == 1


def test_the_tag_is_light():
    volume = head_tag.tag_clip(PRINTER).volume() + head_tag.tag_plate().volume()
    assert 1.27e-3 * volume == pytest.approx(1.0, abs=0.25)
