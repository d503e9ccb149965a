"""Robots side by side in the 3D scene: one lane each, the start behind, the target ahead."""

from __future__ import annotations

import dataclasses
import itertools
import threading
from collections.abc import Sequence

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from app.replay.overlays import Overlays
from app.replay.robot_drawing import RobotDrawing
from app.replay.scene_camera import Framing, SceneCamera
from app.replay.side_by_side import LaneStart, SideBySideReplay
from engine.replay.replay import Replay
from engine.tasks.walls import Wall
from viz import theme
from viz.robot.geometry import Drawing

GAP = 0.12
"""Metres between two lanes."""
REACH = 0.9
"""Metres to the sides of a lane's middle that walls may make it wider by; the rest of them overlaps."""
LINE_HEIGHT = 0.001
EYE = np.array([-0.75, -0.12, 0.9])
"""Direction to the camera: behind the start, a little aside."""
NAME_ROOM = 0.18
"""Metres behind the robots for the names of the lanes."""


@dataclasses.dataclass(frozen=True, slots=True)
class Lane:
    """Where a lane lies in the scene, its start on the y axis, its target ahead along x; in m.

    Attributes:
        start: of its trial in its own world.
        offset: y of its start.
        left, right: largest and smallest y of the lane.
        back: x where its robot ends.
    """

    start: LaneStart
    offset: float
    left: float
    right: float
    back: float

    @property
    def turn(self) -> Rotation:
        """From its own world to the scene."""
        return Rotation.from_euler("z", -self.start.yaw)

    @property
    def position(self) -> np.ndarray:
        """(3,) of its own world's origin in the scene."""
        head = self.turn.apply([*self.start.head, 0.0])
        return np.array([0.0, self.offset, 0.0]) - head


@dataclasses.dataclass(frozen=True, slots=True)
class DrawnLane:
    """A lane as it was drawn at a moment.

    Attributes:
        number: of the lane in its replay, from 0; one whose robot did not survive settling is not drawn.
        lane: where it lies.
        index: of the recorded frame that is nearest.
        drawing: the robot, in its own world.
    """

    number: int
    lane: Lane
    index: int
    drawing: Drawing


def lay_out(replays: Sequence[Replay], starts: Sequence[LaneStart]) -> list[Lane]:
    """Return lanes from left to right, each as wide as what stands or lies in it at the start."""
    lanes: list[Lane] = []
    edge = 0.0
    for replay, start in zip(replays, starts, strict=True):
        first = next((f for f in replay.frames if f.time >= 0.0), replay.frames[-1])
        body = start.from_world(first.pose[..., :2].reshape(-1, 2).astype(float))
        corners = [start.from_world(_corners(w)) for w in replay.walls if not w.is_buried]
        sides = np.concatenate(
            [body[:, 1], [-0.05, 0.05], *[np.clip(c[:, 1], -REACH, REACH) for c in corners]]
        )
        left, right = float(sides.max()) + GAP / 2, float(sides.min()) - GAP / 2
        offset = edge - left
        lanes.append(Lane(start, offset, edge, offset + right, float(min(body[:, 0].min(), 0.0))))
        edge = offset + right
    middle = edge / 2
    return [
        dataclasses.replace(
            lane, offset=lane.offset - middle, left=lane.left - middle, right=lane.right - middle
        )
        for lane in lanes
    ]


def _corners(wall: Wall) -> np.ndarray:
    """Return the (4, 2) corners of a wall as seen from above, in m."""
    half = np.array([(x, y, 0.0) for x in (-1, 1) for y in (-1, 1)]) * np.array(wall.half_size)
    return Rotation.from_euler("z", wall.yaw).apply(half)[:, :2] + np.array(wall.centre[:2])


