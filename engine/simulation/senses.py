"""What a controller is told of what its robot senses, and where its servos stand: late, noisy, slow.

The kernel has both inside its loop; here they are for robots that MuJoCo simulates.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from engine.simulation.built import Built
from engine.simulation.physics import Physics
from engine.tasks import Task


def blur_of(task: Task, built: Built) -> np.ndarray:
    """Return the (inputs,) standard deviations of what a network is told, in its own units.

    An input is a length if its name says ``dist``, an angle if it says ``bear``; others have no noise.
    """
    found = []
    for name, unit in zip(task.inputs, task.units, strict=True):
        noise = 0.0
        if "dist" in name:
            noise = built.position_noise
        elif "bear" in name:
            noise = math.radians(built.heading_noise)
        found.append(noise * unit)
    return np.array(found)


class Messages:
    """What the controllers of some trials are told.

    Args:
        task: which inputs there are.
        physics: how late and how noisy, and the time between two of them.
        seeds: per robot and copy the seed of its noise.
    """

    def __init__(self, task: Task, physics: Physics, seeds: Sequence[Sequence[Sequence[int]]]) -> None:
        self._blur = blur_of(task, physics.built)
        self._delay = round(physics.built.sensing_delay / physics.control_period)
        self._sent: list[np.ndarray] = []
        # a stream of its own leaves the noise of the cables as it is
        self._streams = [[np.random.default_rng([*s, 1]) for s in row] for row in seeds]

    def told(self, sensed: np.ndarray) -> np.ndarray:
        """Return what is told at this control update; both are (robots, copies, inputs)."""
        if self._delay:
            self._sent = self._sent or [sensed] * self._delay
            self._sent.append(sensed)
            sensed = self._sent.pop(0)
        if not self._blur.any():
            return sensed
        draws = [[g.normal(size=len(self._blur)) for g in row] for row in self._streams]
        return np.asarray(sensed + self._blur * np.array(draws))


class ServoAngles:
    """Where the servos of some robots stand, in degrees; at 0 in the beginning.

    Args:
        physics: how fast they turn, and the time between two commands.
        shape: of the commands.
    """

    def __init__(self, physics: Physics, shape: tuple[int, ...]) -> None:
        self._step = physics.built.servo_rate * physics.control_period or math.inf
        self._dead_band = physics.built.dead_band
        self._follows = physics.built.servo_rate > 0.0 or self._dead_band > 0.0
        self._stands = np.zeros(shape)

    def after(self, command: np.ndarray) -> np.ndarray:
        """Return where they stand after a control period with these commands in degrees."""
        if not self._follows:
            return command
        off = np.clip(command, 0.0, 180.0) - self._stands
        self._stands = self._stands + np.where(
            np.abs(off) > self._dead_band, np.clip(off, -self._step, self._step), 0.0
        )
        return self._stands
