"""The 3D scene of one browser: ground, target, walls, robot, the trail of its head."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Sequence

import numpy as np
import trimesh
import viser
from scipy.spatial.transform import Rotation

from app.marks import MarkLayer, Marks
from engine.replay import Playable
from engine.tensegrity import ROD_LENGTH
from engine.walls import Wall
from viz import theme
from viz.robot_geometry import ROD_DRAWN_RADIUS, RobotGeometry

TARGET_RADIUS = 0.02
TARGET_HEIGHT = 0.06
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
CAMERA_PATIENCE = 5.0
"""Seconds to wait for a browser to say that its camera is where it was placed."""
EYE = np.array([-0.55, -0.9, 0.75])
"""Where the camera is, for a size of 1 m, relative to what it looks at."""
EYE_BEHIND = np.array([-0.8, -0.35, 0.95])
"""The same with the way to the target along x."""
COLOR_STEP = 3
"""Frames between two colours of the cables: they change slowly, and are a seventh of what a frame takes."""
FOLLOW_STEP = 0.002
"""Metres that the robot moves before a following camera moves with it."""


class Arena:
    """Draws one replay at a time.

    Args:
        client: whose scene it is.
    """

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._scene = client.scene
        self._replay: Playable | None = None
        self._geometry: RobotGeometry | None = None
        self._handles: list[viser.SceneNodeHandle] = []
        self._layer: MarkLayer | None = None
        self._drawing = threading.Lock()
        self._has_target = False
        self._placed: tuple[np.ndarray, float, float] | None = None
        self.follow = True
        self.marks = Marks()
        """Which marks the next frame has."""
        self._colored: tuple[int, bool] = (0, True)
        self._scene.set_up_direction("+z")
        self._scene.add_grid(
            "/ground",
            infinite_grid=True,
            cell_size=0.05,
            section_size=0.25,
            cell_color=(62, 68, 78),
            section_color=(92, 100, 112),
            plane_color=(32, 36, 42),
            plane_opacity=0.6,
            fade_distance=3.0,
            shadow_opacity=0.35,
        )
        client.camera.on_update(lambda _camera: self._face())

    def look_at(self, centre: np.ndarray, size: float, eye: np.ndarray = EYE) -> None:
        """Look at a point of the ground from a distance that shows so many metres around it.

        Args:
            centre: (2,) the point, in m.
            size: how much to show, in m.
            eye: (3,) where to look from, relative to the point and to the size.
        """
        camera = self._client.camera
        away = max(size, 0.3)
        nearer = 0.08 * away * eye[:2] / np.linalg.norm(eye[:2])
        with self._client.atomic():
            camera.position = (centre[0] + eye[0] * away, centre[1] + eye[1] * away, eye[2] * away)
            # a little in front of it, because a panel covers the lower edge
            camera.look_at = (float(centre[0] + nearer[0]), float(centre[1] + nearer[1]), 0.0)
        self._placed = (np.array(camera.position), camera.update_timestamp, time.monotonic())

    def show(self, replay: Playable, index: int) -> None:
        """Draw a frame of a replay; another replay than the last one replaces the robot."""
        with self._drawing:
            self._show(replay, index)

    def clear(self) -> None:
        """Remove the robot."""
        with self._drawing:
            self._clear()

    def _show(self, replay: Playable, index: int) -> None:
        frame, marks = replay.frames[index], self.marks
        if replay is not self._replay:
            self._begin(replay, frame.pose)
        assert self._geometry is not None
        assert self._layer is not None
        drawing = self._geometry.draw(frame.pose, frame.lengths, tension=marks.tension)
        centre = frame.pose[..., :3].mean(axis=(0, 1))
        if not self._has_target and replay.target is not None:
            self._add_target(replay.target)
            self._add_walls(replay.walls)
            self._frame(centre[:2], replay.target, among_walls=bool(replay.walls))
        colored = (index // COLOR_STEP if marks.tension else 0, marks.tension)
        with self._client.atomic():
            self._rods.batched_positions = drawing.rod_positions
            self._rods.batched_wxyzs = drawing.rod_turns
            self._nodes.batched_positions = drawing.nodes
            self._cables.points = drawing.cables
            if colored != self._colored:
                self._cables.colors = drawing.cable_colors
            self._layer.show(index, marks, self._facing())
        self._colored = colored
        if self.follow:
            self._follow(centre)
        else:
            self._followed = centre[:2]

    def _face(self) -> None:
        """Keep the numbers of the modules turned to the camera, also while nothing is played."""
        with self._drawing:
            if self._layer is not None:
                self._layer.face(self.marks, self._facing())

    def _facing(self) -> np.ndarray:
        """Return the (2, 3) directions in the world that are right and up on the screen."""
        turn = Rotation.from_quat(np.asarray(self._client.camera.wxyz), scalar_first=True)
        return turn.apply([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])

    def _clear(self) -> None:
        for handle in self._handles:
            handle.remove()
        if self._layer is not None:
            self._layer.remove()
        self._handles, self._layer = [], None
        self._replay = None

    def _begin(self, replay: Playable, pose: np.ndarray) -> None:
        self._clear()
        geometry = RobotGeometry(replay.morphology, replay.head.module)
        drawing = geometry.draw(pose, np.ones((geometry.n_modules, 5)))
        cylinder = trimesh.creation.cylinder(radius=1.0, height=1.0, sections=12)
        sphere = trimesh.creation.icosphere(subdivisions=1)
        n_rods = len(drawing.rod_positions)
        self._rods = self._scene.add_batched_meshes_simple(
            "/robot/rods",
            cylinder.vertices,
            cylinder.faces,
            batched_wxyzs=drawing.rod_turns,
            batched_positions=drawing.rod_positions,
            batched_scales=np.tile([ROD_DRAWN_RADIUS, ROD_DRAWN_RADIUS, ROD_LENGTH], (n_rods, 1)),
            batched_colors=_linear(geometry.rod_colors),
            lod="off",
        )
        self._nodes = self._scene.add_batched_meshes_simple(
            "/robot/nodes",
            sphere.vertices,
            sphere.faces,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(drawing.nodes), 1)),
            batched_positions=drawing.nodes,
            batched_scales=geometry.node_radii,
            batched_colors=_linear(geometry.node_colors),
            lod="off",
        )
        self._cables = self._scene.add_line_segments(
            "/robot/cables", drawing.cables, drawing.cable_colors, thickness=0.0012
        )
        self._handles = [self._rods, self._nodes, self._cables]
        self._layer = MarkLayer(self._scene, replay)
        self._replay, self._geometry, self._has_target = replay, geometry, False
        self._colored = (-1, True)
        if replay.target is None:  # what there is already
            self._add_walls(replay.walls)
        self._followed = pose[..., :2].mean(axis=(0, 1))
        self.look_at(self._followed, np.ptp(pose[..., :2], axis=(0, 1)).max() + 0.3)

    def _frame(self, robot: np.ndarray, target: np.ndarray, *, among_walls: bool) -> None:
        """Show the robot and its target; among walls from behind the robot, so that none hides the way."""
        self._followed = robot
        way = target - robot
        size = 1.05 * float(np.linalg.norm(way)) + 0.2
        eye = EYE
        if among_walls:
            x, y = way / np.linalg.norm(way)
            eye = np.array([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]]) @ EYE_BEHIND
        self.look_at((robot + target) / 2, size, eye)

    def _add_target(self, target: np.ndarray) -> None:
        post = self._scene.add_cylinder(
            "/target/post",
            radius=TARGET_RADIUS,
            height=TARGET_HEIGHT,
            color=theme.TARGET,
            opacity=0.55,
            position=(float(target[0]), float(target[1]), TARGET_HEIGHT / 2),
        )
        self._handles.append(post)
        self._has_target = True

    def _add_walls(self, walls: Sequence[Wall]) -> None:
        """Draw walls as glass with bright edges, through which the robot stays visible."""
        edges = []
        for k, wall in enumerate(w for w in walls if not w.is_buried):
            turn = Rotation.from_euler("z", wall.yaw)
            half = np.array(wall.half_size)
            self._handles.append(
                self._scene.add_box(
                    f"/walls/{k}",
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
                self._scene.add_line_segments("/walls/edges", points, theme.WALL_EDGE, thickness=0.002)
            )

    def _follow(self, centre: np.ndarray) -> None:
        """Move the camera as the robot moves; how the user turned and zoomed it stays."""
        if not self._camera_has_arrived():
            return
        step = centre[:2] - self._followed
        if np.hypot(*step) < FOLLOW_STEP:
            return
        self._followed = centre[:2]
        # what the camera looks at moves along with its position
        self._client.camera.position = self._client.camera.position + np.array([*step, 0.0])

    def _camera_has_arrived(self) -> bool:
        """Tell whether the browser has taken the camera where it was last placed.

        What a busy browser reports in the meantime is where its camera was before; a step from there
        would take the camera back.
        """
        if self._placed is not None:
            (position, placed, since), camera = self._placed, self._client.camera
            reported = camera.update_timestamp != placed
            arrived = reported and np.allclose(camera.position, position, rtol=0.0, atol=0.01)
            if arrived or time.monotonic() - since > CAMERA_PATIENCE:
                self._placed = None
        return self._placed is None


def _linear(colors: np.ndarray) -> np.ndarray:
    """Return sRGB colours as the linear ones that batched meshes take, (n, 3) uint8."""
    part = colors / 255.0
    linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return np.round(255.0 * linear).astype(np.uint8)
