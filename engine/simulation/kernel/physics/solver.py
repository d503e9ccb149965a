"""The forces of all contacts and links: block Gauss-Seidel, island by island.

A link joins two rods and no rod has two links, so the constraints of an island, a link and at most a few
contacts with ground and walls, do not feel other islands'. An island is swept over, one constraint after the
other, until in a lane a sweep changes nothing that counts; then that lane's forces stay as they are. So
every lane takes its own number of sweeps, whatever the others do.

Where rods of two islands touch, those islands are coupled and wait: afterwards all coupled islands and the
contacts between rods are swept over together, until a sweep changes nothing that counts. Rods jam, most of
all those of soft modules, and plain sweeps then take 100 to 200; extrapolated (``descent``), 15 to 40.

What counts, ``Model.settled``, is a change of a rod's velocity by 1e-8 m/s. Half of the islands then take two
sweeps, one in a hundred 20; eight robots with gaits of their own wait for the slowest, 4 to 10 sweeps
on average. A tenth of the tolerance costs 3 to 12 % and gains a digit. A step from states with no forces
known is then within 1e-7 m/s of Newton's. After 200 sweeps (``Model.most_sweeps``) an island is left as it
is. Islands with walls, where contacts may pass force to each other slowly, are extrapolated too, and to a
hundredth of that change: within 1e-8 m/s of Newton's.

From the seventh sweep on, forces within their bounds are moved further than they seek, by 1.3 (successive
over-relaxation), which saves a tenth of the sweeps; from the first on it would cost islands that need two.
"""

from __future__ import annotations

from typing import Final

from engine.simulation.kernel.lanes.algebra import Symmetric, dot, load3, load6, store3
from engine.simulation.kernel.lanes.compiling import compiled, inlined
from engine.simulation.kernel.lanes.simd import (
    Mask,
    Real,
    Reals,
    any_lane,
    load,
    mask_to_integer,
    maximum,
    store,
)
from engine.simulation.kernel.physics.contact import push_place, relax_on_ground, relax_on_wall
from engine.simulation.kernel.physics.descent import at_walls, extrapolate, list_island, list_pairs, remember
from engine.simulation.kernel.physics.links import push_linked, relax_link
from engine.simulation.kernel.physics.rod_contacts import is_pair_there, push_pair, relax_pair
from engine.simulation.kernel.physics.state import (
    ACCELERATION,
    CONTACT,
    LINK,
    N_COUPLED,
    N_FORCES,
    N_PAIRS,
    N_SWEEPS,
    N_USED,
    N_USED_WALLS,
    PAIR,
    State,
)
from engine.simulation.kernel.robots.model import Model
from engine.simulation.kernel.robots.parameters import RODS

STRAIGHT: Final = 6
"""Sweeps before forces are moved further than they seek."""
OVER: Final = 1.3
"""How much further; 1.2 to 1.5 hardly differ."""
EARLY: Final = 2
"""Sweeps over coupled islands before their forces are extrapolated: few of them settle sooner."""
FINER: Final = 0.01
"""Part of ``Model.settled`` that counts in an island with walls, where a sweep's change says less."""
LONGER: Final = 5
"""Times ``Model.most_sweeps`` that such an island may take."""


@compiled
def solve(model: Model, state: State) -> None:
    """Find the forces of contacts and links, and add to the accelerations what they do."""
    work = state.work
    simulated = load(state.failed, 0) == 0
    n_islands, n_pairs = model.n_islands, work.counts[N_PAIRS]
    if n_pairs:
        _couple(model, state)
    for i in range(n_islands):
        _push_island(model, state, i)
        goes_on = simulated
        if n_pairs:
            goes_on = goes_on & (load(work.coupled, i) == 0)
        if state.n_walls:
            walled = goes_on & at_walls(model, state, i)
            goes_on = goes_on & ~walled
            _relax_corner(model, state, i, walled)
        _relax_island(model, state, i, goes_on, model.most_sweeps, model.settled)
    if n_pairs:
        _relax_coupled(model, state, simulated)
    _keep_forces(model, state)


