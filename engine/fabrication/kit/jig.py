"""A jig: a plate with six posts, each with a clip that holds one rod of a module in its place.

The net is closed around the rods while they lie in it. Every post goes straight down from its rod through the
open cage, so that the finished module is pulled out upwards. How the module stands was searched once among
random turns for room around the posts; where along its rod each post holds it is chosen for the module and
its servo.
"""

from __future__ import annotations

import dataclasses
import itertools
from typing import Final

import numpy as np
from manifold3d import Manifold
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.fabrication.dimensions.cables import CableDesign
from engine.fabrication.dimensions.floating_module import floating_module
from engine.fabrication.materials import Materials
from engine.fabrication.parts import drum, servo_parts, solids

STANDS: Final = (-0.9639, 0.0463, 0.0896, 0.2463)
"""How a module stands in its jig: a quaternion (x, y, z, w)."""
BELOW: Final = 30.0
"""Room between the plate and the lowest node for fingers, in mm."""
POST: Final = 2.0
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
_END: Final = 4.0
"""Of a rod that a ring or knot needs besides the tail, in mm."""
_PLACES: Final = 25
"""Along each rod that are looked at."""
_BEST: Final = 4
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


def jig(design: CableDesign, materials: Materials) -> Jig | None:
    """Return the jig for a module, or None if its servo leaves no room for one.

    Args:
        design: of its cables.
        materials: what it is built from.
    """
    nodes = 1e3 * floating_module(design.level, None).nodes
    nodes = Rotation.from_quat(STANDS).apply(nodes - nodes.mean(axis=0))
    nodes[:, 2] += PLATE + BELOW - nodes[:, 2].min()
    found = _places(nodes, 1e3 * design.tail, materials)
    if found is None:
        return None
    places, room = found
    return Jig(_solid(nodes, places, materials), nodes, room)


def _places(nodes: np.ndarray, tail: float, materials: Materials) -> tuple[np.ndarray, float] | None:
    """Return (6, 3) where each rod is held, and the room around the posts; None if there is too little."""
    others = np.array([nodes[list(pair)] for pair in (*t.RODS, *t.CABLES)])
    options: list[list[tuple[float, np.ndarray]]] = []
    for r, (a, b) in enumerate(t.RODS):
        middle, half = (nodes[a] + nodes[b]) / 2, (nodes[b] - nodes[a]) / 2
        length = float(np.linalg.norm(half))
        reach = length - tail - _END - CLIP[1]
        along = [u for u in np.linspace(-reach, reach, _PLACES) if r != t.SERVO_ROD or _free(u, materials)]
        places = [middle + u / length * half for u in along]
        rest = np.delete(others, r, axis=0)
        rooms = [_room_below(p, rest) for p in places]
        best = sorted(range(len(places)), key=lambda k: -rooms[k])[:_BEST]
        options.append([(rooms[k], places[k]) for k in best])
    chosen: tuple[float, np.ndarray] | None = None
    for combination in itertools.product(*options):
        places_of = np.array([place for _, place in combination])
        apart = np.linalg.norm(places_of[:, None, :2] - places_of[None, :, :2], axis=-1)
        between = float(apart[np.triu_indices(len(places_of), 1)].min()) - 2 * POST
        room = min(between, *(own - POST - 1e3 * t.ROD_RADIUS for own, _ in combination))
        if chosen is None or room > chosen[0]:
            chosen = (room, places_of)
    return None if chosen is None or chosen[0] < LEAST_ROOM else (chosen[1], chosen[0])


def _free(u: float, materials: Materials) -> bool:
    """Tell whether a clip u mm along the servo rod, towards its second node, meets no part on it."""
    unit = servo_parts.servo_mount(materials)
    for solid in (unit, servo_parts.servo_body(materials.servo), drum.drum_in_place(materials.servo)):
        _, low, _, _, high, _ = solid.bounding_box()
        if low - CLIP[1] - 0.5 < u < high + CLIP[1] + 0.5:
            return False
    return True


def _room_below(place: np.ndarray, others: np.ndarray) -> float:
    """Return how far the post below a place is from (n, 2, 3) other rods and cables, axis to axis, in mm."""
    parts = np.linspace(0.0, 1.0, 60)[:, None]
    points = others[:, None, 0] + parts * (others[:, None, 1] - others[:, None, 0])
    over = np.maximum(points[..., 2] - (place[2] - CLIP[2]), 0.0)
    flat = np.linalg.norm(points[..., :2] - place[:2], axis=-1)
    return float(np.hypot(flat, over).min())


def _solid(nodes: np.ndarray, places: np.ndarray, materials: Materials) -> Manifold:
    middle = places[:, :2].mean(axis=0)
    radius = float(np.linalg.norm(places[:, :2] - middle, axis=1).max()) + FOOT
    whole = Manifold.cylinder(PLATE, radius, radius, 96).translate((*map(float, middle), 0.0))
    bore = 1e3 * t.ROD_RADIUS + materials.printer.clearance * 500
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
