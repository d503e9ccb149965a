"""Net, caps, links and coupon as solids, in mm.

A **cap** sits on every rod end. The eyelet of the net (or the knots) lies on the bare rod below the cap; the
four cables of the node run along the cap's sleeve, turn inwards over the notches of its crown and leave
there, 1.5 mm from the axis, as in the simulation. Cables pull the sleeve up and the crown down with the same
force: the cap needs only as much glue as keeps it from turning.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from manifold3d import Manifold
from shapely.geometry import LineString, Point, Polygon
from shapely.ops import unary_union

from engine.body import module as t
from engine.fabrication.dimensions.cables import CableDesign
from engine.fabrication.dimensions.floating_module import floating_module
from engine.fabrication.dimensions.pull_test import Coupon
from engine.fabrication.materials import CAP_TIP, Printer
from engine.fabrication.parts import solids
from engine.fabrication.parts.net import EYELET_HOLE, EYELET_RADIUS, Net
from engine.fabrication.parts.servo_parts import ROD_DIAMETER

EYELET_THICKNESS: Final = 1.2
"""Of the net's rings, in mm; thicker than the cables, so that they grip."""
CROWN_BELOW: Final = 3.0
"""How far the crown reaches below the node's plane, in mm."""
CROWN_ABOVE: Final = 0.6
"""How far it reaches above that plane, in mm; the simulated rods end there too."""
CROWN_TEETH: Final = 1.0
"""Height of the teeth between which the cables lie, over the sleeve, in mm."""
NECK: Final = 1.2
"""Radius and height of the neck that a link's ring snaps onto, in mm."""
HEAD: Final = (1.6, 0.8)
"""Radius and height of the knob that keeps the ring on the neck, in mm."""
FOOT_LIP: Final = 0.5
"""Thickness of the rim of a foot that grips below the knob, in mm."""
LINK_HOLE: Final = 2.2
"""Diameter of a link's holes, which stretch onto the necks, in mm."""
LINK_WALL: Final = 0.8
"""Width of the strip between a link's holes, in mm."""
LINK_PITCH: Final = LINK_HOLE + LINK_WALL
"""Distance of a link's holes from middle to middle, in mm."""
LINK_THICKNESS: Final = 1.0
"""In mm."""


def net_outline(net: Net, design: CableDesign) -> Polygon:
    """Return the net's outline as it is cut or printed, with its holes, in mm."""
    width = 1e3 * design.section.width
    points = [(1e3 * e.position[0], 1e3 * e.position[1]) for e in net.eyelets]
    cables = [
        LineString([points[i] for i in c.eyelets]).buffer(width / 2, cap_style="flat") for c in net.cables
    ]
    return unary_union([*cables, *_discs(net, 1e3 * EYELET_RADIUS)]).difference(_holes(net))


def net_solid(net: Net, design: CableDesign) -> Manifold:
    """Return the net: cables of their section, and rings that are thicker."""
    thickness = 1e3 * design.section.thickness
    flat = solids.extruded(net_outline(net, design), thickness)
    rings = unary_union(_discs(net, 1e3 * EYELET_RADIUS)).difference(_holes(net))
    return flat + solids.extruded(rings, max(EYELET_THICKNESS, thickness))


def _holes(net: Net) -> Polygon:
    return unary_union(_discs(net, 500 * EYELET_HOLE))


