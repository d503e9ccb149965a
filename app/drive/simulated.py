"""A simulated robot as it would be built, with the sketch that its board would have.

The sketch is compiled for this computer and speaks through a pseudo-terminal, so that a host cannot tell it
from a board at a serial port. Time passes when the robot is looked at: two control updates for each picture.
"""

from __future__ import annotations

import contextlib
import io
import os
import tempfile
import time
from collections import deque
from pathlib import Path
from typing import Final

import numpy as np
from PIL import Image, ImageDraw

from app.drive.eyes import HeadPose, Seen
from engine.body import module as t
from engine.body.kinematics import points_on
from engine.config import RunConfig, task_of
from engine.errors import InvalidData
from engine.fabrication.firmware import CONTRACTED_PULSE, RELEASED_PULSE, firmware_files
from engine.fabrication.firmware.host_board import HostBoard, compile_board
from engine.simulation.batch import SimulationBatch
from engine.simulation.evaluation import Evaluation
from engine.simulation.model import with_walls
from engine.simulation.physics import Physics
from engine.simulation.rollout import Head, HeadSensor, Servos, build_robots, settle
from engine.simulation.trials import trials_of
from engine.tasks import GroundFrame
from viz.robot.head_paths import wall_corners

UPDATES: Final = 2
"""Control updates between two pictures: 25 pictures a second."""
AROUND: Final = 0.75
"""Metres to each side of the start that the picture shows."""
WIDE: Final = 720
"""Pixels of the picture's sides."""
_GROUND, _WALL, _ROD, _HEAD, _TARGET = "#202b36", "#48586a", "#9fb3c8", "#1e96eb", "#fa8c1e"
_END_RODS: Final = np.repeat(np.arange(len(t.RODS)), 2)
_ENDS: Final = np.array([t.NODES[n] - t.ROD_MIDDLES[r] for r, ends in enumerate(t.RODS) for n in ends])


