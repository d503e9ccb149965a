"""Where rods touch each other.

Rods seldom touch, so pairs that are near are searched for only after some rod may have moved by half the
margin of the last search; until then no other pair can touch. A pair is listed if it is near in any lane, and
changes nothing in lanes in which it does not touch.

A contact is a line of ``Work.pair``: normal 3 from the first rod to the second, its point from the two rods'
centres of mass 6, the acceleration of the second rod's point from the first's that it seeks 3, force on the
second rod 3, acceleration per force 6 and the inverse 6, largest eigenvalue across the normal, and softness
along it.
"""

from __future__ import annotations

from typing import Final

from engine.simulation.kernel.lanes.algebra import (
    Point,
    add,
    clamp,
    cross,
    dot,
    load3,
    load6,
    scale,
    store3,
    store6,
    sub,
    transform,
    zero3,
)
from engine.simulation.kernel.lanes.compiling import compiled, inlined
from engine.simulation.kernel.lanes.simd import (
    Mask,
    Real,
    Reals,
    any_lane,
    load,
    maximum,
    select,
    square_root,
    store,
)
from engine.simulation.kernel.physics.contact import (
    largest_across,
    softened,
    store_inverse,
    turned_by,
    where_there,
    within_cone,
)
from engine.simulation.kernel.physics.softness import impedance, plus_rod
from engine.simulation.kernel.physics.state import (
    ACCELERATION,
    N_NEAR,
    N_PAIRS,
    N_USED,
    OWN_PAIRS,
    PAIR,
    PAIRS_OF_MODULE,
    POSE,
    ROD,
    State,
)
from engine.simulation.kernel.robots.model import Model, are_apart, load3_of, store3_of
from engine.simulation.kernel.robots.parameters import RODS

MARGIN: Final = 0.01
"""Pairs that come closer than this to a contact are near, in m. From 5 to 15 mm the cost hardly changes."""
PARALLEL: Final = 1e-15
"""Determinant, in m^4, below which two rods count as parallel. MuJoCo makes two contacts of such a pair
where this makes one; the angle is then less than 2e-5."""
POINTLIKE: Final = 1e-12
"""Distance in m between the axes of two rods below which their contact has no normal."""


@compiled
def search_pairs(model: Model, state: State) -> None:
    """List the pairs of rods that are near in any lane, in the order of the first rod, then of the second."""
    rods, near = state.rods, state.work.near
    n_rods = RODS * model.n_modules
    reach = 2.0 * model.radius + MARGIN
    far = reach + 2.0 * model.half_length
    n = 0
    for i in range(n_rods):
        middle = load3(rods, ROD * i)
        for j in range(i + 1, n_rods):
            between = sub(middle, load3(rods, ROD * j))
            may_touch = ~are_apart(model, i, j) & (dot(between, between) < far * far)
            if not any_lane(may_touch):
                continue
            if any_lane(may_touch & (_least_distance(model, state, i, j) < reach * reach)):
                near[2 * n], near[2 * n + 1] = i, j
                n += 1
    state.work.counts[N_NEAR] = n


@inlined
def _least_distance(model: Model, state: State, i: int, j: int) -> Real:
    """Return the square of the distance between the axes of two rods."""
    between, a, b, s, t = _closest(model, state, i, j)
    gap = sub(add(between, scale(a, s)), scale(b, t))
    return dot(gap, gap)


@inlined
def _closest(model: Model, state: State, i: int, j: int) -> tuple[Point, Point, Point, Real, Real]:
    """Return where two rods are closest, in MuJoCo's way.

    Returns:
        The first rod's middle from the second's, the halves of both axes, and how far along them, from -1 to
        1, the closest points lie.
    """
    rods, pose, half = state.rods, state.work.pose, model.half_length
    between = sub(load3(rods, ROD * i), load3(rods, ROD * j))
    a = scale(load3_of(model, pose, POSE, i, 0), half)
    b = scale(load3_of(model, pose, POSE, j, 0), half)
    aa, ab, bb = dot(a, a), -dot(a, b), dot(b, b)
    u, v = -dot(a, between), dot(b, between)
    det = maximum(aa * bb - ab * ab, PARALLEL)
    s, t = (bb * u - ab * v) / det, (aa * v - ab * u) / det
    above, below = s > 1.0, s < -1.0
    t = select(above, (v - ab) / bb, select(below, (v + ab) / bb, t))
    s = clamp(s, -1.0, 1.0)
    above, below = t > 1.0, t < -1.0
    s = select(above, clamp((u - ab) / aa, -1.0, 1.0), select(below, clamp((u + ab) / aa, -1.0, 1.0), s))
    return between, a, b, s, clamp(t, -1.0, 1.0)


@compiled
def find_pairs(model: Model, state: State) -> None:
    """List the pairs of rods that touch in any lane, and forget the forces of those that touch no more."""
    work = state.work
    n = 0
    for k in range(work.counts[N_NEAR]):
        n = _touch(model, state, work.near[2 * k], work.near[2 * k + 1], n)
    work.counts[N_PAIRS] = n
    zero = zero3(state.rods)
    if work.counts[N_USED] < 0:
        for i in range(3 * PAIRS_OF_MODULE * model.n_modules):
            store(state.pair_force, i, 0.0)
    for i in range(work.counts[N_USED]):
        store3(state.pair_force, 3 * work.used[i], zero)


