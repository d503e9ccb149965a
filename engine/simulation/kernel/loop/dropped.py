"""A robot from the drop to where its trials begin: it settles, and shows which end is its head.

All lanes hold the same simulation: what depends on a robot's links is the same for a whole vector, so that
different robots cannot share one. A step takes hardly longer with eight lanes than with one, and code for
another width would have to be compiled.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from engine.simulation.kernel.lanes.simd import by_lane, width_of
from engine.simulation.kernel.loop.closed_loop import begin, run
from engine.simulation.kernel.loop.sensing import PYTHON, make_scene
from engine.simulation.kernel.loop.setup import (
    NOTHING,
    OPEN_LOOP,
    RELEASED,
    HeadOf,
    Loop,
    Recording,
    head_rods,
    make_loop,
    make_recording,
)
from engine.simulation.kernel.physics.parameters import Model
from engine.simulation.kernel.physics.state import KEPT, ROD, State, forget, new_state
from engine.simulation.physics import Physics


class Dropped:
    """A robot that has been dropped, in every lane the same.

    Args:
        model: the robot.
        poses: (rods, 7) centres in m and quaternions as built, above the ground.
        end: the head that the robot has if it is the end of its chain.
        rhythms: per module the command that it has while the head is searched, as ``servos`` numbers them.
        physics: time step and control period.
        width: lanes of a vector.
    """

    def __init__(
        self,
        model: Model,
        poses: np.ndarray,
        *,
        end: HeadOf,
        rhythms: Sequence[int],
        physics: Physics,
        width: int,
    ) -> None:
        self.model = model
        self.state = new_state(model, width=width)
        by_lane(self.state.rods).reshape(-1, ROD, width)[:, :7] = poses[..., None]
        forget(self.state)
        self.n_updates = 0
        """Control updates since the drop."""
        self.failed_at = 0
        """Control updates from the drop to the failure of the simulation, or 0."""
        self._end = end
        self._rhythms = rhythms
        self._physics = physics

    @property
    def failure(self) -> int:
        """Why the simulation was stopped, one of ``guard``'s codes, or 0."""
        return int(by_lane(self.state.failed)[0, 0])

    def settle(self, n_updates: int, record: frozenset[str] = NOTHING) -> Recording:
        """Let the robot come to rest for some control updates, servos off; return a recording of one lane."""
        loop = self._loop(RELEASED)
        recording = make_recording(self.model, loop, n_updates, record, n_trials=1)
        run(self.model, self.state, loop, recording, n_updates)
        self.n_updates += n_updates
        self.failed_at = self.failed_at or int(by_lane(loop.failed_at)[0, 0])
        return recording

    def goes_end_first(self, duration: float) -> tuple[bool, int]:
        """Find which end goes first when the modules keep their rhythms for some seconds; the robot stays.

        The end of the chain is the head unless the rear face of its module has by then crossed, backwards,
        the line through its own starting point, perpendicular to the robot.

        Returns:
            Whether the end is the head, and why the simulation was stopped, one of ``guard``'s codes, or 0.
        """
        state, loop = self._pulsing()
        x, y, rear_x, rear_y = by_lane(loop.scene.faces)[:, 0].tolist()
        n = round(duration / self._physics.control_period)
        run(self.model, state, loop, make_recording(self.model, loop, n, NOTHING, n_trials=1), n)
        now_x, now_y = by_lane(loop.scene.faces)[2:, 0].tolist()
        moved = (now_x - rear_x) * (x - rear_x) + (now_y - rear_y) * (y - rear_y)
        return moved >= 0.0, int(by_lane(state.failed)[0, 0])

    def pulse(self, n_updates: int, record: frozenset[str] = NOTHING) -> tuple[State, Loop, Recording]:
        """Let a copy of the robot pulse as in the search for its head; the robot stays.

        Returns:
            The copy, what drove it and what was recorded, after ``n_updates`` control updates.
        """
        state, loop = self._pulsing()
        recording = make_recording(self.model, loop, n_updates, record, n_trials=1)
        run(self.model, state, loop, recording, n_updates)
        return state, loop, recording

    def _pulsing(self) -> tuple[State, Loop]:
        """Return a copy of the robot about to pulse, and what drives it."""
        state = new_state(self.model, width=width_of(self.state.rods))
        branch(state, self.state, 0)
        loop = self._loop(OPEN_LOOP)
        begin(state, loop)
        return state, loop

    def _loop(self, drive: int) -> Loop:
        width = width_of(self.state.rods)
        scene = make_scene(
            PYTHON, units=(), head=head_rods(self._end), targets=np.zeros((width, 2)), walls=[()] * width
        )
        loop = make_loop(
            self.model,
            scene,
            self._physics,
            drive=drive,
            start=self.n_updates,
            width=width,
            head=self._end,
        )
        by_lane(loop.servos.choice)[:] = np.array(self._rhythms)[:, None]
        return loop


def branch(state: State, settled: State, lane: int) -> None:
    """Copy one simulation of a world without walls to all lanes of one that may have some."""
    for field in (*KEPT, "failed"):
        # forces of the walls' contacts come after those of the ground's
        source = by_lane(getattr(settled, field))[:, lane]
        by_lane(getattr(state, field))[: len(source)] = source[:, None]
    forget(state)
