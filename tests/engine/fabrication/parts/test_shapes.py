import itertools

import numpy as np
import pytest

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import RING_RADIUS, design_cables
from engine.fabrication.dimensions.floating_module import floating_module
from engine.fabrication.materials import CAP_SLEEVE, CAP_TIP, load_materials
from engine.fabrication.parts import shapes, solids
from engine.fabrication.parts.net import EYELET_HOLE, module_net

BODY = Morphology((1, 3, 9), (1, 2, 3))
MATERIALS = load_materials()
DESIGNS = design_cables(BODY, MATERIALS)


@pytest.mark.parametrize("design", DESIGNS, ids=lambda d: f"stiffness {d.level}")
def test_a_net_has_the_area_of_its_strips_and_rings(design):
    net = module_net(design, MATERIALS.printer)
    strips = 24 * 1e6 * design.section.width * design.free
    rings = len(net.eyelets) * np.pi * 1e6 * (RING_RADIUS**2 - (EYELET_HOLE / 2) ** 2)
    outline = shapes.net_outline(net, design)
    # inner corners are rounded, which adds a little
    assert 1.0 < outline.area / (strips + rings) < 1.06
    # a strip that is as wide as it may be is free between its rings
    assert shapes.net_solid(net, design).volume() == pytest.approx(
        1e3 * design.section.thickness * outline.area, rel=1e-3
    )


@pytest.mark.parametrize("design", DESIGNS, ids=lambda d: f"stiffness {d.level}")
def test_a_cap_holds_two_rings_at_the_node(design):
    cap = shapes.cap(design, MATERIALS.printer)
    thick = 1e3 * design.section.thickness
    low, high = cap.bounding_box()[2], cap.bounding_box()[5]
    assert low == pytest.approx(-1e3 * CAP_SLEEVE)
    assert high < 5.0
    assert len(cap.decompose()) == 1
    # the rod goes in up to the solid tip
    rod = solids.cylinder(1e3 * t.ROD_RADIUS, low - 5, -1e3 * CAP_TIP)
    assert abs((cap ^ rod).volume()) < 1e-9
    # two rings lie between rim and neck, the node between them where they are thin
    seat = -min(thick, 0.5)
    rings = solids.cylinder(1e3 * RING_RADIUS, seat, seat + 2 * thick) - solids.cylinder(
        shapes.POST, seat, seat + 2 * thick
    )
    assert (cap ^ rings).volume() < 1e-6
    post = solids.cylinder(500 * EYELET_HOLE, seat, seat + 2 * thick)
    assert (cap ^ post).volume() == pytest.approx(post.volume(), rel=1e-3)
    # what lies below them carries them, all around
    carrier = solids.cylinder(shapes.SEAT[1] - 0.05, seat - 0.1, seat) - solids.cylinder(
        shapes.POST, seat - 0.1, seat
    )
    assert (cap ^ carrier).volume() > 0.9 * carrier.volume()


@pytest.mark.parametrize("level", [1, 9])
def test_cables_leave_a_cap_over_its_rim_and_touch_nothing_else(level):
    """From the rim's edge a cable goes straight to the other rod's, clear of the cap's own sleeve."""
    nodes = floating_module(level, None).nodes
    slopes = []
    for n in range(12):
        axis = nodes[n] - nodes[n ^ 1]
        axis = axis / np.linalg.norm(axis)
        for a, b in (c for c in t.CABLES if n in c):
            way = nodes[b if a == n else a] - nodes[n]
            slopes.append(np.degrees(np.arcsin(-way @ axis / np.linalg.norm(way))))
    assert min(slopes) > 20.0
    assert max(slopes) < 58.0
    assert np.mean(slopes) == pytest.approx(shapes.SLOPE, abs=2.0)


def test_a_caps_rim_prints_without_support():
    for design, footed in itertools.product(DESIGNS, (False, True)):
        half = shapes.cap_shape(design, MATERIALS.printer, footed=footed).half
        knob = half[-2]
        for (r, z), (r1, z1) in itertools.pairwise(half):
            if r1 > r and (r1, z1) != knob:  # the knob hangs over by 0.4 mm
                assert z1 - z >= 0.99 * (r1 - r)


def test_the_hole_of_a_line_leads_from_the_rod_out_below_the_ring():
    design = DESIGNS[0]
    blank, drilled = (shapes.cap(design, MATERIALS.printer, line=line) for line in (False, True))
    start, end = map(np.array, shapes.line_hole())
    assert blank.volume() - drilled.volume() > 0.5
    way = solids.bar(start, start + 0.9 * (end - start), 0.2)
    assert (drilled ^ way).volume() < 1e-6
    assert end[0] > 1e3 * RING_RADIUS
    ring = solids.cylinder(1e3 * RING_RADIUS, -0.25, 0.25)
    assert (solids.bar(start, end, 0.15) ^ ring).volume() < 1e-6
