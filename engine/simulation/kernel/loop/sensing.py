"""What the built-in tasks sense and how they score, for all lanes at once.

They are goal reaching and squeezing of ``engine.tasks``, which says what the numbers mean. Lengths are in m,
angles in rad, positions horizontal. The head's frame is that of the settled head: x ahead, y to the left.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from engine.exact import cosine_and_sine
from engine.simulation.kernel.lanes.compiling import inlined
from engine.simulation.kernel.lanes.simd import (
    Integers,
    Mask,
    Real,
    Reals,
    absolute,
    by_lane,
    integers,
    lanes,
    load,
    load_lane,
    maximum,
    minimum,
    reals,
    select,
    splat,
    square_root,
    store,
    store_lane,
)
from engine.simulation.kernel.lanes.transcendental import angle
from engine.simulation.kernel.physics.state import ROD, WALL
from engine.tasks import GOAL_REACHING, SQUEEZING, SQUEEZING_BY_DISTANCE, Task
from engine.tasks.squeezing import BONUS, DEPTH, SENSOR_RANGE
from engine.tasks.walls import Wall

PYTHON: Final = 0
"""The kind of a task that only Python knows."""
GOAL: Final = 1
"""The kind of goal reaching."""
APERTURE: Final = 2
"""The kind of squeezing."""

SEEN: Final = WALL + 1
"""Numbers of a wall: those of ``kernel.physics.state``, then 1, or 0 in a lane where it is buried."""


_KNOWN: Final = ((GOAL, GOAL_REACHING), (APERTURE, SQUEEZING), (APERTURE, SQUEEZING_BY_DISTANCE))


class Scene(NamedTuple):
    """What the lanes' trials take place in and what their heads perceive of it.

    Attributes:
        kind: of the task.
        units: (inputs,) factors on what is sensed in m and rad.
        reach: up to where squeezing senses a wall straight ahead, in m.
        depth, bonus: how far past the gate a head must be, and what is deducted from its distance then, in m.
        by_distance: whether it must be that far from the gate's middle instead, and past the gate at all.
        head: (6,) vectors of integers: the three rods whose centres average to the head's front face, then
            those of its rear face.
        frame: (4,) vectors: x and y of the frame's origin in the world, and of its x axis.
        target: (4,) vectors: x and y of the target in the frame, then in the world.
        walls: (9 x walls,) vectors, in the frame, see ``SEEN``.
        faces: (4,) vectors: x and y of the head's front face and of its rear face in the world. In a lane
            whose simulation has failed they stay as they were before that.
    """

    kind: int
    units: np.ndarray
    reach: float
    depth: float
    bonus: float
    by_distance: bool
    head: Integers
    frame: Reals
    target: Reals
    walls: Reals
    faces: Reals


def kind_of(task: Task) -> int:
    """Return the kind of a task whose sensors and score the kernel has, else ``PYTHON``."""
    for kind, known in _KNOWN:
        if task.sense is known.sense and task.score is known.score:
            return kind
    return PYTHON


def make_scene(
    kind: int,
    *,
    units: Sequence[float],
    by_distance: bool = False,
    heads: Sequence[Sequence[int]],
    targets: np.ndarray,
    walls: Sequence[Sequence[Wall]],
) -> Scene:
    """Return a scene whose frame and faces are still to be set, by ``look`` and ``place``.

    Args:
        kind: of the task.
        units: per number that it senses a factor.
        by_distance: see ``Scene``.
        heads: per lane the head's rods, see ``Scene``.
        targets: (lanes, 2) in the frame.
        walls: per lane its walls in the frame, equally many for all.
    """
    width = len(targets)
    boxes = reals(SEEN * len(walls[0]), width=width)
    numbers = by_lane(boxes).reshape(len(walls[0]), SEEN, width)
    for lane, boxes_there in enumerate(walls):
        for k, w in enumerate(boxes_there):
            numbers[k, :, lane] = (*w.centre, *w.half_size, *cosine_and_sine(w.yaw), not w.is_buried)
    target = reals(4, width=width)
    by_lane(target)[:2] = targets.T
    rods = integers(6, width=width)
    by_lane(rods)[:] = np.transpose(heads)
    return Scene(
        kind=kind,
        units=np.array(units, float),
        reach=SENSOR_RANGE,
        depth=DEPTH,
        bonus=BONUS,
        by_distance=by_distance,
        head=rods,
        frame=reals(4, width=width),
        target=target,
        walls=boxes,
        faces=reals(4, width=width),
    )


@inlined
def look(rods: Reals, failed: Integers, scene: Scene) -> None:
    """Bring a scene's faces up to date.

    Args:
        rods: the simulations' rods, see ``engine.simulation.kernel``.
        failed: one vector, not 0 in lanes whose simulation has failed.
        scene: whose faces.
    """
    for lane in range(lanes(rods)):
        if load_lane(failed, 0, lane) != 0:
            continue
        for face in range(2):
            a, b = load_lane(scene.head, 3 * face, lane), load_lane(scene.head, 3 * face + 1, lane)
            c = load_lane(scene.head, 3 * face + 2, lane)
            for axis in range(2):
                total = load_lane(rods, ROD * a + axis, lane) + load_lane(rods, ROD * b + axis, lane)
                total += load_lane(rods, ROD * c + axis, lane)
                store_lane(scene.faces, 2 * face + axis, lane, total / 3.0)


@inlined
def _unit(x: Real, y: Real) -> tuple[Real, Real]:
    """Return a vector at unit length; one of length 0, of a robot that failed when it settled, as it is."""
    length = square_root(x * x + y * y)
    length = select(length > 0.0, length, 1.0)
    return x / length, y / length


@inlined
def place(scene: Scene, walls: Reals) -> None:
    """Lay the frame where the head is now, and target and walls where they belong in it.

    Args:
        scene: whose faces are up to date.
        walls: (8 x walls,) vectors to be filled with the walls as they stand in the world.
    """
    x, y = load(scene.faces, 0), load(scene.faces, 1)
    ahead_x, ahead_y = x - load(scene.faces, 2), y - load(scene.faces, 3)
    ahead_x, ahead_y = _unit(ahead_x, ahead_y)
    store(scene.frame, 0, x)
    store(scene.frame, 1, y)
    store(scene.frame, 2, ahead_x)
    store(scene.frame, 3, ahead_y)
    ahead, left = load(scene.target, 0), load(scene.target, 1)
    store(scene.target, 2, x + (ahead * ahead_x - left * ahead_y))
    store(scene.target, 3, y + (ahead * ahead_y + left * ahead_x))
    for k in range(len(walls) // WALL):
        seen, stands = SEEN * k, WALL * k
        for i in range(2, 6):
            store(walls, stands + i, load(scene.walls, seen + i))
        ahead, left = load(scene.walls, seen), load(scene.walls, seen + 1)
        store(walls, stands, x + (ahead * ahead_x - left * ahead_y))
        store(walls, stands + 1, y + (ahead * ahead_y + left * ahead_x))
        cosine, sine = load(scene.walls, seen + 6), load(scene.walls, seen + 7)
        store(walls, stands + 6, cosine * ahead_x - sine * ahead_y)
        store(walls, stands + 7, cosine * ahead_y + sine * ahead_x)


@inlined
def position(scene: Scene) -> tuple[Real, Real]:
    """Return x and y of the heads in the frame."""
    x = load(scene.faces, 0) - load(scene.frame, 0)
    y = load(scene.faces, 1) - load(scene.frame, 1)
    return _turned(scene, x, y)


@inlined
def _turned(scene: Scene, x: Real, y: Real) -> tuple[Real, Real]:
    """Return a direction of the world in the frame."""
    ahead_x, ahead_y = load(scene.frame, 2), load(scene.frame, 3)
    return ahead_x * x + ahead_y * y, ahead_x * y - ahead_y * x


@inlined
def _facing(scene: Scene) -> tuple[Real, Real]:
    """Return from the rear face to the front face, in the world."""
    return load(scene.faces, 0) - load(scene.faces, 2), load(scene.faces, 1) - load(scene.faces, 3)


@inlined
def _distance_and_bearing(to_x: Real, to_y: Real, facing_x: Real, facing_y: Real) -> tuple[Real, Real]:
    """Return how far away a point is, and at which angle to where the head points, positive to the left."""
    ahead = to_x * facing_x + to_y * facing_y
    left = to_y * facing_x - to_x * facing_y
    return square_root(to_x * to_x + to_y * to_y), angle(left, ahead)


@inlined
def _to_target(scene: Scene) -> tuple[Real, Real]:
    to_x = load(scene.target, 2) - load(scene.faces, 0)
    to_y = load(scene.target, 3) - load(scene.faces, 1)
    facing_x, facing_y = _facing(scene)
    return _distance_and_bearing(to_x, to_y, facing_x, facing_y)


@inlined
def _blocked(scene: Scene, x: Real, y: Real, along_x: Real, along_y: Real, reach: float) -> Mask:
    """Return whether a ray meets a wall within reach: slabs, as in ``engine.tasks.walls.Obstacles``."""
    met = x != x
    for first in range(0, len(scene.walls), SEEN):
        cosine, sine = load(scene.walls, first + 6), load(scene.walls, first + 7)
        from_x, from_y = x - load(scene.walls, first), y - load(scene.walls, first + 1)
        start = cosine * from_x + sine * from_y, cosine * from_y - sine * from_x
        along = cosine * along_x + sine * along_y, cosine * along_y - sine * along_x
        enter, leave = splat(x, -np.inf), splat(x, np.inf)
        for axis in range(2):
            half = load(scene.walls, first + 3 + axis)
            # a ray along a face misses the slab, infinite both ways, or never leaves it
            step = select(absolute(along[axis]) < 1e-12, 1e-12, along[axis])
            one, other = (-half - start[axis]) / step, (half - start[axis]) / step
            enter = maximum(minimum(one, other), enter)
            leave = minimum(maximum(one, other), leave)
        there = load(scene.walls, first + 8) > 0.0
        met = met | (there & (leave >= enter) & (leave >= 0.0) & (enter <= reach))
    return met


@inlined
def sense(scene: Scene, inputs: Reals) -> None:
    """Fill the first vectors of ``inputs`` with what a task of the kernel senses."""
    distance, bearing = _to_target(scene)
    store(inputs, 0, distance * scene.units[0])
    store(inputs, 1, bearing * scene.units[1])
    if scene.kind == APERTURE:
        x, y = position(scene)
        facing_x, facing_y = _facing(scene)
        along_x, along_y = _turned(scene, facing_x, facing_y)
        along_x, along_y = _unit(along_x, along_y)
        gate_x, gate_y = load(scene.target, 0) / 4.0, load(scene.target, 1)
        distance, bearing = _distance_and_bearing(gate_x - x, gate_y - y, along_x, along_y)
        store(inputs, 2, select(x > gate_x, -distance, distance) * scene.units[2])
        store(inputs, 3, bearing * scene.units[3])
        blocked = _blocked(scene, x, y, along_x, along_y, scene.reach)
        store(inputs, 4, select(blocked, splat(x, scene.units[4]), 0.0))


@inlined
def score(scene: Scene, scores: Reals) -> None:
    """Set the first vector of ``scores`` to how a task of the kernel scores the present state, in m."""
    to_x = load(scene.target, 2) - load(scene.faces, 0)
    to_y = load(scene.target, 3) - load(scene.faces, 1)
    distance = square_root(to_x * to_x + to_y * to_y)
    if scene.kind == APERTURE:
        x, y = position(scene)
        ahead, aside = x - load(scene.target, 0) / 4.0, y - load(scene.target, 1)
        past = ahead >= scene.depth
        if scene.by_distance:
            past = (ahead > 0.0) & (square_root(ahead * ahead + aside * aside) >= scene.depth)
        distance = distance - select(past, splat(x, scene.bonus), 0.0)
    store(scores, 0, distance)
