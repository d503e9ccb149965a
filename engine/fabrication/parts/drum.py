"""The servo's drum: five cams, one on the other, that wind the internal cables.

It is printed as six discs, so that nothing hangs in the air: each of the lower five is a flange with a cam
on it, the last is a flange alone. A peg on each cam goes into the next flange and holds both at the right
turn. The line of a groove goes in the groove's own plane to a fairlead, a hole beside the drum
(``servo_parts``), so that it never climbs a flange. Shapes in mm, the drum along z with its lower face at
0, as it stands at command 0; angles as seen from above, 0 along the servo rod.
"""

from __future__ import annotations

import functools
import itertools
from typing import Final

import numpy as np
from manifold3d import Manifold
from shapely.geometry import LineString, Point, Polygon
from shapely.ops import unary_union

from engine.body import module as t
from engine.body import servo
from engine.fabrication.dimensions.floating_module import CONTRACTED, floating_module
from engine.fabrication.materials import ServoMotor
from engine.fabrication.parts import cams, solids
from engine.simulation.built import Built

SERVO_AXIS: Final = (-19.0, 1.5)
"""Where the servo's shaft lies: along the rod and to its side, from the rod's middle."""
DRUM_HEIGHT: Final = 3.0
"""Lower face of the drum above the rod's axis, towards the module's centre."""
FAIRLEAD: Final = (-1.9, 0.9)
"""Where the lines go through their fairleads, along the rod and to its side."""
FLANGE: Final = 0.8
"""Thickness of a flange."""
GROOVE: Final = 0.8
"""Height of a cam, which is the width of its groove."""
RISE: Final = 0.8
"""How far a flange stands out over the cams beside it."""
CHANNEL: Final = 0.7
"""Width of the channel in a cam that a line's end goes through, to its knot."""
PEG: Final = 1.0
"""Radius of the pegs that hold the discs to each other."""
SCREW_HEAD: Final = 1.9
"""Radius of the hole for the head of the servo's screw."""
SCREW: Final = 1.1
"""Radius of the hole for the screw itself."""
WEB: Final = 1.2
"""Thickness of what the screw presses on the shaft."""


def arms(motor: ServoMotor) -> np.ndarray:
    """Return the (181, 5) distances of the lines from the axis at every degree of command, in mm."""
    return cams.arms_of(servo.DRUM_LENGTHS) * (np.pi / np.radians(motor.travel))


def drum_errors() -> np.ndarray:
    """Return (5,) largest differences in mm between the drum's winding and the simulated servo table."""
    return np.asarray(1e3 * np.abs(servo.DRUM_LENGTHS - servo.TARGET_LENGTHS).max(axis=0))


def drum_order() -> tuple[int, ...]:
    """Return the internal cables' nodes from the drum's lower groove to its upper one."""
    return tuple(t.SERVO_NODES[k] for k in cams.ORDER)


def line_tensions(level: int, limit: float) -> np.ndarray:
    """Return (5,) tensions in N of the internal cables of a contracted module, as ``SERVO_NODES``.

    Args:
        level: the module's stiffness gene, 1 to 10.
        limit: the largest tension in N; 0 for none.
    """
    return floating_module(level, CONTRACTED, built=Built(line_limit=limit)).servo_tensions


def required_torque(motor: ServoMotor, limit: float) -> float:
    """Return the torque in N m on the drum when it holds the stiffest module contracted."""
    return float(1e-3 * arms(motor)[-1] @ line_tensions(t.N_STIFFNESS_LEVELS, limit))


@functools.cache
def outlines(travel: float) -> tuple[tuple[Polygon, float], ...]:
    """Return the cams from below with the directions in rad in which their lines leave at command 0.

    Args:
        travel: of the servo, in degrees.
    """
    towards = np.subtract(FAIRLEAD, SERVO_AXIS)
    each = cams.arms_of(servo.DRUM_LENGTHS)
    return tuple(cams.outline(each[:, k], cams.LEAST_ARM[k], towards, np.radians(travel)) for k in cams.ORDER)


@functools.cache
def flanges(travel: float) -> tuple[Polygon, ...]:
    """Return the six flanges from below: each is wider than the cams that it lies between."""
    wide = [shape.buffer(RISE, quad_segs=6) for shape, _ in outlines(travel)]
    between = [unary_union([a, b]).convex_hull for a, b in itertools.pairwise(wide)]
    return (wide[0], *between, wide[-1])


def groove_heights() -> np.ndarray:
    """Return (5,) heights of the grooves' middles over the drum's lower face, as ``SERVO_NODES``."""
    found = np.zeros(len(t.SERVO_NODES))
    for place, k in enumerate(cams.ORDER):
        found[k] = place * (FLANGE + GROOVE) + FLANGE + GROOVE / 2
    return found


