"""One tensegrity module: its nodes, rods, cables and faces, and the physical constants.

The module is the six-rod icosahedron of Zardini et al. (GECCO 2021). All figures are SI. They come from the
published simulator (Tensoft-G21); its forces and masses are multiplied by ten here, to match the real robot
under Earth's gravity. ``engine.simulation.physics.Physics`` has the inertia scaling that belongs to them.
"""

from __future__ import annotations

import functools
from typing import Final

import numpy as np

from engine.exact import length

MIN_MODULES: Final = 2
MAX_MODULES: Final = 10
N_STIFFNESS_LEVELS: Final = 10

NODES: Final = 0.01 * np.array(
    [
        (-3.75, -4.1, 0.0),
        (-3.75, 4.1, 0.0),
        (3.75, -4.1, 0.0),
        (3.75, 4.1, 0.0),
        (0.0, -3.75, -4.1),
        (0.0, -3.75, 4.1),
        (0.0, 3.75, -4.1),
        (0.0, 3.75, 4.1),
        (-4.1, 0.0, 3.75),
        (4.1, 0.0, 3.75),
        (-4.1, 0.0, -3.75),
        (4.1, 0.0, -3.75),
    ]
)
"""(12, 3) node positions of a module as built, before it settles, in metres."""

RODS: Final = ((0, 1), (2, 3), (4, 5), (6, 7), (8, 9), (10, 11))
"""Node pairs of the six rods; the rod of node n is ``n // 2``."""
NODE_RODS: Final = np.arange(len(NODES)) // 2
"""(12,) the rod of every node."""
ROD_MIDDLES: Final = NODES.reshape(6, 2, 3).mean(axis=1)
"""(6, 3) middles of the rods as built, in metres."""

CABLES: Final = tuple(
    (a, b)
    for a, others in (
        (0, (4, 5, 8, 10)),
        (1, (6, 7, 8, 10)),
        (2, (4, 5, 9, 11)),
        (3, (6, 7, 9, 11)),
        (4, (10, 11)),
        (5, (8, 9)),
        (6, (10, 11)),
        (7, (8, 9)),
    )
    for b in others
)
"""Node pairs of the 24 passive cables."""

FACES: Final = {
    1: (3, 7, 9),
    2: (7, 1, 8),
    3: (1, 6, 10),
    4: (6, 3, 11),
    5: (4, 0, 10),
    6: (2, 4, 11),
    7: (5, 2, 9),
    8: (0, 5, 8),
}
"""Nodes of the eight faces that can carry a joint."""

OPPOSITE_FACE: Final = {1: 5, 2: 6, 3: 7, 4: 8, 5: 1, 6: 2, 7: 3, 8: 4}

JOINT_ORDER: Final = ((0, 1), (1, 0), (2, 2))
"""Which node of a face meets which node of the next module's face (positions in ``FACES``).

Found from the built geometry: with every module turned as in ``FACE_TURN``, these are the nodes that
lie 1.2 to 5.1 mm apart for all 64 combinations of faces; any other pairing would cross the links.
"""

_HALF: Final = float(np.sqrt(0.5))
FACE_TURN: Final = {
    1: (1.0, 0.0, 0.0, 0.0),
    2: (_HALF, 0.0, _HALF, 0.0),  # a quarter of a turn about y
    3: (0.0, 0.0, 1.0, 0.0),  # half a turn about y
    4: (_HALF, 0.0, -_HALF, 0.0),  # a quarter of a turn back
    5: (0.0, _HALF, 0.0, -_HALF),  # half a turn about x, then as face 2
    6: (0.0, 1.0, 0.0, 0.0),  # half a turn about x
    7: (0.0, _HALF, 0.0, _HALF),  # half a turn about x, then as face 4
    8: (0.0, 0.0, 0.0, -1.0),  # half a turn about x, then as face 3
}
"""The turn that makes a face point where face 1 points, along (1, 1, 1): a quaternion w, x, y, z."""

CHAIN_AXIS: Final = np.ones(3) / np.sqrt(3.0)
MODULE_SPACING: Final = 0.0375 * np.sqrt(2.0) * np.sqrt(3.0)
"""Distance between the centres of two neighbouring modules as built, in metres."""

