"""The lanes' states and the memory that a step works in.

Arrays are of vectors, one lane per simulation (``simd``). Forces of the last step are part of a state: a step
starts its search for the new ones from them.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.robots.model import Model
from engine.simulation.kernel.robots.parameters import INTERNAL, RODS

ROD: Final = 13
"""Numbers of a rod's state: centre 3, quaternion 4, velocity 3, angular velocity in its own frame 3."""
WALL: Final = 8
"""Numbers of a wall: centre 3, half sizes 3, cosine and sine of its turn about the vertical."""
POSE: Final = 15
"""Numbers of a rod that contacts and links need, in the world's axes: unit vector along it, centre of mass
from its middle, angular velocity, centre and velocity of the centre."""
ACCELERATION: Final = 6
"""Numbers of a rod's acceleration: of its centre of mass, less what its turning alone gives, and angular."""
CONTACT: Final = 27
"""Numbers of a contact of a rod with the ground or a wall (``contacts``)."""
PAIR: Final = 29
"""Numbers of a contact of two rods (``rod_contacts``)."""
REMEMBERED: Final = 5
"""Sweeps from which forces are extrapolated (``descent``)."""
SEARCH: Final = 9 + 6 * REMEMBERED
"""Numbers of a force there: before a sweep 3, after it 3, its change 3, and of every remembered sweep by how
much the force after it, 3, and then by how much its change, 3, exceeded that of the sweep before it."""
LINK: Final = 19
"""Numbers of a link (``links``)."""
OWN_PAIRS: Final = RODS * (RODS - 1) // 2
"""Pairs of rods of one module."""
PAIRS_OF_MODULE: Final = OWN_PAIRS + RODS * RODS
"""Pairs of rods whose force is kept from step to step: of one module and of it with the next."""


class Work(NamedTuple):
    """Memory that a step fills anew; not part of a state.

    Attributes:
        pose: (places x 15,) see ``POSE``.
        acceleration: (places x 6,) see ``ACCELERATION``.
        forward: (places x 3,) unit vector on the ground along which a rod's feet slide (``feet``).
        module: (6 x 18,) rotations and loads of one module's rods.
        contact: (contacts x 27,) contacts with ground and walls, those of a rod next to each other.
        contact_slot: per contact where its force is kept.
        contact_start: (islands x 2 + 1,) first contact of an island's first and second place.
        search: (forces x 39,) see ``SEARCH``; forces of contacts, links and pairs.
        listed: lines of ``search`` of the forces that are extrapolated.
        force_kind, force_at, force_place: per line what the force is of, which of those, and whose place.
        force_lanes: (forces,) integers: not 0 in the lanes in which the force is there.
        products, factor, ahead, right, weight: (m x m,), (m x m,) and three times (m,) of the equations for
            an extrapolation, m = ``REMEMBERED``.
        link: (links x 19,) see ``LINK``.
        linked: (links,) whether a link is taut in any lane.
        pair: (pairs x 29,) contacts between two rods.
        pair_slot: per contact where its force is kept, -1 for nowhere.
        pair_rods: (pairs x 2,) its rods.
        near: (all pairs x 2,) pairs of rods that may touch before the next search.
        near_walls: (places x walls x 2,) places and walls whose rods may touch before the next search.
        counts: see the constants in this module.
        used: slots whose force was set in the last step: pairs' from the start, walls' from ``used_walls``.
        used_walls: where those begin.
        coupled: (islands,) integers: 1 in lanes in which another island's rod touches one of this island's.
        moved: one vector: how far a point of a rod may have moved since the last search, in m.
        lane: (12,) vectors of reals for what is done lane by lane.
    """

    pose: np.ndarray
    acceleration: np.ndarray
    forward: np.ndarray
    module: np.ndarray
    contact: np.ndarray
    contact_slot: np.ndarray
    contact_start: np.ndarray
    search: np.ndarray
    listed: np.ndarray
    force_kind: np.ndarray
    force_at: np.ndarray
    force_place: np.ndarray
    force_lanes: np.ndarray
    products: np.ndarray
    factor: np.ndarray
    ahead: np.ndarray
    right: np.ndarray
    weight: np.ndarray
    link: np.ndarray
    linked: np.ndarray
    pair: np.ndarray
    pair_slot: np.ndarray
    pair_rods: np.ndarray
    near: np.ndarray
    near_walls: np.ndarray
    counts: np.ndarray
    used: np.ndarray
    used_walls: np.ndarray
    coupled: np.ndarray
    moved: np.ndarray
    lane: np.ndarray