DRUM_TALL: Final = len(t.SERVO_NODES) * (FLANGE + GROOVE) + FLANGE
"""Height of the whole drum."""


def shaft_depth(motor: ServoMotor) -> float:
    """Return how far the servo's shaft reaches into the drum, which is half a millimetre above the case."""
    return 1e3 * (motor.ear_height + motor.shaft_height - motor.body_height) - 0.5


def drum_discs(motor: ServoMotor) -> tuple[Manifold, ...]:
    """Return the six discs from below, each with its lower face at 0."""
    shapes, rims = outlines(motor.travel), flanges(motor.travel)
    pegs = [_peg_place(shape, lug) for shape, lug in shapes]
    found = []
    for k, rim in enumerate(rims):
        disc = solids.extruded(rim, FLANGE)
        if k < len(shapes):
            shape, lug = shapes[k]
            disc = disc + solids.extruded(shape, FLANGE + GROOVE)
            across = solids.box(
                (cams.LUG_AT - CHANNEL / 2, -20.0, FLANGE), (cams.LUG_AT + CHANNEL / 2, 20.0, 9.0)
            )
            disc = disc - across.rotate((0.0, 0.0, float(np.degrees(lug))))
            peg = solids.cylinder(PEG, FLANGE, FLANGE + GROOVE + 0.75 * FLANGE, segments=24)
            disc = disc + peg.translate((*pegs[k], 0.0))
        if k:
            hole = solids.cylinder(PEG + 0.1, -1.0, FLANGE, segments=24)
            disc = disc - hole.translate((*pegs[k - 1], 0.0))
        else:
            disc = disc - _mark(rim)
        found.append(disc - _bore(motor, k * (FLANGE + GROOVE)))
    return tuple(found)


def _bore(motor: ServoMotor, height: float) -> Manifold:
    """Return what shaft, screw and the screw's head take from a disc that begins at a height."""
    deep = shaft_depth(motor)
    holes = [
        (500 * motor.shaft_diameter + 0.05, -1.0, deep),
        (SCREW, -1.0, DRUM_TALL + 1.0),
        (SCREW_HEAD, deep + WEB, DRUM_TALL + 1.0),
    ]
    whole = Manifold()
    for radius, low, high in holes:
        whole = whole + solids.cylinder(radius, low, high)
    return whole.translate((0.0, 0.0, -height))


def _peg_place(shape: Polygon, lug: float) -> np.ndarray:
    """Return (2,) where in a cam a peg fits: as far from the axis as can be, and not in the channel."""
    room = shape.buffer(-PEG - 0.8)
    towards = np.array([np.cos(lug), np.sin(lug)])
    spots = np.array([(x, y) for x in np.arange(-12.0, 12.0, 0.5) for y in np.arange(-12.0, 12.0, 0.5)])
    fits = np.array([room.contains(Point(p)) for p in spots])
    fits &= np.abs(spots @ towards - cams.LUG_AT) > CHANNEL / 2 + PEG + 0.3
    return np.asarray(max(spots[fits], key=lambda p: float(np.hypot(*p))))


def _mark(rim: Polygon) -> Manifold:
    """Return a notch in the lowest flange that points to the fairlead at command 0."""
    towards = np.subtract(FAIRLEAD, SERVO_AXIS)
    angle = float(np.arctan2(towards[1], towards[0]))
    ray = LineString([(0.0, 0.0), (30.0 * np.cos(angle), 30.0 * np.sin(angle))])
    edge = ray.intersection(rim).length
    corner = solids.box((-0.7, -0.7, -0.1), (0.7, 0.7, FLANGE + 0.1)).rotate((0.0, 0.0, 45.0))
    return corner.translate((edge, 0.0, 0.0)).rotate((0.0, 0.0, float(np.degrees(angle))))


@functools.lru_cache(maxsize=16)
def servo_drum(motor: ServoMotor) -> Manifold:
    """Return the drum put together, the servo below it."""
    body = Manifold()
    for k, disc in enumerate(drum_discs(motor)):
        body = body + disc.translate((0.0, 0.0, k * (FLANGE + GROOVE)))
    return body


def drum_in_place(motor: ServoMotor, command: float = 0.0) -> Manifold:
    """Return the drum on its servo, in the rod's frame: x to the module's centre, y along the rod.

    Args:
        motor: the servo.
        command: where it stands, in degrees.
    """
    y, z = SERVO_AXIS
    turned = solids.frame_along(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    wound = servo_drum(motor).rotate((0.0, 0.0, command * motor.travel / 180.0))
    return solids.placed(wound, turned, np.array([DRUM_HEIGHT, y, z]))
