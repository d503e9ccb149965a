"""The force of one contact within its friction cone, everything else held fixed.

A contact's force f minimises 1/2 f'Bf + b'f over the cone |tangential part| <= mu x normal part, where B is
the contact's acceleration per force, softness included, and Bf + b the residual: acceleration of the
contact's point less the one that it seeks, plus softness times force. A minimum inside the cone is found
exactly. Otherwise a visit takes three steps that never raise the cost: along the ray through the force, or,
from the tip of the cone, along the ray that falls fastest, then two projected gradient steps along the cone's
surface. MuJoCo's PGS tries only the normal at the tip, where it can stick.
"""

from __future__ import annotations

from engine.simulation.kernel.lanes.algebra import Point, Symmetric, add, dot, scale, select3, sub, transform
from engine.simulation.kernel.lanes.compiling import inlined
from engine.simulation.kernel.lanes.simd import Real, maximum, minimum, square_root

TINY: float = 1e-30
"""Keeps divisions by squares of lengths that can be 0 finite."""
NO_FORCE: float = 1e-12
"""A normal force in N below which a contact is at the tip of its cone."""
NO_CURVATURE: float = 1e-15
"""A curvature of the cost along a ray below which there is no force to scale."""


@inlined
def slide(
    f: Point, residual: Point, stiffness: Symmetric, bound: Real, normal: Point, friction: Real
) -> Point:
    """Return a contact's next force where the unconstrained one lies outside the cone.

    Args:
        f: its force before, in N, within the cone.
        residual: (of f) see above, in m/s^2.
        stiffness: B, in m/s^2 per N.
        bound: the largest eigenvalue of B across the normal.
        normal: unit vector along which the contact pushes.
        friction: coefficient mu.
    """
    pushed = dot(normal, f)
    curvature = dot(f, transform(stiffness, f))
    along = maximum(-dot(f, residual) / maximum(curvature, NO_CURVATURE), -1.0)
    on_ray = (pushed > NO_FORCE) & (curvature > NO_CURVATURE)
    across = sub(residual, scale(normal, dot(normal, residual)))
    steepest = sub(normal, scale(across, friction / maximum(square_root(dot(across, across)), TINY)))
    far = maximum(-dot(steepest, residual) / dot(steepest, transform(stiffness, steepest)), 0.0)
    first = select3(on_ray, scale(f, 1.0 + along), scale(steepest, far))
    residual = add(residual, transform(stiffness, sub(first, f)))
    pushed = dot(normal, first)
    second = _along_surface(first, residual, 1.0 / bound, normal, pushed, friction * pushed)
    residual = add(residual, transform(stiffness, sub(second, first)))
    return _along_surface(second, residual, 1.0 / bound, normal, pushed, friction * pushed)


@inlined
def _along_surface(f: Point, residual: Point, step: Real, normal: Point, pushed: Real, most: Real) -> Point:
    """Return a force moved down the cost across the normal, as far as friction goes.

    Args:
        f: see ``slide``.
        residual: see ``slide``.
        normal: see ``slide``.
        step: force per residual.
        pushed: the force's part along the normal, which stays.
        most: the most that its part across may be.
    """
    target = sub(f, scale(residual, step))
    across = sub(target, scale(normal, dot(normal, target)))
    squared = maximum(dot(across, across), TINY)
    return add(scale(normal, pushed), scale(across, minimum(most / square_root(squared), 1.0)))
