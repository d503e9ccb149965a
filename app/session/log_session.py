"""One browser that looks at the log of a drive, beside a simulation of the robot as it would be built."""

from __future__ import annotations

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from app.drive.log import Driven
from app.drive.path import MeasuredPath
from app.gui.lanes import Lane
from app.replay.player import ReplayMoment
from app.session.lone_replay import LoneReplaySession
from engine.config import RunConfig
from engine.replay.replay import Replay
from engine.simulation.evaluation import Evaluation
from viz import theme
from viz.robot import robot_card

COLOR = theme.LANES[1]
"""Of what was measured; the simulated trail has that of every trail."""
LIFT = 0.004
"""Metres above the ground at which the measured path is drawn."""
THICKNESS = 0.002
RADIUS = 0.009
"""In m, of the ball at the measured head."""


class LogSession(LoneReplaySession):
    """Plays a simulation and draws what was measured into it.

    Args:
        client: the browser.
        driven: which robot was driven.
        path: of its head.
        config: of its run, with the physics of the robot as it would be built.
        evaluation: of the robot.
        materials: what it is simulated to be built from.
        simulating: lane of the browser for its replay.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        driven: Driven,
        path: MeasuredPath,
        config: RunConfig,
        evaluation: Evaluation,
        materials: str,
        simulating: Lane,
    ) -> None:
        self._client, self._path = client, path
        self._replay = Replay(config, evaluation, aim=path.aim)
        self._head: viser.IcosphereHandle | None = None
        facts = {
            "run": driven.run or "not named",
            "driven": "a simulated robot" if driven.simulated else "a robot that was built",
            "target": path.aim.name,
            "head": f"from {100 * path.before:.1f} to {100 * path.after:.1f} cm from the target",
            "measured": f"{max(path.times[-1], 0.0):.1f} s, the orange path",
            "simulated": f"as built of {materials}, the pink path",
        }
        card = robot_card.render_drive(driven.robot, facts)
        super().__init__(client, "A drive and its simulation", card, self._replay, simulating)

    def _show(self, moment: ReplayMoment) -> None:
        super()._show(moment)
        if self._head is None:
            self._head = self._drawn()
        if self._head is not None:
            x, y = map(float, self._path.at(moment.time))
            self._head.position = (x, y, LIFT)

    def _drawn(self) -> viser.IcosphereHandle | None:
        """Draw what was measured, as seen from where the simulated head begins; None before that is known."""
        target = self._replay.target
        start = next((f.head for f in self._replay.frames if f.time >= 0.0), None)
        if target is None or start is None:
            return None
        scene, places = self._client.scene, self._path.places
        scene.add_frame(
            "/measured",
            show_axes=False,
            wxyz=Rotation.from_euler("z", self._path.turn(start, target)).as_quat(scalar_first=True),
            position=(float(start[0]), float(start[1]), 0.0),
        )
        points = np.column_stack([places, np.full(len(places), LIFT)]).astype(np.float32)
        if len(points) > 1:
            lines = np.stack([points[:-1], points[1:]], axis=1)
            scene.add_line_segments("/measured/path", lines, COLOR, thickness=THICKNESS)
        return scene.add_icosphere("/measured/head", radius=RADIUS, color=COLOR, cast_shadow=False)
