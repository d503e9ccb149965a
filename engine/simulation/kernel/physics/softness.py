"""How soft a contact or a link is: MuJoCo's impedance, and a contact's resistance to forces.

The documentation of MuJoCo, "Computation: Constraint model", defines impedance, regularisation and reference
acceleration.
"""

from __future__ import annotations

from engine.simulation.kernel.lanes.algebra import Point, Symmetric, dot
from engine.simulation.kernel.lanes.compiling import inlined
from engine.simulation.kernel.lanes.simd import Real, absolute, select


@inlined
def impedance(depth: Real, least: float, most: float, width: float) -> Real:
    """Return the impedance, between 0 and 1, of a constraint that is violated by a depth in m (or rad).

    It rises from the least to the most over a width, as two parabolas that meet halfway.
    """
    x = absolute(depth / width)
    rest = 1.0 - x
    y = select(x <= 0.5, 2.0 * x * x, 1.0 - 2.0 * rest * rest)
    return select(x >= 1.0, most, least + y * (most - least))


@inlined
def plus_rod(
    s: Symmetric, e: Point, r: Point, inverse_mass: Real, inverse_inertia: Real, inverse_spin: Real
) -> Symmetric:
    """Return a matrix plus the acceleration of a point of a rod per force at it.

    Args:
        s: the matrix.
        e: unit vector along the rod.
        r: the point, from the rod's centre of mass.
        inverse_mass: the rod's, as the next two, see ``parameters.Model``.
        inverse_inertia: of turning about an axis across the rod.
        inverse_spin: by how much more about its own axis.
    """
    diagonal = dot(r, r) * inverse_inertia + inverse_mass
    sx = e[1] * r[2] - e[2] * r[1]
    sy = e[2] * r[0] - e[0] * r[2]
    sz = e[0] * r[1] - e[1] * r[0]
    rx, ry, rz = r[0] * inverse_inertia, r[1] * inverse_inertia, r[2] * inverse_inertia
    tx, ty, tz = sx * inverse_spin, sy * inverse_spin, sz * inverse_spin
    return (
        s[0] + (diagonal - r[0] * rx + sx * tx),
        s[1] + (sx * ty - r[0] * ry),
        s[2] + (sx * tz - r[0] * rz),
        s[3] + (diagonal - r[1] * ry + sy * ty),
        s[4] + (sy * tz - r[1] * rz),
        s[5] + (diagonal - r[2] * rz + sz * tz),
    )