def _discs(net: Net, radius: float) -> list[Polygon]:
    """Return a disc round the middle of every eyelet, in mm."""
    return [
        Point(1e3 * e.position[0], 1e3 * e.position[1]).buffer(radius, quad_segs=solids.SEGMENTS // 4)
        for e in net.eyelets
    ]


def notch_angles() -> np.ndarray:
    """Return (4,) directions in degrees in which the cables leave a node, around its rod.

    0 points to the module's centre. They are those of a floating module, the same at every node,
    counter-clockwise seen from outside along the rod.
    """
    nodes = floating_module(t.N_STIFFNESS_LEVELS, None).nodes
    a, b = nodes[0], nodes[1]
    axis = (a - b) / np.linalg.norm(a - b)
    frame = solids.frame_along(axis, -(a + b) / 2)
    others = [y if x == 0 else x for x, y in t.CABLES if 0 in (x, y)]
    local = (nodes[others] - a) @ frame
    return np.sort(np.degrees(np.arctan2(local[:, 1], local[:, 0])) % 360.0)


def neck_height(*, footed: bool) -> float:
    """Return how high the neck of a cap is, in mm: where robots have feet, a foot's rim shares it."""
    return NECK + (FOOT_LIP if footed else 0.0)


def cap(design: CableDesign, printer: Printer, *, footed: bool = False) -> Manifold:
    """Return a rod's end cap along z, the node's plane at 0 and the rod below it.

    Args:
        design: of the cables that it holds.
        printer: what prints it.
        footed: whether the robot has feet, which share the cap's neck with a link.
    """
    wall, clearance = 1e3 * printer.min_wall, 1e3 * printer.clearance
    bore = (ROD_DIAMETER + clearance) / 2
    sleeve = bore + wall
    crown = sleeve + CROWN_TEETH
    low = -1e3 * design.tail
    body = solids.cylinder(sleeve, low, CROWN_ABOVE) + solids.cylinder(
        crown, max(low, -CROWN_BELOW), CROWN_ABOVE
    )
    top = CROWN_ABOVE + neck_height(footed=footed)
    body = body + solids.cylinder(NECK, 0.0, top) + solids.cylinder(HEAD[0], top, top + HEAD[1])
    body = body - solids.cylinder(bore, low - 1.0, -1e3 * CAP_TIP)
    half = notch_width(design) / 2
    floor = 1e3 * t.ANCHOR_OFFSET
    for angle in notch_angles():
        along_sleeve = solids.box((sleeve, -half, low - 1.0), (crown + 1.0, half, CROWN_ABOVE + 0.01))
        over_the_end = solids.box((floor, -half, -0.7), (crown + 1.0, half, CROWN_ABOVE + 0.01))
        body = body - (along_sleeve + over_the_end).rotate((0.0, 0.0, float(angle)))
    return body


def notch_width(design: CableDesign) -> float:
    """Return the width of a cap's notches in mm: the stretched cable and some air.

    Rubber keeps its volume, so a section shrinks by 1 + strain.
    """
    thin = min(design.section.width, design.section.thickness) / (1 + design.strain_assembled) ** 0.5
    return max(1.0, 1e3 * thin + 0.2)


def link() -> Manifold:
    """Return the strap that joins two rod ends."""
    apart = LINK_PITCH / 2
    outer = LINK_HOLE / 2 + 1.2
    shape = LineString([(-apart, 0), (apart, 0)]).buffer(outer, quad_segs=12)
    holes = unary_union([Point(x, 0).buffer(LINK_HOLE / 2, quad_segs=12) for x in (-apart, apart)])
    return solids.extruded(shape.difference(holes), LINK_THICKNESS)


def coupon_solid(c: Coupon) -> Manifold:
    """Return the pull test's coupon: a strip between two plates with a hole to hang it by."""
    length, width = 1e3 * c.gauge_length, 1e3 * c.width
    grip, plate = 1e3 * c.grip_length, 500 * c.grip_width
    half = length / 2
    outline = [
        (-half - grip, -plate),
        (-half - 4, -plate),
        (-half, -width / 2),
        (half, -width / 2),
        (half + 4, -plate),
        (half + grip, -plate),
    ]
    shape = Polygon([*outline, *((x, -y) for x, y in reversed(outline))])
    holes = unary_union([Point(s * (half + grip - 6), 0).buffer(2.0, quad_segs=12) for s in (-1, 1)])
    return solids.extruded(shape.difference(holes), 1e3 * c.thickness)