class SimulatedRobot:
    """What ``eyes.Eyes`` asks for, and a port for a host; to be closed.

    Args:
        config: of the run that the evaluation belongs to.
        evaluation: of the robot.
        physics: of the robot as it would be built; MuJoCo simulates it.
        target: index of the task's target, from 0.
        run: name of the run.
        speed: seconds of the robot in a second; 0 for as many as there can be.

    Raises:
        InvalidData: there is no such target, compiler or pseudo-terminal, or MuJoCo knows no such robot.
    """

    def __init__(
        self,
        config: RunConfig,
        evaluation: Evaluation,
        physics: Physics,
        *,
        target: int = 0,
        run: str = "",
        speed: float = 1.0,
    ) -> None:
        task, body = task_of(config), evaluation.solution.morphology
        if not 0 <= target < task.n_targets:
            raise InvalidData(f"target must be from 1 to {task.n_targets}, not {target + 1}")
        if body.feet != "none":
            raise InvalidData("MuJoCo knows no directional feet; drive a robot without them")
        with contextlib.ExitStack() as stack:
            self.port, self._terminal = _terminal(stack)
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="tensatlas-")))
            files = firmware_files(config, evaluation, run=run, as_built=physics)
            self._board = stack.enter_context(HostBoard(compile_board(files, folder), body.n_modules))
            self._to_host(self._board.greeting)
            self._open = stack.pop_all()
        self._physics, self._speed = physics, speed
        robots = build_robots([body], physics)
        settled = settle(robots, physics=physics, duration=config.trials.settle_time)
        head = Head.of(body, evaluation.head_is_end)
        self._sensor = HeadSensor([head])
        frame = GroundFrame.of(*self._sensor.faces(settled))
        trial = trials_of(task, body.n_modules, config.trials.repeats)[target * config.trials.repeats]
        self._target = frame.to_world(trial.offset[None, None])[0, 0]
        self._walls = walls = frame.place(0, trial.walls)
        self._sim = SimulationBatch(
            robots,
            copies=1,
            physics=physics,
            n_threads=1,
            models=[with_walls(robots[0], walls)] if walls else None,
        )
        self._sim.branch(settled)
        self._servos = Servos(physics, (1, 1, body.n_modules))
        self._noise = np.random.default_rng([config.seed, evaluation.solution.number, target])
        self._middle = self._pose().position
        # what is told is so many updates old
        delay = round(physics.built.sensing_delay / physics.control_period)
        self._past = deque([self._pose()] * (delay + 1), maxlen=delay + 1)
        self._updates = 0
        self._began = time.monotonic()

    def look(self) -> Seen:
        """Let two control updates pass and return what a camera would see.

        Raises:
            InvalidData: the simulation has failed.
        """
        for _ in range(UPDATES):
            self._update()
        seconds = self._updates * self._physics.control_period
        if self._speed > 0.0:
            time.sleep(max(0.0, self._began + seconds / self._speed - time.monotonic()))
        built, old = self._physics.built, self._past[0]
        dx, dy, turn = self._noise.normal(size=3)
        head = HeadPose(
            old.x + built.position_noise * dx,
            old.y + built.position_noise * dy,
            old.direction + np.radians(built.heading_noise) * turn,
        )
        return Seen(seconds, head, self._target.copy(), self._picture)

    def close(self) -> None:
        """End the board's program and the pseudo-terminal."""
        self._open.close()

    @property
    def distance(self) -> float:
        """How far the head really is from the target, in m."""
        return float(np.linalg.norm(self._pose().position - self._target))

    def _update(self) -> None:
        received = b""
        with contextlib.suppress(BlockingIOError):
            received = os.read(self._terminal, 65536)
        milliseconds = round(1000 * self._physics.control_period)
        self._to_host(self._board.advance(milliseconds, received))
        command = 180.0 * (self._board.pulses - RELEASED_PULSE) / (CONTRACTED_PULSE - RELEASED_PULSE)
        lengths = self._servos.lengths(command[None, None])
        noise = self._noise.normal(size=lengths.shape) * self._physics.servo_noise
        self._sim.step(lengths + noise)
        if (failure := self._sim.failures[0]) is not None:
            raise InvalidData(f"the simulated robot {failure}")
        self._past.append(self._pose())
        self._updates += 1

    def _pose(self) -> HeadPose:
        front, rear = (face[0, 0] for face in self._sensor.faces(self._sim))
        ahead = front - rear
        return HeadPose(float(front[0]), float(front[1]), float(np.arctan2(ahead[1], ahead[0])))

    def _to_host(self, printed: bytes) -> None:
        # a host that does not read must not stop the robot
        with contextlib.suppress(BlockingIOError):
            os.write(self._terminal, printed)

    def _picture(self) -> bytes:
        """Draw the robot from above, as a camera at rest sees it."""
        picture = Image.new("RGB", (WIDE, WIDE), _GROUND)
        draw = ImageDraw.Draw(picture)

        def at(points: np.ndarray) -> list[tuple[float, float]]:
            seen = (points[..., :2] - self._middle) * np.array([1.0, -1.0]) * (WIDE / 2 / AROUND) + WIDE / 2
            return [(float(x), float(y)) for x, y in seen]

        for wall in self._walls:
            draw.polygon(at(wall_corners(wall)), fill=_WALL)
        pose_of_rods = self._sim.qpos[0, 0].reshape(-1, len(t.RODS), 7)
        for ends in points_on(pose_of_rods, _END_RODS, _ENDS).reshape(-1, 2, 3):
            draw.line(at(ends), fill=_ROD, width=3)
        pose = self._pose()
        ahead = np.stack([pose.position, pose.position + 0.06 * pose.facing])
        draw.line(at(ahead), fill=_HEAD, width=6)
        for place, color in ((pose.position, _HEAD), (self._target, _TARGET)):
            ((x, y),) = at(place[None])
            draw.ellipse((x - 7, y - 7, x + 7, y + 7), outline=color, width=3)
        content = io.BytesIO()
        picture.save(content, "JPEG", quality=80)
        return content.getvalue()


def _terminal(stack: contextlib.ExitStack) -> tuple[str, int]:
    """Open a pseudo-terminal; return the name of the host's end, and the board's.

    Raises:
        InvalidData: this system has none.
    """
    try:
        import pty
        import tty
    except ImportError:
        raise InvalidData("--simulate needs a pseudo-terminal, which this system does not have") from None
    board, host = pty.openpty()
    stack.callback(os.close, board)
    # open as long as the board: it would read an error once no host has it open
    stack.callback(os.close, host)
    tty.setraw(host)
    os.set_blocking(board, False)
    return os.ttyname(host), board
