"""The five cams of a servo's drum: shapes that wind the internal cables nearly as the published table says.

A line that runs past a turning cam at the distance h from its axis is wound by h per radian: dL/dangle =
-h. The published table asks for distances that jump between 0 and 17 mm, more than any convex outline has.
``moment_arms`` finds those that come nearest to it: a linear program that makes the largest error of length
as small as outlines allow whose curvature is never less than ``LEAST_CURVATURE``, then the roundest of
these. What they wind is ``engine/data/drum_lengths.csv``, which the simulation of a built robot reads.

The outline is the envelope of the line: in the cam's frame the line turns backwards, and always goes
through the fairlead. Lengths in mm, angles in rad; x points along the shaft away from the servo, and a drum
turns counter-clockwise seen from there.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.optimize import linprog
from shapely.geometry import MultiPoint, Point, Polygon

from engine.body import module as t
from engine.body import servo

LEAST_ARM: Final = (3.2, 2.7, 3.2, 3.2, 2.7)
"""Least distance of each line from the axis, as ``SERVO_NODES``: the servo's splines are inside the lower
three cams, the head of its screw inside the two others."""
MOST_ARM: Final = 10.5
"""Largest distance of a line from the axis."""
STEEPEST: Final = 2.8
"""How much closer to the axis a line may come per radian: outlines reach out where it does."""
LEAST_CURVATURE: Final = 1.0
"""Least radius of curvature of an outline."""
ROUNDER: Final = 0.1
"""How much more error is allowed for a rounder outline."""
ORDER: Final = tuple(t.SERVO_NODES.index(node) for node in (4, 7, 10, 3, 9))
"""The cams from the servo upwards, as indices of ``SERVO_NODES``."""
STEP: Final = 3
"""Degrees between the arms that are looked for; they change evenly in between."""
SIDES: Final = 96
LUG_BEHIND: Final = float(np.radians(95.0))
"""How far behind the place where it leaves at command 0 a line ends: it is on its cam by then."""
LUG_AT: Final = 3.4
"""Distance of that place from the axis."""
LUG: Final = 1.8
"""Radius of the material around it."""


def moment_arms() -> np.ndarray:
    """Return the (61, 5) distances of the lines from the axis at 0, 3, ... 180 degrees."""
    angles = np.arange(0, 181, STEP)
    wanted = 1e3 * (servo.TARGET_LENGTHS[0] - servo.TARGET_LENGTHS[angles])
    return np.stack([_arms(wanted[:, k], LEAST_ARM[k]) for k in range(len(t.SERVO_NODES))], axis=1)


def _arms(wanted: np.ndarray, least: float) -> np.ndarray:
    """Return the arms that wind a length at every ``STEP`` degrees as well as an outline can."""
    n, d = len(wanted), np.radians(STEP)
    wound = _wound(n, d)
    curvature = np.zeros((n - 2, n))
    rows = np.arange(n - 2)
    curvature[rows, rows] = curvature[rows, rows + 2] = 1.0 / d**2
    curvature[rows, rows + 1] = 1.0 - 2.0 / d**2
    slope = (np.eye(n)[:-1] - np.eye(n)[1:]) / d
    # unknown: the arms, the largest error, the largest radius of curvature
    above = np.vstack(
        [
            np.column_stack([wound, -np.ones(n), np.zeros(n)]),
            np.column_stack([-wound, -np.ones(n), np.zeros(n)]),
            np.column_stack([-curvature, np.zeros((n - 2, 2))]),
            np.column_stack([curvature, np.zeros(n - 2), -np.ones(n - 2)]),
            np.column_stack([slope, np.zeros((n - 1, 2))]),
        ]
    )
    limits = np.concatenate(
        [
            wanted,
            -wanted,
            np.full(n - 2, -LEAST_CURVATURE),
            np.zeros(n - 2),
            np.full(n - 1, STEEPEST),
        ]
    )
    ends = np.append(wound[-1], (0.0, 0.0))[None]
    error = np.inf
    for goal in (n, n + 1):
        cost = np.zeros(n + 2)
        cost[goal] = 1.0
        bounds = [(least, MOST_ARM)] * n + [(0.0, error), (0.0, None)]
        found = linprog(
            cost, A_ub=above, b_ub=limits, A_eq=ends, b_eq=wanted[-1:], bounds=bounds, method="highs"
        )
        error = found.x[n] + ROUNDER
    return np.asarray(found.x[:n])


def _wound(n: int, step: float) -> np.ndarray:
    """Return the (n, n) matrix from arms to the lengths wound, the arms changing evenly in between."""
    matrix = np.zeros((n, n))
    for i in range(1, n):
        matrix[i] = matrix[i - 1]
        matrix[i, i - 1 : i + 1] += step / 2
    return matrix


def wound_lengths(arms: np.ndarray) -> np.ndarray:
    """Return the (181, 5) lengths in m of the internal cables that a drum of such arms gives."""
    degrees = np.arange(181)
    knots = np.arange(0, 181, STEP)
    each = np.stack([np.interp(degrees, knots, arms[:, k]) for k in range(arms.shape[1])], axis=1)
    steps = np.radians(1.0) * (each[1:] + each[:-1]) / 2
    wound = np.concatenate([np.zeros((1, each.shape[1])), np.cumsum(steps, axis=0)])
    return np.asarray(servo.TARGET_LENGTHS[0] - 1e-3 * wound)


def arms_of(lengths: np.ndarray) -> np.ndarray:
    """Return the (181, 5) distances in mm of the lines from the axis, from lengths in m."""
    return -1e3 * np.gradient(lengths, np.radians(1.0), axis=0)


def outline(arms: np.ndarray, least: float, fairlead: np.ndarray, travel: float) -> tuple[Polygon, float]:
    """Return a cam as it stands at command 0.

    Args:
        arms: (181,) of its line at 0, 1, ... 180 degrees of command.
        least: radius of the circle that it must contain.
        fairlead: (2,) where the line goes to, from the axis.
        travel: by how much the servo turns, in rad.

    Returns:
        The outline, and the direction in rad from the axis of the lug in which its line ends.
    """
    distance = float(np.hypot(*fairlead))
    turned = np.linspace(0.0, travel, len(arms))
    angle = np.arctan2(fairlead[1], fairlead[0]) + np.arccos(arms / distance) - turned
    slope = np.gradient(arms, angle)
    points = arms[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = points + slope[:, None] * np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    hub = Point(0.0, 0.0).buffer(least, quad_segs=SIDES // 4)
    lug = float(np.arctan2(points[0, 1], points[0, 0])) + LUG_BEHIND
    end = Point(LUG_AT * np.cos(lug), LUG_AT * np.sin(lug)).buffer(LUG, quad_segs=SIDES // 4)
    return MultiPoint([*points, *hub.exterior.coords, *end.exterior.coords]).convex_hull, lug
