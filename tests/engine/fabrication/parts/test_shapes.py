import numpy as np
import pytest

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import EYELET_WALL, design_cables
from engine.fabrication.dimensions.floating_module import floating_module
from engine.fabrication.materials import load_materials
from engine.fabrication.parts import shapes, solids
from engine.fabrication.parts.printed_parts import printed_parts

BODY = Morphology((3, 9), (1, 2))
MATERIALS = load_materials("tpu-85a")


def test_the_net_weighs_what_its_cables_and_rings_do():
    design = design_cables(BODY, MATERIALS)[0]
    net = next(part for part in printed_parts(BODY, MATERIALS) if part.name == "net_stiffness_0.3")
    cables = 24 * design.section.area * design.free
    rings = 15 * np.pi * (0.00135 + EYELET_WALL) ** 2 * 0.0012 - 15 * np.pi * 0.00135**2 * 0.0012
    assert net.volume == pytest.approx(cables + rings, rel=0.03)


def test_a_cap_leads_the_cables_to_the_simulated_anchors():
    design = design_cables(BODY, MATERIALS)[0]
    cap = shapes.cap(design, MATERIALS.printer)
    low, high = cap.bounding_box()[2], cap.bounding_box()[5]
    assert low == pytest.approx(-1e3 * design.tail)
    assert high < 3.0
    # the rod goes in up to the solid tip
    rod = solids.cylinder(1e3 * t.ROD_RADIUS, low - 5, -1.5)
    assert abs((cap ^ rod).volume()) < 1e-9
    for angle in shapes.notch_angles():
        direction = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
        # in the node's plane a cable may come as near as the anchor, but no nearer
        r = 1e3 * t.ANCHOR_OFFSET
        free = solids.bar((r + 0.3) * direction, 6 * direction, 0.25)
        assert (cap ^ free).volume() < 1e-3
        assert (cap ^ solids.bar([0, 0, 0], (r - 0.1) * direction, 0.25)).volume() > 0.05


def test_notches_point_along_the_cables_at_every_node():
    nodes = floating_module(5, None).nodes
    for n in range(12):
        axis = nodes[n] - nodes[n ^ 1]
        frame = solids.frame_along(axis, -(nodes[n] + nodes[n ^ 1]) / 2)
        others = [b if a == n else a for a, b in t.CABLES if n in (a, b)]
        local = (nodes[others] - nodes[n]) @ frame
        angles = np.sort(np.degrees(np.arctan2(local[:, 1], local[:, 0])) % 360)
        assert angles == pytest.approx(shapes.notch_angles(), abs=0.5)
