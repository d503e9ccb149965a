"""Robots from the drop to where their trials begin: they settle, and show which end is their head.

Robots of one size share a vector, one per lane.
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
from engine.simulation.kernel.physics.state import KEPT, ROD, State, forget, new_state
from engine.simulation.kernel.robots.model import model_of
from engine.simulation.kernel.robots.parameters import Robot
from engine.simulation.physics import Physics


class Dropped:
    """Robots that have been dropped.

    Args:
        robots: at most as many as there are lanes, of one size. The first has the spare lanes, too.
        poses: (robots, rods, 7) centres in m and quaternions as built, above the ground.
        ends: the head that each robot has if it is the end of its chain.
        rhythms: (robots, modules) the command that each module has while the head is searched, as ``servos``
            numbers them.
        physics: time step and control period.
        width: lanes of a vector.
    """

    def __init__(
        self,
        robots: Sequence[Robot],
        poses: np.ndarray,
        *,
        ends: Sequence[HeadOf],
        rhythms: Sequence[Sequence[int]],
        physics: Physics,
        width: int,
    ) -> None:
        self._n = len(robots)
        of_lane = [k if k < self._n else 0 for k in range(width)]
        self.model = model_of([robots[k] for k in of_lane])
        self.state = new_state(self.model)
        by_lane(self.state.rods).reshape(-1, ROD, width)[:, :7] = poses[of_lane].transpose(1, 2, 0)
        forget(self.state)
        self.n_updates = 0
        """Control updates since the drop."""
        self.failed_at = [0] * self._n
        """Per robot the control updates from the drop to the failure of its simulation, or 0."""
        self._ends = [ends[k] for k in of_lane]
        self._rhythms = np.array([rhythms[k] for k in of_lane])
        self._physics = physics

    @property
    def failures(self) -> list[int]:
        """Per robot why its simulation was stopped, one of ``guard``'s codes, or 0."""
        return _codes(self.state)[: self._n]

    def settle(self, n_updates: int, record: frozenset[str] = NOTHING) -> Recording:
        """Let the robots come to rest for some control updates, servos off."""
        loop = self._loop(RELEASED)
        recording = make_recording(self.model, loop, n_updates, record, n_trials=self._n)
        run(self.model, self.state, loop, recording, n_updates)
        self.n_updates += n_updates
        failed_at = by_lane(loop.failed_at)[0].tolist()
        self.failed_at = [before or now for before, now in zip(self.failed_at, failed_at, strict=False)]
        return recording

    def goes_end_first(self, duration: float) -> list[tuple[bool, int]]:
        """Find which end goes first when the modules keep their rhythms for some seconds; the robots stay.

        The end of the chain is the head unless the rear face of its module has by then crossed, backwards,
        the line through its own starting point, perpendicular to the robot.

        Returns:
            Per robot whether the end is the head, and why the simulation was stopped, one of ``guard``'s
            codes, or 0.
        """
        state, loop = self._pulsing()
        x, y, rear_x, rear_y = by_lane(loop.scene.faces).copy()
        n = round(duration / self._physics.control_period)
        run(self.model, state, loop, make_recording(self.model, loop, n, NOTHING, n_trials=self._n), n)
        now_x, now_y = by_lane(loop.scene.faces)[2:]
        moved = (now_x - rear_x) * (x - rear_x) + (now_y - rear_y) * (y - rear_y)
        return list(zip((moved >= 0.0).tolist(), _codes(state), strict=True))[: self._n]

    def pulse(self, n_updates: int, record: frozenset[str] = NOTHING) -> tuple[State, Loop, Recording]:
        """Let copies of the robots pulse as in the search for their heads; the robots stay.

        Returns:
            The copies, what drove them and what was recorded, after ``n_updates`` control updates.
        """
        state, loop = self._pulsing()
        recording = make_recording(self.model, loop, n_updates, record, n_trials=self._n)
        run(self.model, state, loop, recording, n_updates)
        return state, loop, recording

    def _pulsing(self) -> tuple[State, Loop]:
        """Return copies of the robots about to pulse, and what drives them."""
        state = new_state(self.model)
        for lane in range(width_of(state.rods)):
            branch(state, lane, self.state, lane)
        loop = self._loop(OPEN_LOOP)
        begin(state, loop)
        return state, loop

    def _loop(self, drive: int) -> Loop:
        width = width_of(self.state.rods)
        scene = make_scene(
            PYTHON,
            units=(),
            heads=[head_rods(end) for end in self._ends],
            targets=np.zeros((width, 2)),
            walls=[()] * width,
        )
        loop = make_loop(
            self.model, scene, self._physics, drive=drive, start=self.n_updates, heads=self._ends
        )
        by_lane(loop.servos.choice)[:] = self._rhythms.T
        return loop


def _codes(state: State) -> list[int]:
    codes: list[int] = by_lane(state.failed)[0].tolist()
    return codes


def branch(state: State, lane: int, settled: State, settled_lane: int) -> None:
    """Copy a simulation of a world without walls to a lane of the same robot, whose world may have some."""
    for field in (*KEPT, "failed"):
        # forces of the walls' contacts come after those of the ground's
        source = by_lane(getattr(settled, field))[:, settled_lane]
        by_lane(getattr(state, field))[: len(source), lane] = source
    forget(state)
