"""One robot in its world as nodes of a 3D scene: body, overlays, target, walls."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from app.gui.viser_private import put_arrays
from app.replay.overlays import OverlayLayer, Overlays
from app.replay.shapes import Discs, Fins, disc_glb, unit_sphere, unit_tube
from app.replay.target_mark import TargetMark
from engine.body.module import ROD_LENGTH
from engine.replay.recording import Playable
from engine.tasks.walls import Wall
from viz import theme
from viz.robot.geometry import CABLE_DRAWN_RADIUS, ROD_DRAWN_RADIUS, Drawing, DrawnReplay, RobotGeometry

WALL_OPACITY = 0.22
BOX_EDGES = np.array(
    [
        [corner, corner + 2.0 * axis]
        for axis in np.eye(3)
        for corner in np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
        if corner @ axis < 0.0
    ]
)
"""(12, 2, 3) ends of the edges of a box that reaches from -1 to 1."""
SHADOW = ((0, 0, 0, 160), (0, 0, 0, 125), (0, 0, 0, 42), (0, 0, 0, 0))
"""From the middle of a module's soft shadow to its edge."""
SHADOW_RADIUS = 0.085
SHADOW_LIFT = 0.001
COLOR_STEP = 3
"""Frames between two colours of the cables: they change slowly, and are a seventh of what a frame takes."""


class RobotDrawing:
    """Draws one replay; several, each below a node of its own, can share a scene.

    Args:
        scene: of one client.
        replay: the robot; there must be a frame of it.
        prefix: name of the node that everything hangs below, such as ``/lanes/1``; wherever that is moved
            to, all goes with it.
        trail: colour of the trail of its head.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        replay: Playable,
        *,
        prefix: str = "",
        trail: tuple[int, int, int] = theme.TRAIL,
    ) -> None:
        self._scene, self._prefix = scene, prefix
        self.replay = replay
        geometry = RobotGeometry(replay.morphology, replay.head.module)
        self._drawn = DrawnReplay(geometry, replay)
        drawing = self._drawn.at(replay.start_time, tension=True)
        tube, sphere = unit_tube(), unit_sphere()
        n_rods = len(drawing.rod_positions)
        self._rods = scene.add_batched_meshes_simple(
            f"{prefix}/robot/rods",
            tube.vertices,
            tube.faces,
            batched_wxyzs=drawing.rod_turns,
            batched_positions=drawing.rod_positions,
            batched_scales=np.tile([ROD_DRAWN_RADIUS, ROD_DRAWN_RADIUS, ROD_LENGTH], (n_rods, 1)),
            batched_colors=theme.linear(geometry.rod_colors),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )
        self._nodes = scene.add_batched_meshes_simple(
            f"{prefix}/robot/nodes",
            sphere.vertices,
            sphere.faces,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(drawing.nodes), 1)),
            batched_positions=drawing.nodes,
            batched_scales=geometry.node_radii,
            batched_colors=theme.linear(geometry.node_colors),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )
        self._cables = scene.add_line_segments(
            f"{prefix}/robot/cables",
            drawing.cables,
            theme.linear(drawing.cable_colors),
            thickness=2 * CABLE_DRAWN_RADIUS,
        )
        self._shadows = Discs(scene, f"{prefix}/robot/shadows", disc_glb(SHADOW), SHADOW_RADIUS)
        self._handles: list[viser.SceneNodeHandle] = [self._rods, self._nodes, self._cables]
        feet = replay.morphology.feet
        self._fins = None if feet == "none" else Fins(scene, f"{prefix}/robot/feet", feet, drawing)
        self._layer = OverlayLayer(scene, replay, prefix=prefix, trail=trail)
        self._colored = (-1, True)
        self._target: TargetMark | None = None
        if replay.target is None:  # what there is already
            self._add_walls(replay.walls)

    def place_world(self) -> bool:
        """Put up target and walls as soon as they are known; return whether that was now."""
        if self._target is not None or self.replay.target is None:
            return False
        self._target = TargetMark(self._scene, self.replay.target, prefix=self._prefix)
        self._add_walls(self.replay.walls)
        return True

    def compute(self, moment: float, overlays: Overlays) -> Drawing:
        """Return what ``show`` takes of a moment: whatever takes time, to be done while messages flow."""
        return self._drawn.at(moment, tension=overlays.tension)

    def show(self, index: int, drawing: Drawing, overlays: Overlays, facing: np.ndarray) -> None:
        """Draw a moment; call it within ``client.atomic``, so that it arrives as one.

        Args:
            index: of the recorded frame that is nearest.
            drawing: of the moment, by ``compute``.
            overlays: what else to draw.
            facing: (2, 3) directions that are right and up on the screen, below the node of ``prefix``.
        """
        put_arrays(self._rods, batched_positions=drawing.rod_positions, batched_wxyzs=drawing.rod_turns)
        put_arrays(self._nodes, batched_positions=drawing.nodes)
        put_arrays(self._cables, points=drawing.cables)
        if self._fins is not None:
            self._fins.show(drawing)
        self._shadows.show(drawing.centres * (1.0, 1.0, 0.0) + (0.0, 0.0, SHADOW_LIFT))
        if self._target is not None:
            self._target.show(self.replay.frames[index].head)
        colored = (index // COLOR_STEP if overlays.tension else 0, overlays.tension)
        if colored != self._colored:
            self._cables.colors = theme.linear(drawing.cable_colors)
        self._colored = colored
        self._layer.show(index, drawing.centres, overlays, facing)

    def face(self, overlays: Overlays, facing: np.ndarray) -> None:
        """Turn the numbers of the modules to a camera that has turned."""
        self._layer.face(overlays, facing)

    def remove(self) -> None:
        """Take everything away."""
        for handle in self._handles:
            handle.remove()
        self._handles = []
        if self._fins is not None:
            self._fins.remove()
        self._shadows.remove()
        if self._target is not None:
            self._target.remove()
        self._layer.remove()

    def _add_walls(self, walls: Sequence[Wall]) -> None:
        """Draw walls as glass with bright edges, through which the robot stays visible."""
        edges = []
        for k, wall in enumerate(w for w in walls if not w.is_buried):
            turn = Rotation.from_euler("z", wall.yaw)
            half = np.array(wall.half_size)
            self._handles.append(
                self._scene.add_box(
                    f"{self._prefix}/walls/{k}",
                    color=theme.WALL,
                    dimensions=tuple(2.0 * half),
                    opacity=WALL_OPACITY,
                    side="front",
                    cast_shadow=False,
                    wxyz=turn.as_quat(scalar_first=True),
                    position=wall.centre,
                )
            )
            edges.append(turn.apply(BOX_EDGES.reshape(-1, 3) * half) + wall.centre)
        if edges:
            points = np.concatenate(edges).reshape(-1, 2, 3).astype(np.float32)
            self._handles.append(
                self._scene.add_line_segments(
                    f"{self._prefix}/walls/edges", points, theme.WALL_EDGE, thickness=0.002
                )
            )
