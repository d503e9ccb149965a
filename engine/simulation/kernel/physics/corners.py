"""Islands with walls, whose contacts may pass force to each other slowly.

A rod that is wedged between ground and wall, or lies in their corner, has contacts that each undo most of
what the others do. Sweeps then change less and less without being anywhere near the end. So each sweep is
taken for one step of a descent, and the steps are added up by the nonlinear conjugate gradient method
(Silcowitz, Niebe and Erleben 2010, "A nonsmooth nonlinear conjugate gradient method for interactive contact
force problems"): after a sweep all forces go on in the direction of their last changes, the further the less
these have shrunk, and not at all when they have grown. Forces that leave their cones are brought back.
"""

from __future__ import annotations

from engine.simulation.kernel.lanes.algebra import (
    Point,
    add,
    dot,
    load3,
    load6,
    scale,
    select3,
    store3,
    sub,
    transform,
    zero3,
)
from engine.simulation.kernel.lanes.compiling import inlined
from engine.simulation.kernel.lanes.simd import (
    Mask,
    Real,
    load,
    maximum,
    minimum,
    select,
    splat,
    square_root,
)
from engine.simulation.kernel.physics.friction import TINY
from engine.simulation.kernel.physics.state import CONTACT, SEARCH, State
from engine.simulation.kernel.robots.model import Model
from engine.simulation.kernel.robots.parameters import RODS

NO_CHANGE: float = 1e-300
"""A change of forces below which there is no direction to go on in."""


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


@inlined
def begin_search(state: State, i: int) -> None:
    """Forget in which direction an island's forces changed."""
    start, search = state.work.contact_start, state.work.search
    for n in range(start[2 * i], start[2 * i + 2]):
        store3(search, SEARCH * n + 3, zero3(search))


@inlined
def remember_forces(state: State, i: int) -> None:
    """Remember an island's forces before a sweep."""
    start, search = state.work.contact_start, state.work.search
    for n in range(start[2 * i], start[2 * i + 2]):
        store3(search, SEARCH * n, load3(state.work.contact, CONTACT * n + 6))


@inlined
def change_in_sweep(state: State, i: int) -> Real:
    """Return how much an island's forces have changed in a sweep: squares, times acceleration per force."""
    start, search, contact = state.work.contact_start, state.work.search, state.work.contact
    total = splat(search, 0.0)
    for n in range(start[2 * i], start[2 * i + 2]):
        step = sub(load3(contact, CONTACT * n + 6), load3(search, SEARCH * n))
        total = total + dot(step, transform(load6(contact, CONTACT * n + 9), step))
    return total


@inlined
def how_far(change: Real, before: Real) -> Real:
    """Return which part of the last direction to go on, from the changes of this sweep and of the last."""
    part = change / maximum(before, NO_CHANGE)
    return select((part <= 1.0) & (before > NO_CHANGE), part, 0.0)


@inlined
def go_on(model: Model, state: State, n: int, part: Real, goes_on: Mask) -> Point:
    """Move the force of contact n on; return by how much it changed.

    Args:
        model: the robot.
        state: the simulations.
        n: the contact.
        part: which part of the last direction to go.
        goes_on: lanes whose force may change.
    """
    contact, search = state.work.contact, state.work.search
    f = load3(contact, CONTACT * n + 6)
    step = scale(load3(search, SEARCH * n + 3), part)
    store3(search, SEARCH * n + 3, add(step, sub(f, load3(search, SEARCH * n))))
    zero = splat(search, 0.0)
    normal = (zero, zero, zero + 1.0)
    if state.work.contact_slot[n] >= 2 * RODS * model.n_modules:
        normal = load3(contact, CONTACT * n + 23)
    new = add(f, step)
    pushed = dot(normal, new)
    across = sub(new, scale(normal, pushed))
    pushed = maximum(pushed, 0.0)
    size = square_root(maximum(dot(across, across), TINY))
    most = load(contact, CONTACT * n + 26) * pushed
    new = add(scale(normal, pushed), scale(across, minimum(most / size, 1.0)))
    new = select3(goes_on, new, f)
    store3(contact, CONTACT * n + 6, new)
    return sub(new, f)
