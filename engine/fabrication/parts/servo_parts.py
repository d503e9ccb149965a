"""The servo's mount: it divides the servo rod, holds the servo in the gap and a counterweight beside it.

The published rod has its centre of mass 2.7 mm off its middle. A servo does not fit into that middle: rods,
cables and lines of a contracted module pass through it. So the servo is small, it lies in the only room
that is left, and a piece of steel on the other side of the middle balances it. Shapes in mm. The rod's
frame has its origin in the rod's middle, x to the module's centre, y along it.
"""

from __future__ import annotations

import functools
import math
from typing import Final

import numpy as np
from manifold3d import Manifold

from engine.body import module as t
from engine.body import servo
from engine.fabrication.dimensions.floating_module import floating_module
from engine.fabrication.materials import CAP_TIP, Materials, Printer, ServoMotor
from engine.fabrication.parts import drum, solids

ROD_DIAMETER: Final = 2e3 * t.ROD_RADIUS
"""In mm (simulated)."""
CRADLE: Final = (-4.0, 2.0)
"""Ends of the cradle round three sides of the servo's case, from outside to inside."""
RIM: Final = 2.5
"""Thickness of its walls. The fourth side is open: a cable passes there when the module contracts."""
SOCKET: Final = 3.2
"""How deep each half of the rod goes into the mount, up to the servo."""
TUBE: Final = 1.0
"""Thickness of the sockets' walls."""
ARM: Final = 2.4
"""Radius of the arm that carries the ball."""
ARM_BORE: Final = 1.2
"""Radius of its bore, through which the lines go to the ball."""
LINE_HOLE: Final = 1.2
"""Diameter of the fairleads, and of the holes by which the lines leave the ball."""
BALLAST_AT: Final = (8.5, 5.0, 0.5)
"""Where the counterweight begins; from there it goes along the rod, towards node 1."""
BALLAST_RADIUS: Final = 6.0
"""Of the counterweight, a piece of round steel."""
STEEL: Final = 7850.0
"""Density of the counterweight, in kg/m3."""
CAPS: Final = 0.0006
"""Typical mass of a servo rod's two caps and its share of net, links and lines, in kg: the counterweight is
the same for all modules."""


def elastic_length() -> float:
    """Return how long elastic, knot and loop of an internal cable may be together, in m, at most.

    It is a millimetre less than the shortest cable at full contraction.
    """
    return float(min(servo.TARGET_LENGTHS[-1])) - 0.001


def body_centre(motor: ServoMotor) -> tuple[float, float]:
    """Return where the servo's case lies: (y, z) of its middle, in mm."""
    return drum.SERVO_AXIS[0] + 1e3 * motor.shaft_offset, drum.SERVO_AXIS[1]


def case_span(motor: ServoMotor) -> tuple[float, float]:
    """Return the ends of the servo's case along x, in mm; the drum just clears it."""
    top = drum.DRUM_HEIGHT - 0.5
    return top - 1e3 * motor.body_height, top


def servo_body(motor: ServoMotor) -> Manifold:
    """Return the bought servo, its ears cut off, in the rod's frame; for viewing and for clearances."""
    y0, z0 = body_centre(motor)
    low, high = case_span(motor)
    half = (500 * motor.body_length, 500 * motor.body_width)
    case = solids.box((low, y0 - half[0], z0 - half[1]), (high, y0 + half[0], z0 + half[1]))
    y, z = drum.SERVO_AXIS
    end = drum.DRUM_HEIGHT + drum.shaft_depth(motor)
    shaft = solids.bar((high - 1.0, y, z), (end, y, z), 500 * motor.shaft_diameter - 0.05)
    return case + shaft


def rod_gap(motor: ServoMotor, printer: Printer) -> tuple[float, float]:
    """Return where the halves of the servo rod end beside the servo: y of both ends, in mm."""
    y0, _ = body_centre(motor)
    half = 500 * motor.body_length + 500 * printer.clearance
    return y0 - half, y0 + half


