"""Where rods touch walls: boxes turned about the vertical, which each lane has in places of its own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np

from engine.exact import cosine_and_sine
from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.lanes.algebra import (
    Point,
    add,
    clamp,
    cross,
    dot,
    load3,
    scale,
    select3,
    store3,
    store6,
    sub,
    zero3,
)
from engine.simulation.kernel.lanes.compiling import compiled, inlined
from engine.simulation.kernel.lanes.simd import (
    Mask,
    Real,
    absolute,
    any_lane,
    lanes,
    load,
    load_lane,
    mask_to_integer,
    maximum,
    select,
    splat,
    square_root,
    store,
    store_lane,
    to_real,
)
from engine.simulation.kernel.physics.capsule_box import NOWHERE, touching_points
from engine.simulation.kernel.physics.contact import largest_across, softened, store_inverse, where_there
from engine.simulation.kernel.physics.rod_contacts import MARGIN
from engine.simulation.kernel.physics.softness import impedance, plus_rod
from engine.simulation.kernel.physics.state import CONTACT, N_NEAR_WALLS, N_USED_WALLS, POSE, WALL, State
from engine.simulation.kernel.robots.model import Model
from engine.simulation.kernel.robots.parameters import RODS
from engine.tasks.walls import Wall

NOWHERE_NEAR: Final = (0.0, 0.0, -1e3, 1e-3, 1e-3, 1e-3, 1.0, 0.0)
"""A wall that no robot meets: fills up a lane that has fewer walls than others."""
INSIDE: Final = 1e-15
"""Distance in m from a box up to which MuJoCo takes a point to lie inside it."""

Turn = tuple[Real, Real]
"""Cosine and sine of a turn about the vertical."""


def place_walls(state: State, lane: int, walls: Sequence[Wall]) -> None:
    """Put up walls in a lane; those that it lacks stand where nothing meets them."""
    rows = np.tile(NOWHERE_NEAR, (len(state.walls) // WALL, 1))
    for row, w in zip(rows, walls, strict=False):
        row[:] = (*w.centre, *w.half_size, *cosine_and_sine(w.yaw))
    simd.by_lane(state.walls)[:, lane] = rows.ravel()


def read_walls(model: mujoco.MjModel) -> list[Wall]:
    """Return the boxes of a model's world.

    Raises:
        ValueError: one is tilted.
    """
    walls = []
    for g in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_BOX):
        w, x, y, z = model.geom_quat[g]
        if x or y:
            raise ValueError(f"the kernel needs boxes to stand upright; geom {g} is tilted")
        centre, half_size = model.geom_pos[g].tolist(), model.geom_size[g].tolist()
        walls.append(Wall(centre=centre, half_size=half_size, yaw=2.0 * math.atan2(z, w)))
    return walls


@compiled
def search_walls(model: Model, state: State) -> None:
    """List the places and walls that are near each other in any lane, island by island and place by place."""
    near = state.work.near_walls
    n = 0
    for i in range(2 * model.n_islands):
        k = model.islands[i]
        if k < 0:
            continue
        for w in range(state.n_walls):
            p, h, s, _ = _in_box(model, state, k, w)
            if any_lane(_within(p, h, s, model.radius + MARGIN)):
                near[2 * n], near[2 * n + 1] = k, w
                n += 1
    state.work.counts[N_NEAR_WALLS] = n


@inlined
def _in_box(model: Model, state: State, k: int, w: int) -> tuple[Point, Point, Point, Turn]:
    """Return middle and half axis of the rod at place k, in wall w's frame, its half sizes and its turn."""
    walls, c = state.walls, WALL * w
    turn = (load(walls, c + 6), load(walls, c + 7))
    p = _turned_back(sub(load3(state.work.pose, POSE * k + 9), load3(walls, c)), turn)
    h = _turned_back(scale(load3(state.work.pose, POSE * k), model.half_length), turn)
    return p, h, load3(walls, c + 3), turn


@inlined
def _turned_back(a: Point, turn: Turn) -> Point:
    """Return a point of the world's axes in a wall's."""
    return turn[0] * a[0] + turn[1] * a[1], turn[0] * a[1] - turn[1] * a[0], a[2]


@inlined
def _turned(a: Point, turn: Turn) -> Point:
    """Return a point of a wall's axes in the world's."""
    return turn[0] * a[0] - turn[1] * a[1], turn[1] * a[0] + turn[0] * a[1], a[2]


@inlined
def _within(p: Point, h: Point, s: Point, reach: float) -> Mask:
    """Return whether a rod may be nearer to a box than a reach: no axis of the box separates them."""
    return (
        (absolute(p[0]) - absolute(h[0]) - s[0] <= reach)
        & (absolute(p[1]) - absolute(h[1]) - s[1] <= reach)
        & (absolute(p[2]) - absolute(h[2]) - s[2] <= reach)
    )


