"""A jig: a plate with six posts, each with a clip that holds one rod of a module in its place.

The net is closed around the rods while they lie in it. Every post goes straight down from its rod through the
open cage, so that the finished module is pulled out upwards. The ways in which a module may stand were
searched once among thousands of random turns; which of them leaves most room, and where along its rod each
post holds it, is chosen for the module and its servo.
"""

from __future__ import annotations

import dataclasses
import functools
import io
import itertools
import re
from typing import Any, Final

import numpy as np
import trimesh
from manifold3d import Manifold
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.floating_module import floating_module
from engine.fabrication.kit.lone_module import LoneModule
from engine.fabrication.materials import CAP_SLEEVE, Materials
from engine.fabrication.parts import solids
from engine.fabrication.parts.assembly import robot_glb

STANDS: Final = (
    (-0.9639, 0.0463, 0.0896, 0.2463),
    (-0.1984, -0.1008, 0.621, 0.7516),
    (0.1232, -0.1899, 0.6968, -0.6806),
    (0.1599, 0.7096, -0.6541, 0.2077),
)
"""Ways in which a module may stand in its jig, as quaternions (x, y, z, w)."""
BELOW: Final = 30.0
"""Room between the plate and the lowest node for fingers, in mm."""
POST: Final = 3.0
"""Radius of a post, in mm."""
PLATE: Final = 3.0
"""Thickness of the plate, in mm."""
FOOT: Final = 16.0
"""By which the plate reaches beyond the posts, in mm: it must not tip over."""
CLIP: Final = (3.5, 5.0, 4.5, 2.2)
"""Half width, half length along the rod, depth below and height above the rod's axis, in mm."""
SNAP: Final = 2.6
"""Width of a clip's opening, in mm: a rod of 3 mm snaps in."""
LEAST_ROOM: Final = 1.0
"""Between a post and whatever is not its rod, in mm."""
_END: Final = 1.0
"""Of a rod that stays free beside a cap, in mm."""
_PLAY: Final = 0.5
"""Between a clip and the parts on the servo rod, and four times a rod's play in its bore, in mm."""
_SAMPLED: Final = 3.0
"""Longest distance of neighbouring points on these parts, in mm."""
_ROD: Final = re.compile(r"_rod(\d+)$")
_OTHERS: Final = re.compile(r"_cap_|_cable_|_way_|_servo_\d+$")
"""Names of parts at the rods' ends, or put on once the module lies in the jig."""
_PLACES: Final = 13
"""Along each rod that are looked at."""
_BEST: Final = 5
"""Of them that are combined."""


@dataclasses.dataclass(frozen=True, slots=True)
class Jig:
    """A jig as it stands on the table, in mm.

    Attributes:
        solid: the lowest point at z = 0.
        nodes: (12, 3) of the module in it.
        room: least gap between a post and another rod, a cable or another post.
    """

    solid: Manifold
    nodes: np.ndarray
    room: float


@functools.lru_cache(maxsize=16)
def robot_jig(morphology: Morphology, materials: Materials) -> Jig | None:
    """Return the jig for all modules of a robot, or None as ``jig``."""
    level = morphology.stiffness_levels[0]  # servo off, they are all of a shape
    return jig(level, robot_glb(LoneModule(level, (1,)), materials))


def jig_mass(holder: Jig, materials: Materials) -> float:
    """Return the mass of a jig in kg, printed solid."""
    return 1e-9 * materials.plastic.density * float(holder.solid.volume())


def jig(level: int, glb: bytes) -> Jig | None:
    """Return the jig for a module, or None if its servo leaves no room for one.

    Args:
        level: its stiffness level.
        glb: scene of the module alone, which shows where the parts on its servo rod are.
    """
    module = 1e3 * floating_module(level, None).nodes
    unit = _unit(glb, module)
    best: tuple[float, np.ndarray, np.ndarray] | None = None
    for stand in STANDS:
        turn = Rotation.from_quat(stand)
        nodes, parts = turn.apply(module), turn.apply(unit)
        lift = np.array([0.0, 0.0, PLATE + BELOW - nodes[:, 2].min()])
        found = _places(nodes + lift, parts + lift)
        if found is not None and (best is None or found[1] > best[0]):
            best = (found[1], nodes + lift, found[0])
    if best is None:
        return None
    room, nodes, places = best
    return Jig(_solid(nodes, places), nodes, room)


def _unit(glb: bytes, nodes: np.ndarray) -> np.ndarray:
    """Return (n, 3) points all over the parts on the servo rod, in mm, for a module with its nodes there."""
    scene: Any = trimesh.load(io.BytesIO(glb), file_type="glb")
    middles = np.zeros((len(t.RODS), 3))
    parts = []
    for name in scene.graph.nodes_geometry:
        place, geometry = scene.graph[name]
        mesh = scene.geometry[geometry]
        if found := _ROD.search(name):
            corners = trimesh.transform_points(mesh.vertices, place)
            middles[int(found[1])] = (corners.min(axis=0) + corners.max(axis=0)) / 2
        elif not _OTHERS.search(name):
            points, _ = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, 1e-3 * _SAMPLED)
            parts.append(trimesh.transform_points(points, place))
    held = np.array([nodes[list(ends)].mean(axis=0) for ends in t.RODS])
    drawn = 1e3 * middles
    turn, _ = Rotation.align_vectors(held - held.mean(axis=0), drawn - drawn.mean(axis=0))
    points = 1e3 * np.concatenate(parts)
    return np.asarray(turn.apply(points - drawn.mean(axis=0)) + held.mean(axis=0))