class SideBySideScene:
    """Draws a ``SideBySideReplay``.

    Args:
        client: whose scene it is.
        camera: of it.
    """

    def __init__(self, client: viser.ClientHandle, camera: SceneCamera) -> None:
        self._client, self._camera = client, camera
        self._mutex = threading.Lock()
        self._replay: SideBySideReplay | None = None
        self._lanes: list[Lane] = []
        self._numbers: list[int] = []
        self._drawings: list[RobotDrawing] = []
        self._handles: list[viser.SceneNodeHandle] = []
        self._framing: Framing | None = None
        self.drawn: list[DrawnLane] = []
        """What was drawn last."""

    def look(self) -> bool:
        """Look at all lanes again, if there are any; return whether there are."""
        with self._mutex:
            if self._replay is None or self._framing is None:
                return False
            self._camera.show(self._framing)
            return True

    def show(self, replay: SideBySideReplay, moment: float, overlays: Overlays) -> None:
        """Draw a moment of all lanes, in s of their clock; other lanes than the last ones replace those."""
        with self._mutex:
            if replay is not self._replay:
                self._begin(replay)
            facing = self._camera.facing
            indices = [replay.frame_index(k, moment) for k in self._numbers]
            drawings = [d.compute(moment, overlays) for d in self._drawings]
            with self._client.atomic():
                for robot, lane, i, drawing in zip(
                    self._drawings, self._lanes, indices, drawings, strict=True
                ):
                    robot.show(i, drawing, overlays, lane.turn.inv().apply(facing))
            self.drawn = [
                DrawnLane(*drawn) for drawn in zip(self._numbers, self._lanes, indices, drawings, strict=True)
            ]

    def clear(self) -> None:
        """Remove all lanes."""
        with self._mutex:
            self._clear()

    def _clear(self) -> None:
        for drawing in self._drawings:
            drawing.remove()
        for handle in reversed(self._handles):
            handle.remove()
        self._drawings, self._handles, self._lanes, self._replay = [], [], [], None
        self._numbers, self.drawn = [], []

    def _begin(self, replay: SideBySideReplay) -> None:
        self._clear()
        settled = [(k, s) for k in range(len(replay.lanes)) if (s := replay.start(k)) is not None]
        self._numbers = [k for k, _ in settled]
        replays = [replay.lanes[k] for k in self._numbers]
        self._lanes = lay_out(replays, [s for _, s in settled])
        scene = self._client.scene
        for (k, _), lane, robot in zip(settled, self._lanes, replays, strict=True):
            self._handles.append(
                scene.add_frame(
                    f"/lanes/{k}",
                    show_axes=False,
                    wxyz=lane.turn.as_quat(scalar_first=True),
                    position=lane.position,
                )
            )
            drawing = RobotDrawing(scene, robot, prefix=f"/lanes/{k}", trail=theme.LANES[k])
            drawing.place_world()
            self._drawings.append(drawing)
            self._handles.append(
                scene.add_label(
                    f"/lanes/name-{k}",
                    replay.names[k],
                    position=(lane.back - 0.1, (lane.left + lane.right) / 2, 0.0),
                    anchor="center-center",
                )
            )
        if self._lanes:
            self._draw_lines()
            back, ahead = min(n.back for n in self._lanes), max(n.start.distance for n in self._lanes)
            ends = (back - NAME_ROOM, ahead + 0.1), (self._lanes[-1].right, self._lanes[0].left), (0.0, 0.1)
            self._framing = Framing(np.array(list(itertools.product(*ends))), EYE)
            self._camera.show(self._framing)
        self._replay = replay

    def _draw_lines(self) -> None:
        """Draw the borders of the lanes, and where each starts and ends."""
        back = min(lane.back for lane in self._lanes) - 0.04
        ahead = max(lane.start.distance for lane in self._lanes) + 0.08
        borders = [self._lanes[0].left, *[lane.right for lane in self._lanes]]
        lines = [((back, y), (ahead, y)) for y in borders]
        for lane in self._lanes:
            lines += [((x, lane.left), (x, lane.right)) for x in (0.0, lane.start.distance)]
        points = np.array([[(*a, LINE_HEIGHT), (*b, LINE_HEIGHT)] for a, b in lines], dtype=np.float32)
        self._handles.append(
            self._client.scene.add_line_segments("/lanes/lines", points, theme.LANE_LINE, thickness=0.002)
        )