@inlined
def _couple(model: Model, state: State) -> None:
    """Find which islands are coupled to others."""
    work = state.work
    coupled, pair = work.coupled, work.pair
    for i in range(model.n_islands):
        store(coupled, i, 0)
    for n in range(work.counts[N_PAIRS]):
        there = mask_to_integer(is_pair_there(pair, n))
        for end in range(2):
            m, r = work.pair_rods[2 * n + end] // RODS, work.pair_rods[2 * n + end] % RODS
            for order in range(model.orders[m], model.orders[m + 1]):
                place = model.order_places[RODS * order + r]
                island = place // 2 if place < 2 * model.n_links else place - model.n_links
                here = there & load(model.order_lanes, order)
                store(coupled, island, load(coupled, island) | here)


@compiled
def _push_island(model: Model, state: State, i: int) -> None:
    """Add to the accelerations of an island's rods what the forces of the last step do."""
    work = state.work
    if i < model.n_links and work.linked[i]:
        a, b = model.islands[2 * i], model.islands[2 * i + 1]
        c = LINK * i
        push_linked(
            work.link,
            c,
            work.acceleration,
            ACCELERATION * a,
            ACCELERATION * b,
            load(work.link, c + 18),
            load(model.place_mass, a),
            load(model.place_mass, b),
        )
    for side in range(2):
        for n in range(work.contact_start[2 * i + side], work.contact_start[2 * i + side + 1]):
            c = CONTACT * n
            r, force = load3(work.contact, c), load3(work.contact, c + 6)
            push_place(model, state, model.islands[2 * i + side], r, force)


@compiled
def _relax_island(model: Model, state: State, i: int, goes_on: Mask, most: int, settled: float) -> Mask:
    """Sweep over an island until nothing that counts changes; return the lanes where something still does.

    Args:
        model: the robot.
        state: the simulations.
        i: the island.
        goes_on: lanes to sweep over.
        most: most sweeps.
        settled: change of a rod's velocity that does not count, in m/s.
    """
    work = state.work
    link, contact, acceleration = work.link, work.contact, work.acceleration
    across = 1.0 / model.impratio
    n_ground = 2 * RODS * model.n_modules
    settled = settled / model.timestep
    first, second = model.islands[2 * i], model.islands[2 * i + 1]
    a = ACCELERATION * first
    b = ACCELERATION * second if second >= 0 else a
    for sweep in range(most):
        if not any_lane(goes_on):
            break
        over = 1.0 if sweep < STRAIGHT else OVER
        work.counts[N_SWEEPS] += 1
        before_a, before_b = load6(acceleration, a), load6(acceleration, b)
        if i < model.n_links and work.linked[i]:
            mass_a, mass_b = load(model.place_mass, first), load(model.place_mass, second)
            force = relax_link(link, LINK * i, acceleration, a, b, goes_on, over)
            push_linked(link, LINK * i, acceleration, a, b, force, mass_a, mass_b)
        for side in range(2):
            k = model.islands[2 * i + side]
            at = ACCELERATION * k
            for n in range(work.contact_start[2 * i + side], work.contact_start[2 * i + side + 1]):
                c = CONTACT * n
                linear, angular = load3(acceleration, at), load3(acceleration, at + 3)
                if work.contact_slot[n] < n_ground:
                    moved = relax_on_ground(contact, c, linear, angular, goes_on, across, over)
                else:
                    moved = relax_on_wall(contact, c, linear, angular, goes_on, across, over)
                push_place(model, state, k, load3(contact, c), moved)
        change = maximum(
            _difference(acceleration, a, before_a, model.half_length),
            _difference(acceleration, b, before_b, model.half_length),
        )
        goes_on = goes_on & (change > settled * settled)
    return goes_on


