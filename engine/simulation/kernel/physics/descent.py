"""Forces that contacts pass to each other slowly: sweeps, extrapolated.

Rods that jam with others of their module, a rod that is wedged between ground and wall or lies in their
corner: each contact undoes most of what the others do, and sweeps change less and less without being anywhere
near the end. A sweep is a map of forces to forces, whose fixed point is sought. Anderson's method (1965;
Walker and Ni 2011, "Anderson acceleration for fixed-point iterations") finds it from the last few sweeps: it
takes the combination of them whose change of forces would be least. Forces that leave their cones are brought
back.

The forces are listed in ``Work.listed``, three numbers each; a link's is filled up with zeros. In lanes in
which one is not there, or not among those that are swept over, it does not change, and so plays no part: once
all its lanes are done, it leaves the list. What is remembered of a force is a line of ``Work.search``.
"""

from __future__ import annotations

from typing import Final, TypeAlias

from engine.simulation.kernel.lanes.algebra import Point, add, dot, load3, scale, select3, store3, sub
from engine.simulation.kernel.lanes.compiling import compiled, inlined
from engine.simulation.kernel.lanes.simd import (
    Mask,
    Real,
    Reals,
    any_lane,
    load,
    mask_to_integer,
    maximum,
    minimum,
    select,
    splat,
    square_root,
    store,
)
from engine.simulation.kernel.physics.contact import is_there, push_place
from engine.simulation.kernel.physics.friction import TINY
from engine.simulation.kernel.physics.links import push_linked
from engine.simulation.kernel.physics.rod_contacts import is_pair_there, push_pair
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
SWEPT: Final = 9
"""Where the differences of forces after a sweep begin in a line of ``Work.search``, one after the other."""
CHANGED: Final = SWEPT + 3 * REMEMBERED
"""Where the differences of their changes begin."""

Sums: TypeAlias = tuple[Real, Real, Real, Real, Real]
"""A number for each of the ``REMEMBERED`` sweeps, which compiled code keeps in registers."""
Columns: TypeAlias = tuple[Point, Point, Point, Point, Point]
"""Three for each."""
assert REMEMBERED == 5


@inlined
def at_walls(model: Model, state: State, i: int) -> Mask:
    """Return the lanes in which a rod of an island touches a wall."""
    start, contact = state.work.contact_start, state.work.contact
    found = splat(contact, 0.0) > 0.0
    for n in range(start[2 * i], start[2 * i + 2]):
        if state.work.contact_slot[n] >= 2 * RODS * model.n_modules:
            found = found | is_there(contact, CONTACT * n)
    return found


@compiled
def list_island(model: Model, state: State, i: int, lanes: Mask) -> None:
    """Add an island's forces in some lanes to the list."""
    work = state.work
    if i < model.n_links and work.linked[i]:
        _list(state, LINK_FORCE, i, 0, lanes & (load(work.link, LINK * i + 17) > 0.0))
    for side in range(2):
        for n in range(work.contact_start[2 * i + side], work.contact_start[2 * i + side + 1]):
            there = is_there(work.contact, CONTACT * n)
            _list(state, CONTACT_FORCE, n, model.islands[2 * i + side], lanes & there)


@compiled
def list_pairs(state: State) -> None:
    """Add the forces between rods to the list."""
    for n in range(state.work.counts[N_PAIRS]):
        _list(state, PAIR_FORCE, n, 0, is_pair_there(state.work.pair, n))


@inlined
def _list(state: State, kind: int, n: int, place: int, lanes: Mask) -> None:
    """Add force n of a kind to the list, if it is there in any of the lanes."""
    work = state.work
    if any_lane(lanes):
        k = work.counts[N_FORCES]
        work.listed[k] = k
        work.force_kind[k], work.force_at[k], work.force_place[k] = kind, n, place
        store(work.force_lanes, k, mask_to_integer(lanes))
        work.counts[N_FORCES] = k + 1


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
    """Remember the listed forces before the first sweep from which others are extrapolated."""
    work = state.work
    for m in range(work.counts[N_FORCES]):
        k = work.listed[m]
        store3(work.search, SEARCH * k, _force(state, k))


@compiled
def extrapolate(model: Model, state: State, n_before: int, goes_on: Mask) -> None:
    """Move the listed forces on after a sweep, and remember them before the next one.

    Args:
        model: the robot.
        state: the simulations.
        n_before: remembered sweeps before this one.
        goes_on: lanes whose forces may change, from now on.
    """
    work = state.work
    _unlist(state, goes_on)
    used = min(n_before, REMEMBERED)
    newest = (n_before - 1) % REMEMBERED
    _compare(state, used, newest)
    if used == 0:
        return
    _weigh(state, used, newest)
    search, weight = work.search, work.weight
    for m in range(work.counts[N_FORCES]):
        k = work.listed[m]
        c = SEARCH * k
        change = load3(search, c + 6)
        here = goes_on & (dot(change, change) > 0.0)
        if not any_lane(here):
            continue
        swept = load3(search, c + 3)
        new, column = swept, newest
        for j in range(used):
            new = sub(new, scale(load3(search, c + SWEPT + 3 * column), load(weight, j)))
            column = column - 1 if column > 0 else REMEMBERED - 1
        store3(search, c, _set(model, state, k, swept, new, here))


