"""The parts to print: shapes in mm, derived from the robot's model and the materials.

A **cap** sits on every rod end. The eyelet of the net (or the knots) lies on the bare rod below the cap;
the four cables of the node run along the cap's sleeve, turn inwards over the notches of its crown and
leave there, 1.5 mm from the axis, as in the simulation. Cables pull the sleeve up and the crown down
with the same force: the cap needs no more glue than keeps it from turning.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import Final

import numpy as np
from manifold3d import Manifold
from shapely.geometry import LineString, Point, Polygon
from shapely.ops import unary_union

from engine import servo
from engine import tensegrity as t
from engine.fabrication import solids
from engine.fabrication.cables import CableDesign, design_cables
from engine.fabrication.materials import CAP_TIP, Materials, Printer, ServoMotor
from engine.fabrication.module_state import floating_module
from engine.fabrication.net import EYELET_HOLE, EYELET_RADIUS, Net, module_net
from engine.fabrication.pull_test import Coupon, coupon
from engine.morphology import Morphology

CORNER_AREA: Final = 0.1
"""What a disc cannot reach of a sharp corner, in mm2: less than this is no thin wall."""
ROD_DIAMETER: Final = 2e3 * t.ROD_RADIUS
EYELET_THICKNESS: Final = 1.2
"""Of the net's rings, in mm; thicker than the cables, so that they grip."""
CROWN_BELOW: Final = 3.0
CROWN_ABOVE: Final = 0.6
"""The crown reaches from below to above the node's plane, in mm; rods of the simulation end 0.6 above."""
CROWN_TEETH: Final = 1.0
"""Height of the teeth between which the cables lie, over the sleeve, in mm."""
NECK: Final = 1.2
"""Radius and height of the neck that a link's ring snaps onto, in mm."""
HEAD: Final = (1.6, 0.8)
"""Radius and height of the knob that keeps the ring on the neck, in mm."""
LINK_HOLE: Final = 2.2
LINK_WALL: Final = 0.8
"""Of a link: its holes stretch onto the necks; between them is one wall, so they lie 3 mm apart."""
LINK_THICKNESS: Final = 1.0
FLANGE: Final = 0.8
GROOVE: Final = 1.0
FLANGE_RISE: Final = 2.4
"""Of the servo's drum: thickness of its flanges, width of its grooves, height of flanges over grooves."""
SERVO_AXIS: Final = (-13.0, -10.5)
"""Where the servo's shaft lies: along the rod and to its side, in mm from the rod's middle. Of the four
quarters round the guide it is the one that rods and lines keep away from when the module contracts."""
DRUM_HEIGHT: Final = 7.0
"""Lower face of the drum above the rod's axis, towards the module's centre, in mm."""
CLAMP: Final = (-12.0, 8.0)
"""The mount holds the rod from here to there, in mm from its middle."""
PLATE: Final = 4.0


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class PrintedPart:
    """A part to print, as it lies on the bed: its lowest point at z = 0.

    Attributes:
        name: of its files, without ending: ``cap_16.0mm``.
        quantity: how many the robot needs.
        modules: that need it.
        solid: in mm.
        flexible: whether it is printed of the cables' material; otherwise of ``[plastic]``.
        density: in kg/m3.
        min_wall: what its walls were checked against, in mm.
        thin_area: largest area in a slice that is thinner than that, in mm2.
        fits: whether it lies inside the printer's bed.
        note: what it is for and how to print it.
    """

    name: str
    quantity: int
    modules: tuple[int, ...]
    solid: Manifold
    flexible: bool
    density: float
    min_wall: float
    thin_area: float
    fits: bool
    note: str

    @property
    def walls_hold(self) -> bool:
        """Whether no wall is thinner than ``min_wall``; a corner's tip does not count."""
        return self.thin_area <= CORNER_AREA

    @property
    def volume(self) -> float:
        """In m3."""
        return 1e-9 * self.solid.volume()

    @property
    def mass(self) -> float:
        """Of one, printed solid, in kg."""
        return self.density * self.volume

    @property
    def size(self) -> tuple[float, float, float]:
        """In x, y and z, in m."""
        x, y, z = solids.extent(self.solid)
        return 1e-3 * x, 1e-3 * y, 1e-3 * z


