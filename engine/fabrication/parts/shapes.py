"""Net, caps, links and coupon as solids, in mm.

A **cap** sits on every rod end. On its post, at the node, lies the ring of the net (two where the net is
cut), on a rim that slopes away as the cables do. Four cables leave the ring, 23 to 55 degrees down and
outwards, and so they press it on the rim; they pull the cap on its rod. A ring is put on over the cap's knob
and comes off the same way.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np
from manifold3d import CrossSection, Manifold
from shapely.geometry import LineString, Point, Polygon
from shapely.ops import unary_union

from engine.fabrication.dimensions.cables import RING_RADIUS, CableDesign
from engine.fabrication.dimensions.limiter import HOLE
from engine.fabrication.dimensions.pull_test import Coupon
from engine.fabrication.materials import CAP_SLEEVE, CAP_TIP, Printer
from engine.fabrication.parts import solids
from engine.fabrication.parts.net import EYELET_HOLE, Net
from engine.fabrication.parts.servo_parts import ROD_DIAMETER

POST: Final = 1.5
"""Radius of the post that the net's rings lie on, in mm."""
POST_TOP: Final = 0.6
"""How far the post reaches beyond the node's plane, in mm; the simulated rods end there too."""
SEAT: Final = (0.5, 2.3)
"""How far the rim lies below the node's plane, at most, and to which radius it is flat, in mm."""
SLOPE: Final = 39.0
"""By which the rim slopes from there to its edge, in degrees: the middle of the directions of the cables."""
RIM: Final = 0.6
"""Thickness of its edge, in mm."""
FILLET: Final = 0.6
"""Radius of the inner corners of a net, in mm."""
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
    rings, holes = (
        unary_union([Point(p).buffer(radius, quad_segs=solids.SEGMENTS // 4) for p in points])
        for radius in (1e3 * RING_RADIUS, 500 * EYELET_HOLE)
    )
    # where strips meet, a sharp corner would tear
    whole = unary_union([*cables, rings]).buffer(FILLET, quad_segs=6).buffer(-FILLET, quad_segs=6)
    return whole.difference(holes)


def net_solid(net: Net, design: CableDesign) -> Manifold:
    """Return the net, as thick as its cables."""
    return solids.extruded(net_outline(net, design), 1e3 * design.section.thickness)


def neck_height(*, footed: bool) -> float:
    """Return how high the neck of a cap is, in mm: where robots have feet, a foot's rim shares it."""
    return NECK + (FOOT_LIP if footed else 0.0)


def post_top(design: CableDesign) -> float:
    """Return how far a cap's post reaches beyond the node's plane, in mm: two rings lie on it."""
    return max(POST_TOP, 2e3 * design.section.thickness - _seat(design) + 0.1)


def _seat(design: CableDesign) -> float:
    """Return how far below the node's plane the rings lie, in mm: the middle of two is at the node."""
    return min(1e3 * design.section.thickness, SEAT[0])


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class CapShape:
    """The measures of a cap that depend on its net and its printer, in mm.

    Attributes:
        sleeve, rim: radii.
        low: height of the sleeve's end over the node's plane, and so on upwards:
        edge: of the upper side of the rim's edge.
        seat: of what the rings lie on.
        post, neck: of the upper ends of these.
    """

    sleeve: float
    rim: float
    low: float
    edge: float
    seat: float
    post: float
    neck: float

    @property
    def top(self) -> float:
        """Height of the knob's upper side."""
        return self.neck + HEAD[1]

    @property
    def half(self) -> list[tuple[float, float]]:
        """Half the outline of the cap cut along its rod: radius and height, from the sleeve's end."""
        return [
            (self.sleeve, self.low),
            # by 45 degrees: the rim is printed without support
            (self.sleeve, self.edge - RIM - (self.rim - self.sleeve)),
            (self.rim, self.edge - RIM),
            (self.rim, self.edge),
            (SEAT[1], self.seat),
            (POST, self.seat),
            (POST, self.post),
            (NECK, self.post),
            (NECK, self.neck),
            (HEAD[0], self.neck),
            (HEAD[0], self.top),
        ]

    @property
    def outline(self) -> list[tuple[float, float]]:
        """All of it, the rod to the right: height and distance from the axis."""
        return [(z, r) for r, z in self.half] + [(z, -r) for r, z in self.half[::-1]]


def cap_shape(design: CableDesign, printer: Printer, *, footed: bool = False) -> CapShape:
    """Return the measures of a cap; arguments as for ``cap``."""
    sleeve, seat, post = bore(printer) + 1e3 * printer.min_wall, -_seat(design), post_top(design)
    rim = max(1e3 * RING_RADIUS, sleeve)
    return CapShape(
        sleeve=sleeve,
        rim=rim,
        low=-1e3 * CAP_SLEEVE,
        edge=seat - (rim - SEAT[1]) * math.tan(math.radians(SLOPE)),
        seat=seat,
        post=post,
        neck=post + neck_height(footed=footed),
    )


def bore(printer: Printer) -> float:
    """Return the radius of the bore that a rod goes into, in mm."""
    return (ROD_DIAMETER + 1e3 * printer.clearance) / 2


def cap(design: CableDesign, printer: Printer, *, footed: bool = False, line: bool = True) -> Manifold:
    """Return a rod's end cap along z, the node's plane at 0 and the rod below it.

    Args:
        design: of the cables that it holds.
        printer: what prints it.
        footed: whether the robot has feet, which share the cap's neck with a link.
        line: whether it has the hole by which the line of an internal cable goes on inside the rod.
    """
    shape = cap_shape(design, printer, footed=footed)
    outline = np.array([(0.0, shape.low), *shape.half, (0.0, shape.top)])
    body = CrossSection([outline]).revolve(solids.SEGMENTS)
    body = body - solids.cylinder(bore(printer), shape.low - 1.0, -1e3 * CAP_TIP)
    return body - solids.bar(*line_hole(), HOLE / 2) if line else body


def line_hole() -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return the axis of a cap's hole for a line, in mm: from the rod's end out below the ring."""
    return (0.0, 0.0, -1e3 * CAP_TIP - 0.1), (1e3 * RING_RADIUS + 1.0, 0.0, -0.75)


def link() -> Manifold:
    """Return the strap that joins two rod ends."""
    apart = LINK_PITCH / 2
    outer = LINK_HOLE / 2 + 1.2
    shape = LineString([(-apart, 0), (apart, 0)]).buffer(outer, quad_segs=12)
    holes = unary_union([Point(x, 0).buffer(LINK_HOLE / 2, quad_segs=12) for x in (-apart, apart)])
    return solids.extruded(shape.difference(holes), LINK_THICKNESS)


def coupon_outline(c: Coupon) -> Polygon:
    """Return the pull test's coupon from above: a strip between two plates with a hole to hang it by."""
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
    return shape.difference(holes)


def coupon_solid(c: Coupon) -> Manifold:
    """Return the pull test's coupon."""
    return solids.extruded(coupon_outline(c), 1e3 * c.thickness)
