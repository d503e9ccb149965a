"""One contact of a rod with the ground or a wall: what the solver needs to know of it, and its relaxation.

A contact is a line of ``Work.contact``: its point from the rod's centre of mass 3, the acceleration that it
seeks 3, force on the rod 3, acceleration per force 6 and the inverse 6, softness along the normal, largest
eigenvalue across the normal, the normal 3, which points from the wall into the rod, and the coefficient of
friction. The inverse is 0 in lanes without the contact, so that its force stays 0 there.
"""

from __future__ import annotations

from engine.simulation.kernel.lanes.algebra import (
    Point,
    Symmetric,
    add,
    cross,
    dot,
    inverse,
    load3,
    load6,
    scale,
    select3,
    store3,
    store6,
    sub,
    transform,
    zero3,
)
from engine.simulation.kernel.lanes.compiling import inlined
from engine.simulation.kernel.lanes.simd import Mask, Real, Reals, any_lane, load, maximum, select, splat
from engine.simulation.kernel.lanes.simd import square_root as root
from engine.simulation.kernel.physics.friction import slide
from engine.simulation.kernel.physics.state import ACCELERATION, POSE, State
from engine.simulation.kernel.robots.model import Model


@inlined
def store_inverse(array: Reals, i: int, there: Mask, s: Symmetric) -> None:
    """Set six vectors to the inverse of a symmetric matrix, to 0 where a constraint is not there."""
    a = inverse(s)
    zero = splat(array, 0.0)
    store6(
        array,
        i,
        (
            select(there, a[0], zero),
            select(there, a[1], zero),
            select(there, a[2], zero),
            select(there, a[3], zero),
            select(there, a[4], zero),
            select(there, a[5], zero),
        ),
    )


@inlined
def is_there(contact: Reals, c: int) -> Mask:
    """Return the lanes with the contact at c: the inverse of its response is not 0 there."""
    return load(contact, c + 15) > 0.0


@inlined
def softened(soft: Real, across: Real, normal: Point) -> Symmetric:
    """Return a contact's softness: one along its normal, another across it."""
    more = soft - across
    x, y, z = normal[0] * more, normal[1] * more, normal[2] * more
    return (
        across + x * normal[0],
        x * normal[1],
        x * normal[2],
        across + y * normal[1],
        y * normal[2],
        across + z * normal[2],
    )


@inlined
def largest_across(s: Symmetric, normal: Point) -> Real:
    """Return the largest eigenvalue of a symmetric matrix restricted to the plane across a unit vector.

    The two eigenvalues there have the sum and the sum of squares that the traces of the restricted matrix and
    of its square give.
    """
    along = transform(s, normal)
    both = dot(normal, along)
    half_sum = 0.5 * (s[0] + s[3] + s[5] - both)
    squares = s[0] * s[0] + s[3] * s[3] + s[5] * s[5] + 2.0 * (s[1] * s[1] + s[2] * s[2] + s[4] * s[4])
    squares = squares - 2.0 * dot(along, along) + both * both
    return half_sum + root(maximum(0.5 * squares - half_sum * half_sum, 0.0))


@inlined
def relax_on_ground(
    contact: Reals,
    c: int,
    linear: Point,
    angular: Point,
    goes_on: Mask,
    across: float,
    over: float,
) -> Point:
    """Give a contact with the ground the best force while all others stay; return by how much it changed.

    Args:
        contact: all contacts.
        c: where this one begins.
        linear: acceleration of the rod.
        angular: its angular acceleration.
        goes_on: lanes whose force may change.
        across: softness across the normal as a part of that along it.
        over: how much further than it seeks a force within the cone is moved.
    """
    f, soft = load3(contact, c + 6), load(contact, c + 21)
    residual = sub(add(linear, cross(angular, load3(contact, c))), load3(contact, c + 3))
    soft_across = soft * across
    residual = (
        residual[0] + soft_across * f[0],
        residual[1] + soft_across * f[1],
        residual[2] + soft * f[2],
    )
    new = sub(f, scale(transform(load6(contact, c + 15), residual), over))
    friction = load(contact, c + 26)
    limit = friction * new[2]
    outside = ((new[2] < 0.0) | (new[0] * new[0] + new[1] * new[1] > limit * limit)) & goes_on
    if any_lane(outside):
        zero = splat(contact, 0.0)
        up = (zero, zero, zero + 1.0)
        bounded = slide(f, residual, load6(contact, c + 9), load(contact, c + 22), up, friction)
        new = select3(outside, bounded, new)
    new = select3(goes_on, new, f)
    store3(contact, c + 6, new)
    return sub(new, f)


@inlined
def relax_on_wall(
    contact: Reals,
    c: int,
    linear: Point,
    angular: Point,
    goes_on: Mask,
    across: float,
    over: float,
) -> Point:
    """Do what ``relax_on_ground`` does for a contact with a normal of its own."""
    f, soft, normal = load3(contact, c + 6), load(contact, c + 21), load3(contact, c + 23)
    residual = sub(add(linear, cross(angular, load3(contact, c))), load3(contact, c + 3))
    soft_across = soft * across
    residual = add(residual, add(scale(f, soft_across), scale(normal, (soft - soft_across) * dot(normal, f))))
    new = sub(f, scale(transform(load6(contact, c + 15), residual), over))
    new = within_cone(
        new,
        f,
        residual,
        load6(contact, c + 9),
        load(contact, c + 22),
        normal,
        load(contact, c + 26),
        goes_on,
    )
    store3(contact, c + 6, new)
    return sub(new, f)


@inlined
def within_cone(
    new: Point,
    f: Point,
    residual: Point,
    response: Symmetric,
    bound: Real,
    normal: Point,
    friction: Real,
    goes_on: Mask,
) -> Point:
    """Return a contact's next force: ``new`` where it lies within the cone, f where nothing may change."""
    pushed = dot(normal, new)
    limit = friction * pushed
    outside = ((pushed < 0.0) | (dot(new, new) - pushed * pushed > limit * limit)) & goes_on
    if any_lane(outside):
        new = select3(outside, slide(f, residual, response, bound, normal, friction), new)
    return select3(goes_on, new, f)


@inlined
def turned_by(moment: Point, axis: Point, inverse_inertia: Real, inverse_spin: Real) -> Point:
    """Return the angular acceleration that a moment gives a rod."""
    return add(scale(moment, inverse_inertia), scale(axis, inverse_spin * dot(axis, moment)))


@inlined
def push_place(model: Model, state: State, k: int, r: Point, force: Point) -> None:
    """Add to the acceleration of the rod at place k what a force does at r from its centre of mass."""
    acceleration, a = state.work.acceleration, ACCELERATION * k
    turn = turned_by(
        cross(r, force),
        load3(state.work.pose, POSE * k),
        load(model.place_inertia, k),
        load(model.place_spin, k),
    )
    store3(acceleration, a, add(load3(acceleration, a), scale(force, load(model.place_mass, k))))
    store3(acceleration, a + 3, add(load3(acceleration, a + 3), turn))


@inlined
def where_there(there: Mask, array: Reals, i: int) -> Point:
    """Return vectors i to i + 2 of an array in lanes with a constraint, 0 in others."""
    return select3(there, load3(array, i), zero3(array))