def _places(nodes: np.ndarray, unit: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Return (6, 3) where each rod is held, and the room around the posts; None if there is too little."""
    others = np.array([nodes[list(pair)] for pair in (*t.RODS, *t.CABLES)])
    options: list[list[tuple[float, np.ndarray]]] = []
    for r, (a, b) in enumerate(t.RODS):
        middle, half = (nodes[a] + nodes[b]) / 2, (nodes[b] - nodes[a]) / 2
        length = float(np.linalg.norm(half))
        reach = length - 1e3 * CAP_SLEEVE - _END - CLIP[1]
        rest = np.delete(others, r, axis=0)
        found = []
        for u in np.linspace(-reach, reach, _PLACES):
            place = middle + u / length * half
            if _clip_room(place, half, unit) > 0.0:
                room = min(_room_below(place, rest) - 1e3 * t.ROD_RADIUS, _points_below(place, unit))
                found.append((room - POST, place))
        options.append(sorted(found, key=lambda option: -option[0])[:_BEST])
    chosen: tuple[float, np.ndarray] | None = None
    for combination in itertools.product(*options):
        places = np.array([place for _, place in combination])
        apart = np.linalg.norm(places[:, None, :2] - places[None, :, :2], axis=-1)
        between = float(apart[np.triu_indices(len(places), 1)].min()) - 2 * POST
        room = min(between, *(own for own, _ in combination))
        if chosen is None or room > chosen[0]:
            chosen = (room, places)
    return None if chosen is None or chosen[0] < LEAST_ROOM else (chosen[1], chosen[0])


def _clip_room(place: np.ndarray, along: np.ndarray, unit: np.ndarray) -> float:
    """Return the gap in mm between a clip and the parts on the servo rod; negative if they would meet."""
    wide, half, below, above = CLIP
    across, up, ahead = ((unit - place) @ _clip_frame(along)).T
    outside = [np.abs(across) - wide, np.maximum(up - above, -below - up), np.abs(ahead) - half]
    return float(np.max(outside, axis=0).min()) - _PLAY


def _points_below(place: np.ndarray, points: np.ndarray) -> float:
    """Return how far the axis of the post below a place is from (n, 3) points, in mm."""
    over = np.maximum(points[:, 2] - (place[2] - CLIP[2]), 0.0)
    return float(np.hypot(np.linalg.norm(points[:, :2] - place[:2], axis=1), over).min())


def _room_below(place: np.ndarray, others: np.ndarray) -> float:
    """Return how far the post below a place is from (n, 2, 3) other rods and cables, axis to axis, in mm."""
    parts = np.linspace(0.0, 1.0, 60)[:, None]
    points = others[:, None, 0] + parts * (others[:, None, 1] - others[:, None, 0])
    over = np.maximum(points[..., 2] - (place[2] - CLIP[2]), 0.0)
    flat = np.linalg.norm(points[..., :2] - place[:2], axis=-1)
    return float(np.hypot(flat, over).min())


def _solid(nodes: np.ndarray, places: np.ndarray) -> Manifold:
    middle = places[:, :2].mean(axis=0)
    radius = float(np.linalg.norm(places[:, :2] - middle, axis=1).max()) + FOOT
    whole = Manifold.cylinder(PLATE, radius, radius, 96).translate((*map(float, middle), 0.0))
    bore = 1e3 * t.ROD_RADIUS + _PLAY / 4
    wide, half, below, above = CLIP
    for (a, b), place in zip(t.RODS, places, strict=True):
        x, y, z = map(float, place)
        post = Manifold.cylinder(z - 2.0, 1.5 * POST, POST, 32).translate((x, y, 0.0))
        block = solids.box((-wide, -below, -half), (wide, above, half))
        # its opening looks up as far as the rod's slope lets it
        frame = _clip_frame(nodes[b] - nodes[a])
        whole = whole + post + solids.placed(block, frame, place)
    for (a, b), place in zip(t.RODS, places, strict=True):
        frame = _clip_frame(nodes[b] - nodes[a])
        opening = solids.box((-SNAP / 2, 0.0, -half - 3.0), (SNAP / 2, above + 3.0, half + 3.0))
        whole = whole - solids.bar(nodes[a], nodes[b], bore) - solids.placed(opening, frame, place)
    return whole


def _clip_frame(axis: np.ndarray) -> np.ndarray:
    """Return (3, 3) with columns across, up and along a rod."""
    along = axis / np.linalg.norm(axis)
    up = np.array([0.0, 0.0, 1.0])
    up = up - along * (up @ along)
    up = up / np.linalg.norm(up)
    return np.stack([np.cross(up, along), up, along], axis=1)