@compiled
def _relax_corner(model: Model, state: State, i: int, goes_on: Mask) -> None:
    """Sweep over an island with walls, extrapolated, until nothing that counts changes."""
    settled = FINER * model.settled
    goes_on = _relax_island(model, state, i, goes_on, STRAIGHT, settled)
    if not any_lane(goes_on):
        return
    state.work.counts[N_FORCES] = 0
    list_island(model, state, i, goes_on)
    remember(state)
    for n_before in range(LONGER * model.most_sweeps):
        goes_on = goes_on & _relax_island(model, state, i, goes_on, 1, settled)
        if not any_lane(goes_on):
            break
        extrapolate(model, state, n_before, goes_on)


@inlined
def _difference(acceleration: Reals, a: int, before: Symmetric, arm: float) -> Real:
    """Return the square of how much a rod's acceleration has changed, turning felt at the end of an arm."""
    now = load6(acceleration, a)
    x, y, z = now[0] - before[0], now[1] - before[1], now[2] - before[2]
    u, v, w = now[3] - before[3], now[4] - before[4], now[5] - before[5]
    return (x * x + y * y + z * z) + (u * u + v * v + w * w) * (arm * arm)


@compiled
def _relax_coupled(model: Model, state: State, simulated: Mask) -> None:
    """Sweep over all coupled islands and the contacts between rods until nothing that counts changes."""
    work = state.work
    settled = model.settled / model.timestep
    touched = load(work.coupled, 0)
    for i in range(1, model.n_islands):
        touched = touched | load(work.coupled, i)
    goes_on = simulated & (touched != 0)
    for n in range(work.counts[N_PAIRS]):
        push_pair(model, state, n, load3(work.pair, PAIR * n + 12))
    work.counts[N_FORCES] = 0
    for i in range(model.n_islands):
        list_island(model, state, i, load(work.coupled, i) != 0)
    list_pairs(state)
    for sweep in range(model.most_sweeps):
        if not any_lane(goes_on):
            break
        if sweep == EARLY:
            remember(state)
        work.counts[N_COUPLED] += 1
        still = simulated & ~simulated
        for i in range(model.n_islands):
            here = goes_on & (load(work.coupled, i) != 0)
            if any_lane(here):
                still = still | _relax_island(model, state, i, here, 1, model.settled)
        for n in range(work.counts[N_PAIRS]):
            if not any_lane(goes_on & is_pair_there(work.pair, n)):
                continue
            moved = relax_pair(model, state, n, goes_on)
            rods = work.pair_rods
            mass = max(model.inverse_mass[rods[2 * n] % RODS], model.inverse_mass[rods[2 * n + 1] % RODS])
            still = still | (dot(moved, moved) * (mass * mass) > settled * settled)
        goes_on = goes_on & still
        if sweep >= EARLY:
            extrapolate(model, state, sweep - EARLY, goes_on)


@inlined
def _keep_forces(model: Model, state: State) -> None:
    """Keep all forces for the next step to start from."""
    work = state.work
    n_islands, n_ground = model.n_islands, 2 * RODS * model.n_modules
    for i in range(model.n_links):
        if work.linked[i]:
            store(state.link_force, i, load(work.link, LINK * i + 18))
    n_walls = 0
    for n in range(work.contact_start[2 * n_islands]):
        slot = work.contact_slot[n]
        store3(state.contact_force, 3 * slot, load3(work.contact, CONTACT * n + 6))
        if slot >= n_ground:
            work.used_walls[n_walls] = slot
            n_walls += 1
    work.counts[N_USED_WALLS] = n_walls
    n_used = 0
    for n in range(work.counts[N_PAIRS]):
        slot = work.pair_slot[n]
        if slot >= 0:
            store3(state.pair_force, 3 * slot, load3(work.pair, PAIR * n + 12))
            work.used[n_used] = slot
            n_used += 1
    work.counts[N_USED] = n_used