@inlined
def _unlist(state: State, goes_on: Mask) -> None:
    """Take the forces off the list that are in none of the lanes that go on."""
    work = state.work
    n = 0
    for m in range(work.counts[N_FORCES]):
        k = work.listed[m]
        if any_lane(goes_on & (load(work.force_lanes, k) != 0)):
            work.listed[n] = k
            n += 1
    work.counts[N_FORCES] = n


@inlined
def _compare(state: State, used: int, newest: int) -> None:
    """Work out by how much a sweep exceeded those before it, and the products that ``_weigh`` needs.

    Those are sums over all forces: of what the newest difference of changes has in common with every one that
    is remembered, and of what these have in common with this sweep's change. Columns that are not used yet
    hold anything, and so do their sums.
    """
    work = state.work
    search = work.search
    zero = splat(search, 0.0)
    common = (zero, zero, zero, zero, zero)
    ahead = (zero, zero, zero, zero, zero)
    for m in range(work.counts[N_FORCES]):
        k = work.listed[m]
        c = SEARCH * k
        swept = _force(state, k)
        change = sub(swept, load3(search, c))
        if used:
            exceeded = sub(change, load3(search, c + 6))
            store3(search, c + SWEPT + 3 * newest, sub(swept, load3(search, c + 3)))
            store3(search, c + CHANGED + 3 * newest, exceeded)
            d = _columns(search, c + CHANGED)
            common = _plus_products(common, d, exceeded)
            ahead = _plus_products(ahead, d, change)
        store3(search, c, swept)
        store3(search, c + 3, swept)
        store3(search, c + 6, change)
    row = REMEMBERED * newest
    _store_sums(work.products, row, common)
    _store_sums(work.ahead, 0, ahead)
    for column in range(used):
        store(work.products, REMEMBERED * column + newest, load(work.products, row + column))


@inlined
def _columns(search: Reals, c: int) -> Columns:
    """Return what is remembered of a force at c, column by column."""
    return (
        load3(search, c),
        load3(search, c + 3),
        load3(search, c + 6),
        load3(search, c + 9),
        load3(search, c + 12),
    )


@inlined
def _plus_products(sums: Sums, columns: Columns, by: Point) -> Sums:
    """Return sums with every column's product with a vector added."""
    return (
        sums[0] + dot(columns[0], by),
        sums[1] + dot(columns[1], by),
        sums[2] + dot(columns[2], by),
        sums[3] + dot(columns[3], by),
        sums[4] + dot(columns[4], by),
    )


@inlined
def _store_sums(array: Reals, i: int, sums: Sums) -> None:
    """Set vectors from i on to one sum for each column."""
    store(array, i, sums[0])
    store(array, i + 1, sums[1])
    store(array, i + 2, sums[2])
    store(array, i + 3, sums[3])
    store(array, i + 4, sums[4])


@inlined
def _weigh(state: State, used: int, newest: int) -> None:
    """Find the combination of the last differences, newest first, that takes most off this sweep's change.

    The differences are made orthogonal to the newer ones through their products (Cholesky's factors); one
    that hardly differs from them has no weight.
    """
    work = state.work
    products, factor, right, weight = work.products, work.factor, work.right, work.weight
    for i in range(used):
        ci = (newest - i) % REMEMBERED
        b = load(work.ahead, ci)
        for j in range(i + 1):
            product = load(products, REMEMBERED * ci + (newest - j) % REMEMBERED)
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
def _set(model: Model, state: State, k: int, swept: Point, new: Point, here: Mask) -> Point:
    """Give listed force k a new value, within its bounds, in some lanes; return it."""
    work = state.work
    kind, n = work.force_kind[k], work.force_at[k]
    zero = splat(work.search, 0.0)
    force = swept
    if kind == LINK_FORCE:
        along = select(here, maximum(new[0], 0.0), swept[0])
        force = (along, zero, zero)
        store(work.link, LINK * n + 18, along)
        a, b = model.islands[2 * n], model.islands[2 * n + 1]
        push_linked(
            work.link,
            LINK * n,
            work.acceleration,
            ACCELERATION * a,
            ACCELERATION * b,
            along - swept[0],
            load(model.place_mass, a),
            load(model.place_mass, b),
        )
    elif kind == PAIR_FORCE:
        force = select3(here, _bounded(new, load3(work.pair, PAIR * n), model.friction), swept)
        store3(work.pair, PAIR * n + 12, force)
        push_pair(model, state, n, sub(force, swept))
    else:
        normal = (zero, zero, zero + 1.0)
        if work.contact_slot[n] >= 2 * RODS * model.n_modules:
            normal = load3(work.contact, CONTACT * n + 23)
        force = select3(here, _bounded(new, normal, load(work.contact, CONTACT * n + 26)), swept)
        store3(work.contact, CONTACT * n + 6, force)
        push_place(model, state, work.force_place[k], load3(work.contact, CONTACT * n), sub(force, swept))
    return force


@inlined
def _bounded(force: Point, normal: Point, friction: Real) -> Point:
    """Return a force brought back into its cone: what pushes stays, what is across is cut."""
    pushed = dot(normal, force)
    across = sub(force, scale(normal, pushed))
    pushed = maximum(pushed, 0.0)
    size = square_root(maximum(dot(across, across), TINY))
    return add(scale(normal, pushed), scale(across, minimum(friction * pushed / size, 1.0)))
