"""Feet that grip one way, drawn as small fins at the nodes, which point where these slide."""

from __future__ import annotations

import functools
from typing import Final

import numpy as np
import trimesh
import viser

from app.gui.viser_private import put_arrays
from engine.body import module as t
from engine.body.feet import Feet
from viz import theme
from viz.robot.geometry import Drawing
from viz.robot.skeleton import N_POINTS

SIZE: Final = np.array([0.011, 0.0045, 0.0045])
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
            batched_scales=np.tile(SIZE, (len(positions), 1)),
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
    order = np.arange(len(centres))
    along = centres[np.minimum(order + 1, order[-1])] - centres[np.maximum(order - 1, 0)]
    along = way * along[:, :2]
    angles: np.ndarray = np.arctan2(along[:, 1], along[:, 0])
    return angles


@functools.cache
def _fin() -> trimesh.Trimesh:
    """Return a pyramid of length, width and height 1 whose tip is at x = 1; it must not be changed."""
    base = [[0.0, y, z] for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    return trimesh.convex.convex_hull(np.array([*base, [1.0, 0.0, 0.0]]))