@functools.lru_cache(maxsize=32)
def printed_parts(morphology: Morphology, materials: Materials) -> tuple[PrintedPart, ...]:
    """Return the parts to print for a robot, each kind once with its quantity."""
    designs = design_cables(morphology, materials)
    n = morphology.n_modules
    everywhere = tuple(range(n))
    result = []
    by_level = {d.level: d for d in designs}
    for level, design in sorted(by_level.items()):
        modules = tuple(d.module for d in designs if d.level == level)
        if materials.cable.form == "printed":
            net = module_net(design, materials.printer)
            result.append(
                _part(
                    f"net_stiffness_{level / t.N_STIFFNESS_LEVELS:.1f}",
                    len(modules),
                    modules,
                    net_solid(net, design),
                    materials,
                    "the 24 cables of a module in one piece; print it solid, lines along the cables,"
                    " this side up = outside",
                    flexible=True,
                )
            )
        result.append(
            _part(
                f"cap_stiffness_{level / t.N_STIFFNESS_LEVELS:.1f}",
                2 * len(t.RODS) * len(modules),
                modules,
                cap(design, materials.printer),
                materials,
                f"on every rod end; the cables lie {1e3 * design.tail:.1f} mm along it; print it on its"
                " sleeve's end, crown up",
            )
        )
    result += [
        _part(
            "servo_mount",
            n,
            everywhere,
            _laid(servo_mount(materials.servo, materials.printer)),
            materials,
            "on the middle of each servo rod; holds the servo and guides its five lines; print it on its"
            " plate, the guide up",
            # where a slanting hole leaves a ball its rim is sharp, which is no thin wall
            walls=_laid(_mount_blank(materials.servo, materials.printer)),
        ),
        _part(
            "servo_drum",
            n,
            everywhere,
            servo_drum(materials.servo),
            materials,
            "the servo's arm: five grooves that wind the internal cables while it turns counter-clockwise,"
            " seen from above; print it wide end down",
        ),
    ]
    if n > 1:
        result.append(
            _part(
                "link",
                len(t.JOINT_ORDER) * (n - 1),
                everywhere,
                link(),
                materials,
                "ties two rod ends of neighbouring modules; print it of flexible material",
                flexible=True,
            )
        )
    if materials.cable.form == "printed":
        result.append(
            _part(
                "pull_coupon",
                1,
                everywhere,
                coupon_solid(coupon(morphology, materials)),
                materials,
                "for the pull test; print it with the net's settings",
                flexible=True,
            )
        )
    return tuple(result)


def _part(
    name: str,
    quantity: int,
    modules: tuple[int, ...],
    solid: Manifold,
    materials: Materials,
    note: str,
    *,
    flexible: bool = False,
    walls: Manifold | None = None,
) -> PrintedPart:
    printer = materials.printer
    wall = 1e3 * (printer.nozzle if flexible else printer.min_wall)
    low = solid.bounding_box()
    solid = solid.translate((-low[0], -low[1], -low[2]))
    size = solids.extent(solid)
    bed = (printer.bed_x, printer.bed_y, printer.bed_z)
    # a link is of printed rubber even where the cables are cord
    density = materials.cable.density if flexible else materials.plastic.density
    return PrintedPart(
        name=name,
        quantity=quantity,
        modules=modules,
        solid=solid,
        flexible=flexible,
        density=density,
        min_wall=wall,
        thin_area=solids.thin_area(walls or solid, wall),
        fits=all(s <= 1e3 * b + 1e-6 for s, b in zip(size, bed, strict=True)),
        note=note,
    )


