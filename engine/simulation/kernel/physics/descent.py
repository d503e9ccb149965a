"""Forces that contacts pass to each other slowly: sweeps, extrapolated.

Rods that jam with others of their module, a rod that is wedged between ground and wall or lies in their
corner: each contact undoes most of what the others do, and sweeps change less and less without being anywhere
near the end. A sweep is a map of forces to forces, whose fixed point is sought. Anderson's method (1965;
Walker and Ni 2011, "Anderson acceleration for fixed-point iterations") finds it from the last few sweeps: it
takes the combination of them whose change of forces would be least. Forces that leave their cones are brought
back.

The forces are listed in ``Work.force_kind`` and ``Work.force_at``, three numbers each; a link's is filled
up with zeros. In lanes in which one is not there, or not among those that are swept over, it does not change,
and so plays no part. What is remembered of a force is a line of ``Work.search``.
"""

from __future__ import annotations

from typing import Final

from engine.simulation.kernel.lanes.algebra import Point, add, dot, load3, scale, select3, store3, sub
from engine.simulation.kernel.lanes.compiling import compiled, inlined
from engine.simulation.kernel.lanes.simd import (
    Mask,
    Real,
    load,
    maximum,
    minimum,
    select,
    splat,
    square_root,
    store,
)
from engine.simulation.kernel.physics.contact import push_place
from engine.simulation.kernel.physics.friction import TINY
from engine.simulation.kernel.physics.links import push_linked
from engine.simulation.kernel.physics.rod_contacts import push_pair
from engine.simulation.kernel.physics.state import (
    ACCELERATION,
    CONTACT,
    LINK,
    N_FORCES,
    N_PAIRS,
    PAIR,
    REMEMBERED,
    SEARCH,
    State,
)
from engine.simulation.kernel.robots.model import Model
from engine.simulation.kernel.robots.parameters import RODS

CONTACT_FORCE: Final = 0
PAIR_FORCE: Final = 1
LINK_FORCE: Final = 2
DEPENDENT: Final = 1e-10
"""Part of a difference's square that the newer ones must leave, or it says nothing new."""
NOTHING: Final = 1e-200
"""A square below which there is no difference."""


@inlined
def at_walls(model: Model, state: State, i: int) -> Mask:
    """Return the lanes in which a rod of an island touches a wall."""
    start, contact = state.work.contact_start, state.work.contact
    found = splat(contact, 0.0) > 0.0
    for n in range(start[2 * i], start[2 * i + 2]):
        if state.work.contact_slot[n] >= 2 * RODS * model.n_modules:
            # a contact is there in the lanes in which the inverse of its response is not 0
            found = found | (load(contact, CONTACT * n + 15) > 0.0)
    return found


@compiled
def list_island(model: Model, state: State, i: int) -> None:
    """Add an island's forces to the list."""
    work = state.work
    k = work.counts[N_FORCES]
    if i < model.n_links and work.linked[i]:
        work.force_kind[k], work.force_at[k] = LINK_FORCE, i
        k += 1
    for side in range(2):
        for n in range(work.contact_start[2 * i + side], work.contact_start[2 * i + side + 1]):
            work.force_kind[k], work.force_at[k] = CONTACT_FORCE, n
            work.force_place[k] = model.islands[2 * i + side]
            k += 1
    work.counts[N_FORCES] = k


@compiled
def list_pairs(state: State) -> None:
    """Add the forces between rods to the list."""
    work = state.work
    k = work.counts[N_FORCES]
    for n in range(work.counts[N_PAIRS]):
        work.force_kind[k + n], work.force_at[k + n] = PAIR_FORCE, n
    work.counts[N_FORCES] = k + work.counts[N_PAIRS]


@inlined
def _force(state: State, k: int) -> Point:
    work = state.work
    kind, n = work.force_kind[k], work.force_at[k]
    zero = splat(work.search, 0.0)
    force = (zero, zero, zero)
    if kind == CONTACT_FORCE:
        force = load3(work.contact, CONTACT * n + 6)
    elif kind == PAIR_FORCE:
        force = load3(work.pair, PAIR * n + 12)
    else:
        force = (load(work.link, LINK * n + 18), zero, zero)
    return force


@compiled
def remember(state: State) -> None:
    """Remember the listed forces before a sweep."""
    for k in range(state.work.counts[N_FORCES]):
        store3(state.work.search, SEARCH * k, _force(state, k))