@compiled
def touch_wall(model: Model, state: State, k: int, w: int, n: int) -> int:
    """List the contacts of the rod at place k with a wall, after n others; return how many there are."""
    points = state.work.lane
    p, h, s, turn = _in_box(model, state, k, w)
    near = _within(p, h, s, model.radius) & (load(state.failed, 0) == 0)
    if not any_lane(near):
        return n
    for i in range(3):
        store(points, i, p[i])
        store(points, 3 + i, h[i])
        store(points, 6 + i, s[i])
    store(points, 9, to_real(mask_to_integer(near)))
    store(points, 10, 0.0)
    store(points, 11, NOWHERE)
    for lane in range(lanes(points)):
        if load_lane(points, 9, lane) > 0.0:
            first, second = touching_points(
                _point_of(points, 0, lane),
                _point_of(points, 3, lane),
                _point_of(points, 6, lane),
                model.half_length,
            )
            store_lane(points, 10, lane, first)
            store_lane(points, 11, lane, second)
    first, second = load(points, 10), load(points, 11)
    slot = 2 * RODS * model.n_modules + 2 * (k * state.n_walls + w)
    n = _touch(model, state, k, n, slot, near, add(p, scale(h, first)), p, s, turn)
    twice = near & (second > 0.5 * (NOWHERE - 2.0))
    return _touch(model, state, k, n, slot + 1, twice, add(p, scale(h, first + second)), p, s, turn)


@inlined
def _point_of(points: object, i: int, lane: int) -> tuple[float, float, float]:
    """Return a lane's part of vectors i to i + 2."""
    return load_lane(points, i, lane), load_lane(points, i + 1, lane), load_lane(points, i + 2, lane)


@compiled
def _touch(
    model: Model,
    state: State,
    k: int,
    n: int,
    slot: int,
    near: Mask,
    at: Point,
    p: Point,
    s: Point,
    turn: Turn,
) -> int:
    """List the contact of a sphere about a point of a rod with a wall, after n others; return how many.

    Args:
        model: the robot.
        state: the simulations.
        k: the rod's place.
        n: contacts before.
        slot: where the contact's force is kept.
        near: lanes in which it is to be considered.
        at: the point in the wall's frame.
        p: the rod's middle in the wall's frame.
        s: half sizes of the wall.
        turn: the wall's.
    """
    depth, normal, point = _sphere_box(at, s, model.radius, near)
    there = near & (depth <= 0.0)
    if not any_lane(there):
        return n
    pose, contact = state.work.pose, state.work.contact
    normal, r = _turned(normal, turn), _turned(sub(point, p), turn)
    velocity = add(load3(pose, POSE * k + 12), cross(load3(pose, POSE * k + 6), r))
    r = sub(r, load3(pose, POSE * k + 3))
    least, most, width = model.contact_impedance
    hard = impedance(depth, least, most, width)
    soft = (1.0 - hard) * load(model.place_weight, k) / hard
    response = plus_rod(
        softened(soft, soft * (1.0 / model.impratio), normal),
        load3(pose, POSE * k),
        r,
        load(model.place_mass, k),
        load(model.place_inertia, k),
        load(model.place_spin, k),
    )
    c = CONTACT * n
    sought = scale(velocity, -model.contact_damping)
    store3(contact, c, r)
    store3(contact, c + 3, sub(sought, scale(normal, model.contact_stiffness * hard * depth)))
    store3(contact, c + 6, where_there(there, state.contact_force, 3 * slot))
    store6(contact, c + 9, response)
    store_inverse(contact, c + 15, there, response)
    store(contact, c + 21, soft)
    store(contact, c + 22, largest_across(response, normal))
    store3(contact, c + 23, normal)
    store(contact, c + 26, splat(contact, model.friction))
    state.work.contact_slot[n] = slot
    return n + 1


@inlined
def _sphere_box(at: Point, s: Point, radius: float, near: Mask) -> tuple[Real, Point, Point]:
    """Return how a sphere touches a box, in the box's frame, as MuJoCo has it.

    Returns:
        The distance between the surfaces, negative where they overlap; the normal from the box into the
        sphere; the point halfway between the surfaces.
    """
    closest = (clamp(at[0], -s[0], s[0]), clamp(at[1], -s[1], s[1]), clamp(at[2], -s[2], s[2]))
    away = sub(at, closest)
    distance = square_root(dot(away, away))
    normal = scale(away, 1.0 / maximum(distance, INSIDE))
    point = scale(add(closest, sub(at, scale(normal, radius))), 0.5)
    depth = distance - radius
    inside = near & (distance <= INSIDE)
    if any_lane(inside):
        # out through the closest face
        zero = splat(depth, 0.0)
        out, face = absolute(-s[0] - at[0]), (zero - 1.0, zero, zero)
        for sign in (-1.0, 1.0):
            for i in range(3):
                if sign < 0.0 and i == 0:
                    continue
                far = absolute(sign * s[i] - at[i])
                nearer = far < out
                out = select(nearer, far, out)
                unit = (zero + sign * (i == 0), zero + sign * (i == 1), zero + sign * (i == 2))
                face = select3(nearer, unit, face)
        normal = select3(inside, face, normal)
        middle = sub(at, scale(face, (radius - out) * 0.5))
        point = select3(inside, middle, point)
        depth = select(inside, -out - radius, depth)
    return depth, normal, point


@compiled
def forget_walls(model: Model, state: State) -> None:
    """Forget the forces of contacts with walls of the last step, once those of this step are listed."""
    counts, zero = state.work.counts, zero3(state.rods)
    if counts[N_USED_WALLS] < 0:
        first = 2 * RODS * model.n_modules
        for slot in range(first, first * (1 + state.n_walls)):
            store3(state.contact_force, 3 * slot, zero)
    for i in range(counts[N_USED_WALLS]):
        store3(state.contact_force, 3 * state.work.used_walls[i], zero)