ROD_LENGTH: Final = 0.082
ROD_RADIUS: Final = 0.0015
ROD_END_CUT: Final = 0.0009
"""In contacts a rod is a capsule, whose axis ends this far short of the nodes, in metres.

The published rods are cylinders. At the angles of a resting module's rods, 25 to 65 degrees, such a capsule
holds its node at the height of a cylinder's edge, within 0.3 mm.
"""
ROD_MASS: Final = 0.001003
"""Mass of each of the five plain rods, in kg."""

SERVO_ROD: Final = 0
"""The rod that carries the servomotor and its arm."""
SERVO_ROD_MASS: Final = 0.020
SERVO_ROD_CENTRE_OF_MASS: Final = (0.0027, 0.0, 0.0)
"""From the servo rod's middle to its centre of mass, in metres, in the module's frame as built.

Fitted: the published heights of a resting module's centre of mass, in either of the two poses that occur,
imply 2.5 to 3 mm towards the arm.
"""
ACTUATOR_POINT: Final = NODES[[0, 1]].mean(axis=0) + np.array([0.0179, 0.0, 0.0])
"""(3,) point where the internal cables leave the servo's arm, in metres, in the module's frame as built."""
ACTUATOR_RADIUS: Final = 0.004

ANCHOR_OFFSET: Final = 0.0015
"""Cables end on the surface of a rod, this far from its axis, in metres."""

CABLE_STIFFNESS: Final = 115.2
"""Stiffness of a passive cable at relative stiffness 1.0, in N/m."""
CABLE_DAMPING: Final = 0.70
"""Damping of every cable, in N s/m."""
CABLE_REST_LENGTH: Final = 0.02067
"""Rest length of a passive cable between its anchors, in metres, at every stiffness."""

SERVO_NODES: Final = (10, 9, 4, 7, 3)
"""The nodes that the servo's five internal cables pull."""
N_CABLES: Final = len(CABLES) + len(SERVO_NODES)
"""Cables of a module, the passive ones before the internal ones."""
SERVO_GAIN: Final = 61.3
"""Tension of an internal cable per length error, in N/m."""
SERVO_OFFSET: Final = 0.100
"""Tension of an internal cable at its target length, in N."""
SERVO_MAX_TENSION: Final = 0.654
"""Limit of an internal cable's tension, in N."""
SERVO_NOISE: Final = 0.00035
"""Standard deviation of the noise on every commanded internal cable length, in metres."""

LINK_PLAY: Final = 0.0025
"""Distance between two joined nodes, in metres."""

NOMINAL_LENGTH: Final = 0.1111
"""Built diameter of a module, in metres: the paper's "about 11 cm"."""


def stiffness_n_per_m(relative: float) -> float:
    """Return the stiffness of a passive cable in N/m for a relative stiffness in (0, 1]."""
    return CABLE_STIFFNESS * relative


def module_number(index: int) -> int:
    """Return what people call a module: 1 for the first; code, genotypes and models count from 0."""
    return index + 1


def rod_of(node: int) -> int:
    """Return the index of the rod that ends at a node."""
    return node // 2


@functools.cache
def passive_anchor(node: int, other: int) -> np.ndarray:
    """Return the (3,) anchor of the passive cable node-other at node, in metres, as built.

    The anchor lies on the rod's surface, on the side that faces the other node. Do not write to it.
    """
    return _on_rod_surface(node, NODES[other])


@functools.cache
def servo_anchors(node: int) -> tuple[np.ndarray, np.ndarray]:
    """Return both (3,) anchors of the internal cable to a node, in metres, as built.

    The first lies on the sphere at the actuator point, the second on the node's rod. Do not write to them.
    """
    towards = NODES[node] - ACTUATOR_POINT
    on_sphere = ACTUATOR_POINT + ACTUATOR_RADIUS * towards / length(towards)
    on_sphere.flags.writeable = False
    return on_sphere, _on_rod_surface(node, ACTUATOR_POINT)


def _on_rod_surface(node: int, towards: np.ndarray) -> np.ndarray:
    a, b = RODS[rod_of(node)]
    # a rod lies along an axis of the module as built
    direction = np.where(NODES[b] == NODES[a], towards - NODES[node], 0.0)
    anchor = NODES[node] + ANCHOR_OFFSET * direction / length(direction)
    anchor.flags.writeable = False
    return anchor
