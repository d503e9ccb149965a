"""What everything in a scene is built of: tubes and balls, and flat discs without light and shade.

Everything of one shape and look is one batch, so one message a frame however much there is. There are few
shapes and two looks, because a browser without a graphics card takes long to prepare for another one.
"""

from __future__ import annotations

import functools
import json
import struct
from collections.abc import Sequence
from typing import Final

import numpy as np
import trimesh
import viser

from app.gui.viser_private import put_arrays
from engine.body import module as t
from engine.body.feet import Feet
from engine.body.kinematics import ahead
from viz import theme
from viz.robot.geometry import Drawing
from viz.robot.skeleton import N_POINTS

SIDES: Final = 32
"""Of a disc's edge."""
TUBE_SIDES: Final = 10
"""A computer without a graphics card feels every triangle."""
FLOAT: Final = 5126
SHORT: Final = 5123
BYTE: Final = 5121
"""Types of numbers, as glTF counts them."""

Rim = tuple[int, int, int, int]
"""Colour, and how much it covers, 0 to 255."""


@functools.cache
def unit_sphere() -> trimesh.Trimesh:
    """Return a sphere of radius 1, which must not be changed."""
    return trimesh.creation.icosphere(subdivisions=1)


@functools.cache
def unit_tube() -> trimesh.Trimesh:
    """Return a cylinder of radius and height 1 along z without its ends, which lie within nodes.

    It must not be changed.
    """
    tube = trimesh.creation.cylinder(radius=1.0, height=1.0, sections=TUBE_SIDES)
    tube.update_faces(np.abs(tube.face_normals[:, 2]) < 0.5)
    tube.remove_unreferenced_vertices()
    return tube


@functools.cache
def disc_glb(rims: Sequence[Rim], radii: Sequence[float] = ()) -> bytes:
    """Return a flat disc of radius 1 as a GLB file; between two of its rims the colours run into each other.

    Args:
        rims: the colours from the middle, or the innermost rim, to the edge.
        radii: of the rims, from 0 to 1; empty for evenly spread ones that begin in the middle.
    """
    radii = radii or tuple(np.linspace(0.0, 1.0, len(rims)))
    angle = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    places = np.concatenate([r * ring for r in radii])
    colors = np.repeat(np.array(rims), SIDES, axis=0)
    here = np.arange(SIDES)
    after = (here + 1) % SIDES
    faces = np.concatenate(
        [
            [
                (a, b, c)
                for i, j in zip(here, after, strict=True)
                for a, b, c in (
                    (k * SIDES + i, (k + 1) * SIDES + i, (k + 1) * SIDES + j),
                    (k * SIDES + i, (k + 1) * SIDES + j, k * SIDES + j),
                )
            ]
            for k in range(len(rims) - 1)
        ]
    )
    return flat_glb(places, colors, faces)


def flat_glb(places: np.ndarray, colors: np.ndarray, faces: np.ndarray) -> bytes:
    """Return triangles without light and shade as a GLB file.

    Args:
        places: (n, 3) of the corners, at most 65536.
        colors: (n, 4) theirs, and how much they cover, 0 to 255.
        faces: (k, 3) which corners.
    """
    places, faces = places.astype("<f4"), faces.astype("<u2")
    shares = colors / 255.0
    shares[:, :3] **= 2.2  # glTF's are linear
    parts = [a.tobytes() for a in (places, np.round(255.0 * shares).astype(np.uint8), faces)]
    starts = np.cumsum([0, *map(len, parts)])
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "material": 0}]}
        ],
        "materials": [
            {
                "extensions": {"KHR_materials_unlit": {}},
                "alphaMode": "BLEND",
                "doubleSided": True,
            }
        ],
        "extensionsUsed": ["KHR_materials_unlit"],
        "buffers": [{"byteLength": int(starts[-1])}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": int(a), "byteLength": len(part)}
            for a, part in zip(starts[:-1], parts, strict=True)
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": FLOAT,
                "count": len(places),
                "type": "VEC3",
                "min": places.min(axis=0).tolist(),
                "max": places.max(axis=0).tolist(),
            },
            {
                "bufferView": 1,
                "componentType": BYTE,
                "normalized": True,
                "count": len(colors),
                "type": "VEC4",
            },
            {"bufferView": 2, "componentType": SHORT, "count": int(faces.size), "type": "SCALAR"},
        ],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary = b"".join(parts)
    binary += b"\0" * (-len(binary) % 4)
    chunks = b"".join(
        struct.pack("<I4s", len(content), kind) + content
        for kind, content in ((b"JSON", text), (b"BIN\0", binary))
    )
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


