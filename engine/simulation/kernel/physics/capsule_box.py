"""Where along a rod it touches a box: at one point or at two, as MuJoCo chooses them.

MuJoCo looks for the point of a capsule's axis that is closest to the box, and then for a second one, so that
a rod that lies on a face or an edge does not roll about a single point. The rules below are those of its
``engine_collision_box.c`` (S. Kolev, 2016), so that a step gives the same contacts. Numbers are those of one
simulation: the choices differ from lane to lane, and few rods are near a wall.

A corner or an edge of the box is known by its number: bit i is set where coordinate i is positive.
"""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np

from engine.simulation.kernel.lanes.compiling import compiled, inlined

FACE: Final = -1
"""An end of the axis is closest to a face; kinds from 0 on are of edges, see ``_closest_edge``."""
NOWHERE: Final = -4.0
"""In place of a second point's distance where there is none; positions along the axis are from -1 to 1."""
NEGLIGIBLE: Final = 1e-15
"""MuJoCo's smallest number that is not 0: of a difference of squared distances, of a determinant."""

Vector: TypeAlias = np.ndarray | tuple[float, float, float]
"""Three numbers that can be indexed."""


@compiled
def touching_points(p: Vector, h: Vector, s: Vector, half_length: float) -> tuple[float, float]:
    """Return where along a rod its contacts with a box are, from -1 to 1, the second less the first.

    Args:
        p: (3,) the rod's middle in the box's frame, in m.
        h: (3,) half of the rod's axis in the box's frame, in m.
        s: (3,) half sizes of the box, in m.
        half_length: length of h, in m.

    Returns:
        The first point, and the second less the first or ``NOWHERE``.
    """
    best, first, face = _closest_face(p, h, s)
    kind, at_edge, corner, edge = FACE, 0.0, 0, 0
    for axis in range(3):
        for number in range(8):
            if number >> axis & 1:
                continue
            squared, along, on_edge, where = _edge(p, h, s, half_length, axis, number)
            if squared < best - NEGLIGIBLE:
                best, first, at_edge, kind, edge = squared, along, on_edge, where, axis
                corner = number + (1 << axis) * (where == 2)
    if kind == FACE:
        second = _second_on_face(p, h, s, first, face) if face >= 0 else NOWHERE
    elif kind == 1:
        second = _second_across_edge(h, s, first, at_edge, corner, edge)
    else:
        second = _second_at_corner(h, s, half_length, first, corner)
    return first, second


@inlined
def _direction(h: Vector) -> int:
    """Return the number of the corner that an axis points to."""
    return (h[0] > 0.0) + 2 * (h[1] > 0.0) + 4 * (h[2] > 0.0)


@compiled
def _closest_face(p: Vector, h: Vector, s: Vector) -> tuple[float, float, int]:
    """Return which end of an axis is closest to a face that it is straight above, or within the box.

    Returns:
        The squared distance, infinite if neither end is; which end, -1 or 1; across which coordinate the
        face lies, -1 within the box.
    """
    best, first, face = np.inf, 0.0, -1
    for end in (-1.0, 1.0):
        outside, across, squared = 0, -1, 0.0
        for i in range(3):
            x = p[i] + end * h[i]
            beyond = max(abs(x) - s[i], 0.0)
            if abs(x) > s[i]:
                outside += 1
                across = i
            squared += beyond * beyond
        if outside <= 1 and squared < best:
            best, first, face = squared, end, across
    return best, first, face


@compiled
def _edge(
    p: Vector, h: Vector, s: Vector, half_length: float, axis: int, number: int
) -> tuple[float, float, float, int]:
    """Return where an axis and an edge along a coordinate are closest.

    Returns:
        The squared distance, infinite if they are parallel; the place along the rod and along the edge, from
        -1 to 1; 1 if that is within the edge, 0 at its lower and 2 at its upper end.
    """
    x, y, z = (
        (1.0 if number & 1 else -1.0) * s[0] * (axis != 0) - p[0],
        (1.0 if number & 2 else -1.0) * s[1] * (axis != 1) - p[1],
        (1.0 if number & 4 else -1.0) * s[2] * (axis != 2) - p[2],
    )
    between = (x, y, z)
    aa, ab, bb = s[axis] * s[axis], -s[axis] * h[axis], half_length * half_length
    u = -s[axis] * between[axis]
    v = h[0] * x + h[1] * y + h[2] * z
    det = aa * bb - ab * ab
    if abs(det) < NEGLIGIBLE:
        return np.inf, 0.0, 0.0, 1
    on_edge, along = (bb * u - ab * v) / det, (aa * v - ab * u) / det
    where = 1
    if on_edge > 1.0:
        on_edge, where, along = 1.0, 2, (v - ab) / bb
    elif on_edge < -1.0:
        on_edge, where, along = -1.0, 0, (v + ab) / bb
    if abs(along) > 1.0:
        along = 1.0 if along > 1.0 else -1.0
        on_edge = (u - along * ab) / aa
        # an end of the rod that projects within the edge keeps what the edge's end was before
        if on_edge > 1.0:
            on_edge, where = 1.0, 2
        elif on_edge < -1.0:
            on_edge, where = -1.0, 0
    dx = x - along * h[0] + on_edge * s[0] * (axis == 0)
    dy = y - along * h[1] + on_edge * s[1] * (axis == 1)
    dz = z - along * h[2] + on_edge * s[2] * (axis == 2)
    return dx * dx + dy * dy + dz * dz, along, on_edge, where


@compiled
def _second_on_face(p: Vector, h: Vector, s: Vector, first: float, face: int) -> float:
    """Return the second point of a rod whose end is closest to a face: the last that is above the face."""
    # from that end into the rod
    inward = -first
    second = 2.0
    for i in range(3):
        if i == face:
            continue
        end = p[i] + first * h[i]
        for side in (s[i], -s[i]):
            far = (side - end) / h[i] * inward
            if 0.0 < far < second:
                second = far
    return second * inward


@compiled
def _second_across_edge(h: Vector, s: Vector, first: float, at_edge: float, corner: int, edge: int) -> float:
    """Return the second point of a rod that crosses an edge: over the face that it is nearly parallel to."""
    direction = _direction(h)
    crossing = (direction ^ corner) & (7 - (1 << edge))
    if crossing not in (1, 2, 4):
        return NOWHERE
    a, b = (edge + 1) % 3, (edge + 2) % 3
    across = b if abs(h[a]) > abs(h[b]) else a
    over = 3 - edge - across
    inward = 1.0 if crossing >> over & 1 else -1.0
    second = min(1.0 - inward * first, 2.0 * s[over] / abs(h[over]))
    upwards = (direction >> edge & 1) == (crossing >> over & 1)
    left = 1.0 - at_edge if upwards else 1.0 + at_edge
    return min(second, s[edge] * left / abs(h[edge])) * inward


@compiled
def _second_at_corner(h: Vector, s: Vector, half_length: float, first: float, corner: int) -> float:
    """Return the second point of a rod that is closest to a corner: along an edge or over a face."""
    turned = _direction(h) ^ corner
    if turned in (0, 7):
        return NOWHERE
    inward = 1.0
    if turned not in (1, 2, 4):
        inward, turned = -1.0, 7 - turned
    axis = 0 if turned == 1 else 1 if turned == 2 else 2
    if 2.0 * h[axis] * h[axis] > half_length * half_length:
        return min(1.0 - inward * first, 2.0 * s[axis] / abs(h[axis])) * inward
    second = 1.0 + inward * first
    for i in range(3):
        if i != axis:
            second = min(second, 2.0 * s[i] / abs(h[i]))
    return -second * inward