@inlined
def _touch(model: Model, state: State, i: int, j: int, n: int) -> int:
    """List the contact of two rods, if they touch in any lane, after n others; return how many there are."""
    rods, pose, pair = state.rods, state.work.pose, state.work.pair
    between, a, b, s, t = _closest(model, state, i, j)
    at_i, at_j = scale(a, s), sub(scale(b, t), between)
    gap = sub(at_j, at_i)
    distance = square_root(dot(gap, gap))
    depth = distance - 2.0 * model.radius
    there = (depth <= 0.0) & ~are_apart(model, i, j) & (load(state.failed, 0) == 0)
    if not any_lane(there):
        return n
    normal = scale(gap, 1.0 / maximum(distance, POINTLIKE))
    at_i = add(at_i, scale(normal, model.radius + 0.5 * depth))
    at_j = add(at_i, between)
    velocity = sub(
        add(load3(rods, ROD * j + 7), cross(load3_of(model, pose, POSE, j, 6), at_j)),
        add(load3(rods, ROD * i + 7), cross(load3_of(model, pose, POSE, i, 6), at_i)),
    )
    at_i = sub(at_i, load3_of(model, pose, POSE, i, 3))
    at_j = sub(at_j, load3_of(model, pose, POSE, j, 3))
    ti, tj = i % RODS, j % RODS
    least, most, width = model.contact_impedance
    hard = impedance(depth, least, most, width)
    soft = (1.0 - hard) * (model.contact_weight[ti] + model.contact_weight[tj]) / hard
    response = softened(soft, soft * (1.0 / model.impratio), normal)
    for rod, at, kind in ((i, at_i, ti), (j, at_j, tj)):
        response = plus_rod(
            response,
            load3_of(model, pose, POSE, rod, 0),
            at,
            model.inverse_mass[kind],
            model.inverse_inertia[kind],
            model.inverse_spin[kind],
        )
    sought = scale(velocity, -model.contact_damping)
    sought = sub(sought, scale(normal, model.contact_stiffness * hard * depth))
    slot = _slot(i, j)
    c = PAIR * n
    store3(pair, c, normal)
    store3(pair, c + 3, at_i)
    store3(pair, c + 6, at_j)
    store3(pair, c + 9, sought)
    store3(pair, c + 12, where_there(there, state.pair_force, 3 * slot) if slot >= 0 else zero3(rods))
    store6(pair, c + 15, response)
    store_inverse(pair, c + 21, there, response)
    store(pair, c + 27, largest_across(response, normal))
    store(pair, c + 28, soft)
    state.work.pair_slot[n] = slot
    state.work.pair_rods[2 * n], state.work.pair_rods[2 * n + 1] = i, j
    return n + 1


@inlined
def _slot(i: int, j: int) -> int:
    """Return where the force between two rods, i < j, is kept; -1 for nowhere, more than a module apart."""
    m, a, b = i // RODS, i % RODS, j % RODS
    if j // RODS == m:
        return PAIRS_OF_MODULE * m + b * (b - 1) // 2 + a
    return PAIRS_OF_MODULE * m + OWN_PAIRS + RODS * a + b if j // RODS == m + 1 else -1


@inlined
def relax_pair(model: Model, state: State, n: int, goes_on: Mask) -> Point:
    """Give contact n of two rods the best force while all others stay, and push them; return its change."""
    pair, acceleration = state.work.pair, state.work.acceleration
    i, j = state.work.pair_rods[2 * n], state.work.pair_rods[2 * n + 1]
    c = PAIR * n
    normal, f, soft = load3(pair, c), load3(pair, c + 12), load(pair, c + 28)
    turn_i = cross(load3_of(model, acceleration, ACCELERATION, i, 3), load3(pair, c + 3))
    turn_j = cross(load3_of(model, acceleration, ACCELERATION, j, 3), load3(pair, c + 6))
    point_i = add(load3_of(model, acceleration, ACCELERATION, i, 0), turn_i)
    point_j = add(load3_of(model, acceleration, ACCELERATION, j, 0), turn_j)
    across = soft * (1.0 / model.impratio)
    residual = sub(sub(point_j, point_i), load3(pair, c + 9))
    residual = add(residual, add(scale(f, across), scale(normal, (soft - across) * dot(normal, f))))
    new = sub(f, transform(load6(pair, c + 21), residual))
    new = within_cone(
        new, f, residual, load6(pair, c + 15), load(pair, c + 27), normal, model.friction, goes_on
    )
    store3(pair, c + 12, new)
    change = sub(new, f)
    push_pair(model, state, n, change)
    return change


@inlined
def is_pair_there(pair: Reals, n: int) -> Mask:
    """Return the lanes with contact n of two rods: the inverse of its response is not 0 there."""
    return load(pair, PAIR * n + 21) > 0.0


@inlined
def push_pair(model: Model, state: State, n: int, force: Point) -> None:
    """Add to the accelerations of two rods what a force on the second and back on the first does."""
    pair, rods = state.work.pair, state.work.pair_rods
    back = (-force[0], -force[1], -force[2])
    _push_rod(model, state, rods[2 * n], load3(pair, PAIR * n + 3), back)
    _push_rod(model, state, rods[2 * n + 1], load3(pair, PAIR * n + 6), force)


@inlined
def _push_rod(model: Model, state: State, k: int, r: Point, force: Point) -> None:
    """Add to rod k's acceleration what a force does at r from its centre of mass."""
    acceleration, t = state.work.acceleration, k % RODS
    axis = load3_of(model, state.work.pose, POSE, k, 0)
    turn = turned_by(cross(r, force), axis, model.inverse_inertia[t], model.inverse_spin[t])
    linear = add(load3_of(model, acceleration, ACCELERATION, k, 0), scale(force, model.inverse_mass[t]))
    angular = add(load3_of(model, acceleration, ACCELERATION, k, 3), turn)
    store3_of(model, acceleration, ACCELERATION, k, 0, linear)
    store3_of(model, acceleration, ACCELERATION, k, 3, angular)