def mount_blank(motor: ServoMotor, printer: Printer, ballast: float) -> Manifold:
    """Return the mount before anything is drilled for the lines.

    Args:
        motor: the servo that it holds.
        printer: its clearance.
        ballast: length of the counterweight, in mm.
    """
    gap = 500 * printer.clearance
    bore = ROD_DIAMETER / 2 + gap
    _, z0 = body_centre(motor)
    half_width = 500 * motor.body_width + gap
    low, high = CRADLE
    left, right = rod_gap(motor, printer)
    cradle = solids.box((low, left - RIM, z0 - half_width), (high, right + RIM, z0 + half_width + RIM))
    window = solids.box((low - 30, left, z0 - half_width - 9), (high + 30, right, z0 + half_width))
    x, y, z = BALLAST_AT
    cup_end = y + ballast
    tube_end = max(right + SOCKET, y + 4.0)
    thick = bore + TUBE
    tubes = solids.bar((0, left - SOCKET, 0), (0, left, 0), thick, segments=solids.SEGMENTS)
    tubes = tubes + solids.bar((0, right, 0), (0, tube_end, 0), thick, segments=solids.SEGMENTS)
    cup = BALLAST_RADIUS + gap
    holder = solids.bar((x, y - 1.0, z), (x, cup_end, z), cup + 0.8, segments=solids.SEGMENTS)
    web = solids.box((0.0, y - 1.0, -1.6), (x, tube_end, 1.6))
    point = guide_point()
    arm = solids.bar((0, 0, 0), (point[0], 0, 0), ARM, segments=32)
    ball = Manifold.sphere(1e3 * t.ACTUATOR_RADIUS, 32).translate((point[0], point[1], point[2]))
    body = cradle + tubes + holder + web + arm + ball
    body = body - window
    body = body - solids.bar((x, y, z), (x, cup_end + 1.0, z), cup, segments=solids.SEGMENTS)
    body = body - solids.bar((0, left - 50, 0), (0, left, 0), bore, segments=solids.SEGMENTS)
    return body - solids.bar((0, right, 0), (0, right + 50, 0), bore, segments=solids.SEGMENTS)


@functools.lru_cache(maxsize=16)
def servo_mount(materials: Materials) -> Manifold:
    """Return the servo's mount in the rod's frame: x to the module's centre, y along the rod."""
    motor = materials.servo
    body, point = mount_blank(motor, materials.printer, ballast_length(materials)), guide_point()
    for node in t.SERVO_NODES:
        body = body - solids.bar(point, point + 10 * guide_direction(node), LINE_HOLE / 2)
    for height, ends in zip(drum.groove_heights(), line_ways(motor), strict=True):
        inside = (drum.DRUM_HEIGHT + height, 0.0, 0.0)
        for y, z in ends:
            body = body - solids.bar(inside, (inside[0], y, z), LINE_HOLE / 2)
    body = body - Manifold.sphere(ARM_BORE, 16).translate((point[0], point[1], point[2]))
    first = drum.DRUM_HEIGHT + float(drum.groove_heights().min())
    return body - solids.bar((first - 0.6, 0, 0), point, ARM_BORE, segments=24)


def line_ways(motor: ServoMotor) -> list[list[np.ndarray]]:
    """Return for each internal cable two points (y, z) beyond the arm, where its line comes from.

    The line comes from where it leaves the drum, which moves as the drum turns.
    """
    found = []
    for h in drum.arms(motor).T:
        backs = [_leaves_drum(arm) - drum.FAIRLEAD for arm in (h.min(), h.max())]
        found.append([np.add(drum.FAIRLEAD, 3.0 * back / np.hypot(*back)) for back in backs])
    return found


def _leaves_drum(arm: float) -> np.ndarray:
    """Return (y, z) where a line leaves the drum that passes the servo's axis at a distance."""
    towards = np.subtract(drum.FAIRLEAD, drum.SERVO_AXIS)
    distance, angle = float(np.hypot(*towards)), math.atan2(towards[1], towards[0])
    normal = angle + math.acos(arm / distance)
    return np.add(drum.SERVO_AXIS, arm * np.array([math.cos(normal), math.sin(normal)]))


def line_path(motor: ServoMotor, node: int) -> np.ndarray:
    """Return (3, 3) the way of a line at command 0: from the drum into the arm, to the ball. In mm."""
    k = t.SERVO_NODES.index(node)
    height = drum.DRUM_HEIGHT + drum.groove_heights()[k]
    leaves = _leaves_drum(float(drum.arms(motor)[0, k]))
    return np.array([[height, *leaves], [height, 0.0, 0.0], guide_point()])