def net_outline(net: Net, design: CableDesign) -> Polygon:
    """Return the net as it is cut or printed, in mm, holes and all."""
    width = 1e3 * design.section.width
    points = [(1e3 * e.position[0], 1e3 * e.position[1]) for e in net.eyelets]
    cables = [
        LineString([points[i] for i in c.eyelets]).buffer(width / 2, cap_style="flat") for c in net.cables
    ]
    rings = [Point(p).buffer(1e3 * EYELET_RADIUS, quad_segs=solids.SEGMENTS // 4) for p in points]
    return unary_union([*cables, *rings]).difference(_holes(net))


def _holes(net: Net) -> Polygon:
    return unary_union(
        [
            Point(1e3 * e.position[0], 1e3 * e.position[1]).buffer(
                500 * EYELET_HOLE, quad_segs=solids.SEGMENTS // 4
            )
            for e in net.eyelets
        ]
    )


def net_solid(net: Net, design: CableDesign) -> Manifold:
    """Return the net: cables of their section, and rings that are thicker."""
    thickness = 1e3 * design.section.thickness
    flat = solids.extruded(net_outline(net, design), thickness)
    rings = unary_union(
        [
            Point(1e3 * e.position[0], 1e3 * e.position[1]).buffer(
                1e3 * EYELET_RADIUS, quad_segs=solids.SEGMENTS // 4
            )
            for e in net.eyelets
        ]
    ).difference(_holes(net))
    return flat + solids.extruded(rings, max(EYELET_THICKNESS, thickness))


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


def cap(design: CableDesign, printer: Printer) -> Manifold:
    """Return a rod's end cap along z, the node's plane at 0 and the rod below it."""
    wall, clearance = 1e3 * printer.min_wall, 1e3 * printer.clearance
    bore = (ROD_DIAMETER + clearance) / 2
    sleeve = bore + wall
    crown = sleeve + CROWN_TEETH
    low = -1e3 * design.tail
    body = solids.cylinder(sleeve, low, CROWN_ABOVE) + solids.cylinder(
        crown, max(low, -CROWN_BELOW), CROWN_ABOVE
    )
    top = CROWN_ABOVE + NECK
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
    apart = (LINK_HOLE + LINK_WALL) / 2
    outer = LINK_HOLE / 2 + 1.2
    shape = LineString([(-apart, 0), (apart, 0)]).buffer(outer, quad_segs=12)
    holes = unary_union([Point(x, 0).buffer(LINK_HOLE / 2, quad_segs=12) for x in (-apart, apart)])
    return solids.extruded(shape.difference(holes), LINK_THICKNESS)


def groove_radii(motor: ServoMotor) -> np.ndarray:
    """Return (5,) radii in mm that wind each internal cable's whole stroke, as ``SERVO_NODES``."""
    stroke = 1e3 * (servo.TARGET_LENGTHS[0] - servo.TARGET_LENGTHS[-1])
    return stroke / np.radians(motor.travel)


def required_torque(motor: ServoMotor) -> float:
    """Return the torque in N m on the drum when all internal cables pull as much as they may."""
    return float(1e-3 * groove_radii(motor).sum() * t.SERVO_MAX_TENSION)


def drum_errors(motor: ServoMotor) -> np.ndarray:
    """Return (5,) largest differences in mm between what the drum winds and the simulated servo table."""
    angle = np.linspace(0.0, np.radians(motor.travel), len(servo.TARGET_LENGTHS))[:, None]
    wound = 1e3 * servo.TARGET_LENGTHS[0] - angle * groove_radii(motor)
    return np.abs(wound - 1e3 * servo.TARGET_LENGTHS).max(axis=0)


def drum_order(motor: ServoMotor) -> tuple[int, ...]:
    """Return the internal cables' nodes from the drum's lower groove to its upper one: wide ones below."""
    radii = groove_radii(motor)
    return tuple(t.SERVO_NODES[k] for k in np.argsort(-radii))


def servo_drum(motor: ServoMotor) -> Manifold:
    """Return the servo's drum along z, the servo below it."""
    radii = np.sort(groove_radii(motor))[::-1]
    z = 0.0
    body = solids.cylinder(radii[0] + FLANGE_RISE, z, z + FLANGE)
    holes = []
    for k, r in enumerate(radii):
        z += FLANGE
        body = body + solids.cylinder(r, z - 0.1, z + GROOVE)
        z += GROOVE
        body = body + solids.cylinder(r + FLANGE_RISE, z - 0.01, z + FLANGE)
        # the line is knotted through its flange; holes stand apart so that knots do not meet
        hole = solids.cylinder(0.4, z - 0.02, z + FLANGE + 0.01, segments=16)
        holes.append(hole.translate((r + FLANGE_RISE / 2, 0.0, 0.0)).rotate((0.0, 0.0, 72.0 * k)))
    bore = solids.cylinder(500 * motor.shaft_diameter + 0.05, -1.0, z + FLANGE + 1.0)
    for hole in holes:
        body = body - hole
    return body - bore


def _mount_blank(motor: ServoMotor, printer: Printer) -> Manifold:
    """Return the mount before the guide's ball is drilled."""
    bore = (ROD_DIAMETER + 1e3 * printer.clearance) / 2
    gap = 1e3 * printer.clearance
    y0, z0 = body_centre(motor)
    ears = ear_plane(motor)
    low, high = ears - PLATE, ears
    half_length, half_width = 500 * motor.body_length + gap, 500 * motor.body_width + gap
    rim = max(1e3 * printer.min_wall, 0.8)
    outer = 500 * motor.ear_length + 1.0
    plate = solids.box((low, y0 - outer, z0 - half_width - rim), (high, y0 + outer, z0 + half_width + rim))
    window = solids.box(
        (low - 1, y0 - half_length, z0 - half_width), (high + 1, y0 + half_length, z0 + half_width)
    )
    plate = plate - window
    for side in (-1, 1):
        y = y0 + side * 500 * motor.screw_spacing
        plate = plate - solids.bar((low - 1, y, z0), (high + 1, y, z0), 0.8)
    web = solids.box((low, CLAMP[0], z0 + half_width), (high, CLAMP[1], 0.0))
    tube = solids.bar((0, CLAMP[0], 0), (0, CLAMP[1], 0), bore + 1.6, segments=solids.SEGMENTS)
    point = guide_point()
    arm = solids.box((0.0, -2.0, -2.0), (point[0] - 2.0, 2.0, 2.0))
    ball = Manifold.sphere(1e3 * t.ACTUATOR_RADIUS, 32).translate((point[0], point[1], point[2]))
    body = plate + web + tube + arm + ball
    return body - solids.bar((0, -50, 0), (0, 50, 0), bore, segments=solids.SEGMENTS)


def servo_mount(motor: ServoMotor, printer: Printer) -> Manifold:
    """Return the servo's mount in the rod's frame: x to the module's centre, y along the rod."""
    body, point = _mount_blank(motor, printer), guide_point()
    for node in t.SERVO_NODES:
        body = body - solids.bar(point, point + 10 * _direction(node), 0.6)
    body = body - Manifold.sphere(1.2, 16).translate((point[0], point[1], point[2]))
    return body - solids.bar(point, point + 8 * line_entry(motor), 1.2)


def guide_point() -> np.ndarray:
    """Return (3,) where the internal cables leave their guide, in mm, in the rod's frame (simulated)."""
    return 1e3 * (t.ACTUATOR_POINT - t.NODES[list(t.RODS[t.SERVO_ROD])].mean(axis=0))


def _direction(node: int) -> np.ndarray:
    """Return the direction from the guide to a node, as in a floating module with its servo off."""
    nodes = floating_module(t.N_STIFFNESS_LEVELS, None).nodes
    middle = nodes[list(t.RODS[t.SERVO_ROD])].mean(axis=0)
    towards = 1e3 * (nodes[node] - middle) - guide_point()
    return towards / np.linalg.norm(towards)


def line_entry(motor: ServoMotor) -> np.ndarray:
    """Return the direction from the guide to where the lines come off the drum's middle groove."""
    y, z = SERVO_AXIS
    distance = np.hypot(y, z)
    turn = np.arctan2(z, y) - np.arcsin(np.median(groove_radii(motor)) / distance)
    middle = DRUM_HEIGHT + 2.5 * (FLANGE + GROOVE)
    towards = np.array([middle - guide_point()[0], distance * np.cos(turn), distance * np.sin(turn)])
    return towards / np.linalg.norm(towards)


def body_centre(motor: ServoMotor) -> tuple[float, float]:
    """Return where the servo's case lies beside the rod: (y, z) of its middle, in mm."""
    return SERVO_AXIS[0] - 1e3 * motor.shaft_offset, SERVO_AXIS[1]


def ear_plane(motor: ServoMotor) -> float:
    """Return x of the ears' underside in mm: the drum just clears the case, the shaft reaches into it."""
    return DRUM_HEIGHT - 0.5 - 1e3 * (motor.body_height - motor.ear_height)


def servo_body(motor: ServoMotor) -> Manifold:
    """Return the bought servo as boxes, in the rod's frame, in mm; to be looked at and for clearances."""
    y0, z0 = body_centre(motor)
    ears = ear_plane(motor)
    bottom = ears - 1e3 * motor.ear_height
    half = (500 * motor.body_length, 500 * motor.body_width)
    case = solids.box(
        (bottom, y0 - half[0], z0 - half[1]), (bottom + 1e3 * motor.body_height, y0 + half[0], z0 + half[1])
    )
    lugs = solids.box(
        (ears, y0 - 500 * motor.ear_length, z0 - half[1]),
        (ears + 2.5, y0 + 500 * motor.ear_length, z0 + half[1]),
    )
    y, z = SERVO_AXIS
    shaft = solids.bar(
        (ears, y, z), (ears + 1e3 * motor.shaft_height, y, z), 500 * motor.shaft_diameter - 0.05
    )
    return case + lugs + shaft


def drum_in_place(motor: ServoMotor) -> Manifold:
    """Return the drum on its servo, in the rod's frame, in mm."""
    y, z = SERVO_AXIS
    turned = solids.frame_along(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    return solids.placed(servo_drum(motor), turned, np.array([DRUM_HEIGHT, y, z]))


def _laid(mount: Manifold) -> Manifold:
    """Lay the mount on its plate, the guide up: x becomes z."""
    return solids.placed(mount, np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]), np.zeros(3))


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
