"""The servo's printed parts: its mount on the middle of the servo rod, and the drum that is its arm.

Shapes in mm. The rod's frame has its origin in the rod's middle, x to the module's centre, y along it.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from manifold3d import Manifold

from engine.body import module as t
from engine.body import servo
from engine.fabrication.dimensions.floating_module import CONTRACTED, floating_module
from engine.fabrication.materials import Materials, Printer, ServoMotor
from engine.fabrication.parts import solids
from engine.simulation.built import Built

ROD_DIAMETER: Final = 2e3 * t.ROD_RADIUS
"""In mm (simulated)."""
FLANGE: Final = 0.8
"""Thickness of the flanges of the servo's drum, in mm."""
GROOVE: Final = 1.0
"""Width of the drum's grooves, in mm."""
FLANGE_RISE: Final = 2.4
"""Height of the drum's flanges over its grooves, in mm."""
SERVO_AXIS: Final = (-13.0, -10.5)
"""Where the servo's shaft lies: along the rod and to its side, in mm from the rod's middle. Of the four
quarters round the guide, rods and lines keep out of this one when the module contracts.
"""
DRUM_HEIGHT: Final = 7.0
"""Lower face of the drum above the rod's axis, towards the module's centre, in mm."""
CLAMP: Final = (-12.0, 8.0)
"""Ends of the part of the rod that the mount holds, in mm from its middle."""
PLATE: Final = 4.0
"""Thickness of the mount's plate, in mm."""
LINE_HOLE: Final = 1.2
"""Diameter of the holes by which the lines leave the guide, in mm."""


def elastic_length() -> float:
    """Return how long elastic, knot and loop of an internal cable may be together, in m, at most.

    It is a millimetre less than the shortest cable at full contraction.
    """
    return float(min(servo.TARGET_LENGTHS[-1])) - 0.001


def groove_radii(motor: ServoMotor) -> np.ndarray:
    """Return (5,) radii in mm that wind each internal cable's whole stroke, as ``SERVO_NODES``."""
    stroke = 1e3 * (servo.TARGET_LENGTHS[0] - servo.TARGET_LENGTHS[-1])
    return stroke / np.radians(motor.travel)


def required_torque(motor: ServoMotor) -> float:
    """Return the torque in N m on the drum when it holds the stiffest module contracted."""
    return float(1e-3 * groove_radii(motor) @ line_tensions(t.N_STIFFNESS_LEVELS))


def line_tensions(level: int) -> np.ndarray:
    """Return (5,) tensions in N of the internal cables of a contracted module, as ``SERVO_NODES``.

    Lines have no limit, which the simulated servo has.
    """
    return floating_module(level, CONTRACTED, built=Built(line_limit=0.0)).servo_tensions


def drum_errors(motor: ServoMotor) -> np.ndarray:
    """Return (5,) largest differences in mm between the drum's winding and the simulated servo table."""
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


def mount_blank(motor: ServoMotor, printer: Printer) -> Manifold:
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
    arm = solids.bar((0, 0, 0), (point[0] - 2.0, 0, 0), 1.6, segments=32)
    ball = Manifold.sphere(1e3 * t.ACTUATOR_RADIUS, 32).translate((point[0], point[1], point[2]))
    body = plate + web + tube + arm + ball
    return body - solids.bar((0, -50, 0), (0, 50, 0), bore, segments=solids.SEGMENTS)


def servo_mount(motor: ServoMotor, printer: Printer) -> Manifold:
    """Return the servo's mount in the rod's frame: x to the module's centre, y along the rod."""
    body, point = mount_blank(motor, printer), guide_point()
    for node in t.SERVO_NODES:
        body = body - solids.bar(point, point + 10 * guide_direction(node), LINE_HOLE / 2)
    body = body - Manifold.sphere(1.2, 16).translate((point[0], point[1], point[2]))
    return body - solids.bar(point, point + 8 * line_entry(motor), 1.2)


def guide_point() -> np.ndarray:
    """Return (3,) where the internal cables leave their guide, in mm, in the rod's frame (simulated)."""
    return 1e3 * (t.ACTUATOR_POINT - t.ROD_MIDDLES[t.SERVO_ROD])


def guide_direction(node: int) -> np.ndarray:
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
    """Return the bought servo as boxes, in the rod's frame, in mm; for viewing and for clearances."""
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


def servo_rod_centre_of_mass(materials: Materials, rod_mass: float) -> np.ndarray:
    """Return (3,) of a servo rod with servo, mount and drum, without ballast, in m, in the rod's frame.

    The simulation has it at ``module.SERVO_ROD_CENTRE_OF_MASS``. ``rod_mass`` is of the rod with its
    caps, in kg; the servo counts as evenly filled.
    """
    motor, density = materials.servo, 1e-9 * materials.plastic.density
    mount, drum, body = servo_mount(motor, materials.printer), drum_in_place(motor), servo_body(motor)
    masses = np.array([motor.mass, density * mount.volume(), density * drum.volume(), rod_mass])
    centres = np.array([*(solids.centroid(s) for s in (body, mount, drum)), np.zeros(3)])
    return 1e-3 * masses @ centres / masses.sum()


def laid(mount: Manifold) -> Manifold:
    """Lay the mount on its plate, the guide up: x becomes z."""
    return solids.placed(mount, np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]), np.zeros(3))