def guide_point() -> np.ndarray:
    """Return (3,) where the internal cables leave their guide, in mm, in the rod's frame (simulated)."""
    return 1e3 * (t.ACTUATOR_POINT - t.ROD_MIDDLES[t.SERVO_ROD])


def guide_direction(node: int) -> np.ndarray:
    """Return the direction from the guide to a node, as in a floating module with its servo off."""
    nodes = floating_module(t.N_STIFFNESS_LEVELS, None).nodes
    middle = nodes[list(t.RODS[t.SERVO_ROD])].mean(axis=0)
    towards = 1e3 * (nodes[node] - middle) - guide_point()
    return towards / np.linalg.norm(towards)


def half_rods(materials: Materials) -> tuple[float, float]:
    """Return the lengths in m of the two pieces of the servo rod, at node 0 and at node 1.

    Each reaches from the mount to where its cap's tip begins.
    """
    left, right = rod_gap(materials.servo, materials.printer)
    end = t.ROD_LENGTH / 2 - CAP_TIP
    return end + 1e-3 * left, end - 1e-3 * right


def _hardware(materials: Materials) -> list[tuple[float, np.ndarray]]:
    """Return masses in kg and centres in mm of servo, drum and halves of the rod."""
    motor, density = materials.servo, 1e-9 * materials.plastic.density
    wound = drum.drum_in_place(motor)
    left, right = half_rods(materials)
    end = 500 * t.ROD_LENGTH
    area = math.pi * (t.ROD_RADIUS**2 - ((materials.rod.bore or 0.0) / 2) ** 2)
    return [
        (motor.mass, solids.centroid(servo_body(motor))),
        (density * wound.volume(), solids.centroid(wound)),
        (materials.rod.density * area * left, np.array([0.0, -end + 500 * left, 0.0])),
        (materials.rod.density * area * right, np.array([0.0, end - 500 * right, 0.0])),
    ]


@functools.lru_cache(maxsize=16)
def ballast_length(materials: Materials) -> float:
    """Return the length in mm of the counterweight: what a servo rod lacks to its simulated mass.

    The mass of the mount, which holds the counterweight, hardly depends on that length.
    """
    density = 1e-9 * materials.plastic.density
    bare = sum(mass for mass, _ in _hardware(materials)) + CAPS
    bare += sum(f.per_module * f.mass for f in materials.fasteners)
    bare += density * mount_blank(materials.servo, materials.printer, 15.0).volume()
    each = STEEL * math.pi * (1e-3 * BALLAST_RADIUS) ** 2
    return float(np.clip(1e3 * (t.SERVO_ROD_MASS - bare) / each, 1.0, 18.0))


def ballast_mass(materials: Materials) -> float:
    """Return the mass of the counterweight, in kg."""
    return STEEL * math.pi * (1e-3 * BALLAST_RADIUS) ** 2 * 1e-3 * ballast_length(materials)


def ballast(materials: Materials) -> Manifold:
    """Return the counterweight in its cup, in the rod's frame."""
    x, y, z = BALLAST_AT
    return solids.bar(
        (x, y, z), (x, y + ballast_length(materials), z), BALLAST_RADIUS, segments=solids.SEGMENTS
    )


def servo_rod_centre_of_mass(materials: Materials, caps: float = CAPS) -> np.ndarray:
    """Return (3,) the centre of mass of a servo rod, in m, in the rod's frame.

    The simulation has it at ``module.SERVO_ROD_CENTRE_OF_MASS``. The servo counts as evenly filled.

    Args:
        materials: what it is built from.
        caps: mass of the rod's two caps, in kg.
    """
    mount, ballast = servo_mount(materials), ballast_mass(materials)
    length = ballast_length(materials)
    x, y, z = BALLAST_AT
    pieces = [
        *_hardware(materials),
        (1e-9 * materials.plastic.density * mount.volume(), solids.centroid(mount)),
        (ballast, np.array([x, y + length / 2, z])),
        (caps, np.zeros(3)),
    ]
    masses = np.array([mass for mass, _ in pieces])
    return 1e-3 * masses @ np.array([centre for _, centre in pieces]) / masses.sum()


def laid(mount: Manifold) -> Manifold:
    """Lay the mount on its plate, the guide up: x becomes z."""
    return solids.placed(mount, np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]), np.zeros(3))