N_NEAR: Final = 0
"""In ``Work.counts``: pairs of rods that may touch; -1 before the first search."""
N_NEAR_WALLS: Final = 1
"""Pairs of a rod and a wall that may touch."""
N_PAIRS: Final = 2
"""Contacts of two rods in the present step."""
N_USED: Final = 3
"""Slots of contacts of two rods whose force was set in the last step; -1 if not known, then it may be any."""
N_USED_WALLS: Final = 4
"""The same of contacts with walls."""
N_SWEEPS: Final = 5
"""Sweeps over one island since the state was made, all islands together: for benchmarks."""
N_COUPLED: Final = 6
"""Sweeps over all coupled islands since the state was made: for benchmarks."""
N_FORCES: Final = 7
"""Forces listed for extrapolation."""
N_COUNTS: Final = 8


class State(NamedTuple):
    """Simulations of robots of one size, one per lane.

    Attributes:
        rods: (rods x 13,) see ``ROD``.
        commanded: (modules x 5,) commanded lengths of the internal cables, in m.
        failed: (1,) integers: 0 while a simulation goes on, else one of ``guard``'s codes.
        n_walls: walls of every lane.
        walls: (walls x 8,) see ``WALL``.
        link_force: (links,) in N.
        contact_force: (slots x 3,) in N, in the world's axes: two of every place with the ground, then two of
            every place with every wall.
        pair_force: (slots x 3,) in N, on the second rod.
        work: what a step works in.
    """

    rods: np.ndarray
    commanded: np.ndarray
    failed: np.ndarray
    n_walls: int
    walls: np.ndarray
    link_force: np.ndarray
    contact_force: np.ndarray
    pair_force: np.ndarray
    work: Work


KEPT: Final = ("rods", "link_force", "contact_force", "pair_force")
"""The fields from which a simulation goes on with the same bits."""


def new_state(model: Model, *, n_walls: int = 0) -> State:
    """Return simulations at rest, all rods at the origin, with no forces and walls nowhere near."""
    m, rods, width = model.n_modules, RODS * model.n_modules, simd.width_of(model.stiffness)
    pairs, wall_contacts = rods * (rods - 1) // 2, 2 * rods * n_walls
    contacts = 2 * rods + wall_contacts
    forces = contacts + pairs + model.n_links

    def reals(n: int) -> np.ndarray:
        return simd.reals(n, width=width)

    def numbers(n: int) -> np.ndarray:
        return np.zeros(n, np.int64)

    work = Work(
        pose=reals(POSE * rods),
        acceleration=reals(ACCELERATION * rods),
        forward=reals(3 * rods),
        module=reals(18 * RODS),
        contact=reals(CONTACT * contacts),
        contact_slot=numbers(contacts),
        contact_start=numbers(2 * model.n_islands + 1),
        search=reals(SEARCH * forces),
        listed=numbers(forces),
        force_kind=numbers(forces),
        force_at=numbers(forces),
        force_place=numbers(forces),
        force_lanes=simd.integers(forces, width=width),
        products=reals(REMEMBERED * REMEMBERED),
        factor=reals(REMEMBERED * REMEMBERED),
        ahead=reals(REMEMBERED),
        right=reals(REMEMBERED),
        weight=reals(REMEMBERED),
        link=reals(LINK * model.n_links),
        linked=numbers(model.n_links),
        pair=reals(PAIR * pairs),
        pair_slot=numbers(pairs),
        pair_rods=numbers(2 * pairs),
        near=numbers(2 * pairs),
        near_walls=numbers(2 * rods * n_walls),
        counts=numbers(N_COUNTS),
        used=numbers(pairs),
        used_walls=numbers(wall_contacts),
        coupled=simd.integers(model.n_islands, width=width),
        moved=reals(1),
        lane=reals(12),
    )
    state = State(
        rods=reals(ROD * rods),
        commanded=reals(INTERNAL * m),
        failed=simd.integers(1, width=width),
        n_walls=n_walls,
        walls=reals(WALL * n_walls),
        link_force=reals(model.n_links),
        contact_force=reals(3 * contacts),
        pair_force=reals(3 * PAIRS_OF_MODULE * m),
        work=work,
    )
    simd.by_lane(state.rods).reshape(rods, ROD, width)[:, 3] = 1.0
    forget(state)
    return state


def forget(state: State) -> None:
    """Forget what a step keeps for the next one to save time: to be called after a state was written."""
    state.work.counts[[N_NEAR, N_USED, N_USED_WALLS]] = -1


def save(state: State, lane: int) -> np.ndarray:
    """Return one simulation's state, from which it goes on with the same bits in any lane of any width."""
    return np.concatenate([simd.by_lane(getattr(state, field))[:, lane] for field in KEPT])


def restore(state: State, lane: int, saved: np.ndarray) -> None:
    """Set one simulation's state to a saved one of a robot with as many modules and walls."""
    start = 0
    for field in KEPT:
        values = simd.by_lane(getattr(state, field))
        values[:, lane] = saved[start : start + len(values)]
        start += len(values)
    assert start == len(saved)
    forget(state)