class Discs:
    """Discs of one kind.

    Args:
        scene: of one client.
        name: of their node.
        glb: a disc, by ``disc_glb``.
        radius: of each, in m.
    """

    def __init__(self, scene: viser.SceneApi, name: str, glb: bytes, radius: float) -> None:
        self._radius = radius
        self._handle = scene.add_batched_glb(
            name,
            glb,
            batched_wxyzs=np.array([[1.0, 0.0, 0.0, 0.0]]),
            batched_positions=np.zeros((1, 3)),
            batched_scales=np.array([radius]),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )
        self._turns: np.ndarray | None = None

    def show(self, places: np.ndarray, turn: np.ndarray | None = None) -> None:
        """Show one at each of (n, 3) places in m, n at least 1, all with a turn (w, x, y, z) or flat."""
        n = len(places)
        turn = np.array([1.0, 0.0, 0.0, 0.0]) if turn is None else turn
        arrays = {"batched_positions": np.ascontiguousarray(places, dtype=np.float32)}
        turns = np.tile(turn.astype(np.float32), (n, 1))
        if self._turns is None or not np.array_equal(turns, self._turns):
            if self._turns is None or len(self._turns) != n:
                arrays["batched_scales"] = np.full(n, self._radius, dtype=np.float32)
            arrays["batched_wxyzs"] = self._turns = turns
        put_arrays(self._handle, **arrays)
        self.see(True)

    def see(self, visible: bool) -> None:
        """Show or hide them all."""
        if self._handle.visible != visible:
            self._handle.visible = visible

    def remove(self) -> None:
        """Take them away."""
        self._handle.remove()


FIN_SIZE: Final = np.array([0.011, 0.0045, 0.0045])
"""Length, width and height of a fin, in m."""


class Fins:
    """Draws the feet of a robot that has some.

    Args:
        scene: of one client.
        name: of the node in the scene.
        feet: which way they slide; not none.
        drawing: the robot at any moment.
    """

    def __init__(self, scene: viser.SceneApi, name: str, feet: Feet, drawing: Drawing) -> None:
        self._way = -1.0 if feet == "start" else 1.0
        positions, turns = self._places(drawing)
        fin = _fin()
        self._handle = scene.add_batched_meshes_simple(
            name,
            fin.vertices,
            fin.faces,
            batched_wxyzs=turns,
            batched_positions=positions,
            batched_scales=np.tile(FIN_SIZE, (len(positions), 1)),
            batched_colors=theme.linear(np.tile(np.array(theme.FOOT, np.uint8), (len(positions), 1))),
            lod="off",
            cast_shadow=False,
        )

    def show(self, drawing: Drawing) -> None:
        """Draw them at a moment."""
        positions, turns = self._places(drawing)
        put_arrays(self._handle, batched_positions=positions, batched_wxyzs=turns)

    def remove(self) -> None:
        """Take them away."""
        self._handle.remove()

    def _places(self, drawing: Drawing) -> tuple[np.ndarray, np.ndarray]:
        """Return the (nodes, 3) positions in m and (nodes, 4) quaternions of the fins, float32."""
        nodes = drawing.nodes.reshape(-1, N_POINTS, 3)[:, : len(t.NODES)]
        heading = headings(drawing.centres, self._way)
        turns = np.zeros((len(heading), 4), np.float32)
        turns[:, 0], turns[:, 3] = np.cos(heading / 2), np.sin(heading / 2)
        return nodes.reshape(-1, 3).astype(np.float32), np.repeat(turns, len(t.NODES), axis=0)


def headings(centres: np.ndarray, way: float) -> np.ndarray:
    """Return the (modules,) angles in rad, from the x axis, at which feet slide, as the kernel has them.

    Args:
        centres: (modules, 3) of the modules, in m.
        way: 1 towards the end of the chain, -1 towards its start.
    """
    along = ahead(centres, way)
    angles: np.ndarray = np.arctan2(along[:, 1], along[:, 0])
    return angles


@functools.cache
def _fin() -> trimesh.Trimesh:
    """Return a pyramid of length, width and height 1 whose tip is at x = 1; it must not be changed."""
    base = [[0.0, y, z] for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    return trimesh.convex.convex_hull(np.array([*base, [1.0, 0.0, 0.0]]))
