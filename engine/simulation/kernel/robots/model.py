"""The robots in the lanes: the numbers that all share, and vectors of those in which they differ.

Robots with equally many modules differ in the stiffness of their cables and in which rods their links join.
Whatever goes from link to link is therefore kept by *places*: a link joins the same two places in every lane,
whichever rods are there. Cables join rods of one module, the same in every robot, and go by rods' numbers.

The links divide the places into islands of one or two: link i joins places 2 i and 2 i + 1 and is island i;
then come the rods without a link, each an island of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from engine.simulation.kernel.lanes.algebra import Point, load3, select3, store3
from engine.simulation.kernel.lanes.compiling import inlined
from engine.simulation.kernel.lanes.simd import (
    Integers,
    Mask,
    Reals,
    by_lane,
    integers,
    load,
    reals,
    splat,
)
from engine.simulation.kernel.robots.parameters import RODS, Robot

_OWN: Final = frozenset({"stiffness", "feet", "speed_limit", "links", "link_arms", "link_weight", "apart"})
"""The fields of ``Robot`` that may differ between robots that share a vector."""


class Model(NamedTuple):
    """Numbers of the lanes' robots, in SI units; m modules, 6 m rods and places.

    Attributes:
        n_modules: m, of all robots. The attributes that are not explained here are ``Robot``'s, the same for
            all robots.
        stiffness: (m,) vectors.
        feet: one vector.
        n_footed: number of lanes in which it is not 0.
        speed_limit: one vector.
        n_links: links of every robot.
        link_arms: (links x 2,) vectors.
        link_weight: (links,) vectors.
        n_islands: number of islands.
        islands: (islands x 2,) the places of an island; -1 in place of a second one.
        place_mass, place_inertia, place_spin, place_weight: (places,) vectors: ``inverse_mass``,
            ``inverse_inertia``, ``inverse_spin`` and ``contact_weight`` of the rod at each place.
        orders: (m + 1,) where the orders of each module begin: the ways in which its rods are distributed
            over places.
        order_places: (orders x 6,) the places of a module's rods.
        order_lanes: (orders,) vectors of integers: 1 in lanes with this order.
        apart: (rods x rods,) a bit for each lane in which two rods pass through each other.
        lane_bits: one vector of integers: the bit of each lane.
    """

    n_modules: int
    timestep: float
    gravity: float
    stiffness: Reals
    cable_rods: np.ndarray
    cable_anchors: np.ndarray
    cable_rest: float
    cable_damping: float
    servo_gain: float
    servo_offset: float
    servo_limit: float
    servo_damping: float
    inverse_mass: np.ndarray
    inverse_inertia: np.ndarray
    inverse_spin: np.ndarray
    spin: np.ndarray
    axis: np.ndarray
    contact_weight: np.ndarray
    centre_of_mass: tuple[float, float, float]
    half_length: float
    radius: float
    friction: float
    feet: Reals
    n_footed: int
    feet_forward: float
    feet_backward: float
    feet_hold: float
    impratio: float
    contact_impedance: tuple[float, float, float]
    contact_stiffness: float
    contact_damping: float
    link_range: tuple[float, float]
    link_impedance: tuple[float, float, float]
    link_stiffness: float
    link_damping: float
    speed_limit: Reals
    arena_radius: float
    settled: float
    most_sweeps: int
    n_links: int
    link_arms: Reals
    link_weight: Reals
    n_islands: int
    islands: np.ndarray
    place_mass: Reals
    place_inertia: Reals
    place_spin: Reals
    place_weight: Reals
    orders: np.ndarray
    order_places: np.ndarray
    order_lanes: Integers
    apart: np.ndarray
    lane_bits: Integers


_COMMON: Final = [field for field in Robot._fields if field not in _OWN]


def may_share(a: Robot, b: Robot) -> bool:
    """Whether two robots may have lanes of one vector."""
    return len(a.links) == len(b.links) and all(
        np.array_equal(getattr(a, field), getattr(b, field)) for field in _COMMON
    )


def model_of(robots: Sequence[Robot]) -> Model:
    """Return the model of some robots, one per lane.

    Raises:
        ValueError: they may not share a vector.
    """
    first, width = robots[0], len(robots)
    if not all(r is first or may_share(first, r) for r in robots):
        raise ValueError("the kernel needs robots that share a vector to have one size and one physics")
    n_rods, n_links = RODS * first.n_modules, len(first.links)
    alone = np.arange(2 * n_links, n_rods)
    islands = np.concatenate(
        [np.arange(2 * n_links).reshape(-1, 2), np.column_stack([alone, np.full(len(alone), -1)])]
    )
    distinct = list({id(r): r for r in robots}.values())
    rods_of = {id(r): rods_by_place(r) for r in distinct}
    rods = np.array([rods_of[id(r)] for r in robots])
    places = rods.argsort(axis=1)
    orders, order_places, order_lanes = _orders(places)
    apart = sum(r.apart.astype(np.int64) << lane for lane, r in enumerate(robots))
    return Model(
        **{field: getattr(first, field) for field in _COMMON},
        stiffness=_vectors([r.stiffness for r in robots]),
        feet=_vectors([[r.feet] for r in robots]),
        n_footed=sum(r.feet != 0.0 for r in robots),
        speed_limit=_vectors([[r.speed_limit] for r in robots]),
        n_links=n_links,
        link_arms=_vectors([r.link_arms.ravel() for r in robots]),
        link_weight=_vectors([r.link_weight for r in robots]),
        n_islands=len(islands),
        islands=islands.ravel(),
        place_mass=_vectors(first.inverse_mass[rods % RODS]),
        place_inertia=_vectors(first.inverse_inertia[rods % RODS]),
        place_spin=_vectors(first.inverse_spin[rods % RODS]),
        place_weight=_vectors(first.contact_weight[rods % RODS]),
        orders=orders,
        order_places=order_places,
        order_lanes=order_lanes,
        apart=np.asarray(apart).ravel(),
        lane_bits=_whole([[1 << lane for lane in range(width)]]),
    )


def rods_by_place(robot: Robot) -> np.ndarray:
    """Return the rod at each place of a robot."""
    alone = np.setdiff1d(np.arange(RODS * robot.n_modules), robot.links)
    return np.concatenate([robot.links.ravel(), alone])


def _orders(places: np.ndarray) -> tuple[np.ndarray, np.ndarray, Integers]:
    """Return ``orders``, ``order_places`` and ``order_lanes`` from the (lanes, rods) places of rods."""
    starts, found, lanes = [0], [], []
    for m in range(places.shape[1] // RODS):
        rows, which = np.unique(places[:, RODS * m : RODS * (m + 1)], axis=0, return_inverse=True)
        found.append(rows)
        lanes += [which.ravel() == k for k in range(len(rows))]
        starts.append(len(lanes))
    return np.array(starts), np.concatenate(found).ravel(), _whole(np.array(lanes))


def _vectors(by_lanes: Sequence[Any] | np.ndarray) -> Reals:
    """Return (n,) vectors from (lanes, n) numbers."""
    numbers = np.asarray(by_lanes, float)
    vectors = reals(numbers.shape[1], width=len(numbers))
    by_lane(vectors)[:] = numbers.T
    return vectors


def _whole(numbers: Sequence[Sequence[int]] | np.ndarray) -> Integers:
    """Return (n,) vectors of integers from (n, lanes) ones."""
    numbers = np.asarray(numbers)
    vectors = integers(len(numbers), width=numbers.shape[1])
    by_lane(vectors)[:] = numbers
    return vectors


@inlined
def are_apart(model: Model, i: int, j: int) -> Mask:
    """Return whether two rods pass through each other."""
    bits = load(model.lane_bits, 0)
    return (splat(bits, model.apart[RODS * model.n_modules * i + j]) & bits) != 0


@inlined
def load3_of(model: Model, array: Reals, size: int, k: int, first: int) -> Point:
    """Return three of the numbers of rod k, which an array has by places.

    Args:
        model: the robots.
        array: (places x size,) vectors.
        size: numbers of a place.
        k: the rod.
        first: which number is the first.
    """
    m, r = k // RODS, k % RODS
    order, end = model.orders[m], model.orders[m + 1]
    found = load3(array, size * model.order_places[RODS * order + r] + first)
    for other in range(order + 1, end):
        there = load3(array, size * model.order_places[RODS * other + r] + first)
        found = select3(load(model.order_lanes, other) != 0, there, found)
    return found


@inlined
def store3_of(model: Model, array: Reals, size: int, k: int, first: int, value: Point) -> None:
    """Set three of the numbers of rod k, which an array has by places; see ``load3_of``."""
    m, r = k // RODS, k % RODS
    order, end = model.orders[m], model.orders[m + 1]
    if end - order == 1:
        store3(array, size * model.order_places[RODS * order + r] + first, value)
        return
    for order in range(model.orders[m], end):
        i = size * model.order_places[RODS * order + r] + first
        store3(array, i, select3(load(model.order_lanes, order) != 0, value, load3(array, i)))