@compiled
def extrapolate(model: Model, state: State, n_before: int, goes_on: Mask) -> None:
    """Move the listed forces on after a sweep.

    Args:
        model: the robot.
        state: the simulations.
        n_before: remembered sweeps before this one.
        goes_on: lanes whose forces may change.
    """
    search = state.work.search
    n_forces = state.work.counts[N_FORCES]
    column = 9 + 6 * ((n_before - 1) % REMEMBERED)
    for k in range(n_forces):
        c = SEARCH * k
        swept = _force(state, k)
        change = sub(swept, load3(search, c))
        if n_before > 0:
            store3(search, c + column, sub(swept, load3(search, c + 3)))
            store3(search, c + column + 3, sub(change, load3(search, c + 6)))
        store3(search, c + 3, swept)
        store3(search, c + 6, change)
    used = min(n_before, REMEMBERED)
    if used == 0:
        return
    _weigh(state, n_before, used)
    weight = state.work.weight
    for k in range(n_forces):
        c = SEARCH * k
        swept = load3(search, c + 3)
        new = swept
        for j in range(used):
            new = sub(
                new, scale(load3(search, c + 9 + 6 * ((n_before - 1 - j) % REMEMBERED)), load(weight, j))
            )
        _set(model, state, k, swept, new, goes_on)


@inlined
def _weigh(state: State, n_before: int, used: int) -> None:
    """Find the combination of the last differences, newest first, that takes most off this sweep's change.

    The differences are made orthogonal to the newer ones through their products (Cholesky's factors); one
    that hardly differs from them has no weight.
    """
    work = state.work
    products, factor, right, weight = work.products, work.factor, work.right, work.weight
    newest = (n_before - 1) % REMEMBERED
    for j in range(used):
        product = _product(state, 12 + 6 * newest, 12 + 6 * j)
        store(products, REMEMBERED * newest + j, product)
        store(products, REMEMBERED * j + newest, product)
    for i in range(used):
        ci = (n_before - 1 - i) % REMEMBERED
        b = _product(state, 12 + 6 * ci, 6)
        for j in range(i + 1):
            product = load(products, REMEMBERED * ci + (n_before - 1 - j) % REMEMBERED)
            whole = product
            for m in range(j):
                product = product - load(factor, REMEMBERED * i + m) * load(factor, REMEMBERED * j + m)
            if j < i:
                store(factor, REMEMBERED * i + j, product * load(factor, REMEMBERED * j + j))
            else:
                new = (product > DEPENDENT * whole) & (whole > NOTHING)
                one = 1.0 / square_root(select(new, product, 1.0))
                # the inverse of the diagonal; 0 takes the difference out
                store(factor, REMEMBERED * i + i, select(new, one, 0.0))
        for m in range(i):
            b = b - load(factor, REMEMBERED * i + m) * load(right, m)
        store(right, i, b * load(factor, REMEMBERED * i + i))
    for back in range(used):
        i = used - 1 - back
        w = load(right, i)
        for m in range(i + 1, used):
            w = w - load(factor, REMEMBERED * m + i) * load(weight, m)
        store(weight, i, w * load(factor, REMEMBERED * i + i))


@inlined
def _product(state: State, a: int, b: int) -> Real:
    """Return the sum over all forces of the products of what is remembered of them at a and at b."""
    search = state.work.search
    total = splat(search, 0.0)
    for k in range(state.work.counts[N_FORCES]):
        total = total + dot(load3(search, SEARCH * k + a), load3(search, SEARCH * k + b))
    return total


@inlined
def _set(model: Model, state: State, k: int, swept: Point, new: Point, goes_on: Mask) -> None:
    """Give listed force k a new value, within its bounds, where it may change and did in the sweep."""
    work = state.work
    kind, n = work.force_kind[k], work.force_at[k]
    change = load3(work.search, SEARCH * k + 6)
    goes_on = goes_on & (dot(change, change) > 0.0)
    if kind == LINK_FORCE:
        force = select(goes_on, maximum(new[0], 0.0), swept[0])
        store(work.link, LINK * n + 18, force)
        a, b = model.islands[2 * n], model.islands[2 * n + 1]
        push_linked(
            work.link,
            LINK * n,
            work.acceleration,
            ACCELERATION * a,
            ACCELERATION * b,
            force - swept[0],
            load(model.place_mass, a),
            load(model.place_mass, b),
        )
    elif kind == PAIR_FORCE:
        force3 = select3(goes_on, _bounded(new, load3(work.pair, PAIR * n), model.friction), swept)
        store3(work.pair, PAIR * n + 12, force3)
        push_pair(model, state, n, sub(force3, swept))
    else:
        zero = splat(work.search, 0.0)
        normal = (zero, zero, zero + 1.0)
        if work.contact_slot[n] >= 2 * RODS * model.n_modules:
            normal = load3(work.contact, CONTACT * n + 23)
        friction = load(work.contact, CONTACT * n + 26)
        force3 = select3(goes_on, _bounded(new, normal, friction), swept)
        store3(work.contact, CONTACT * n + 6, force3)
        push_place(model, state, work.force_place[k], load3(work.contact, CONTACT * n), sub(force3, swept))


@inlined
def _bounded(force: Point, normal: Point, friction: Real) -> Point:
    """Return a force brought back into its cone: what pushes stays, what is across is cut."""
    pushed = dot(normal, force)
    across = sub(force, scale(normal, pushed))
    pushed = maximum(pushed, 0.0)
    size = square_root(maximum(dot(across, across), TINY))
    return add(scale(normal, pushed), scale(across, minimum(friction * pushed / size, 1.0)))
