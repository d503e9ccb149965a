"""Trials of robots of one size from Python: as many as wanted, side by side in the lanes of vectors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from engine.control.genome import Controller
from engine.simulation.kernel.lanes.simd import by_lane, width_of
from engine.simulation.kernel.loop.closed_loop import begin, run
from engine.simulation.kernel.loop.dropped import branch
from engine.simulation.kernel.loop.sensing import PYTHON, kind_of, make_scene
from engine.simulation.kernel.loop.setup import (
    CONTROLLER,
    NOTHING,
    POSE,
    HeadOf,
    Loop,
    Recording,
    head_rods,
    make_loop,
    make_recording,
)
from engine.simulation.kernel.physics.state import ROD, State, forget, new_state
from engine.simulation.kernel.robots.model import Model, model_of, rods_by_place
from engine.simulation.kernel.robots.parameters import INTERNAL, RODS, Robot
from engine.simulation.kernel.threads import threaded
from engine.simulation.physics import Physics
from engine.simulation.senses import blur_of
from engine.tasks import SQUEEZING_BY_DISTANCE, Task
from engine.tasks.walls import Wall


class Motion(NamedTuple):
    """What was recorded of trials; T trials.

    Attributes:
        path: (T, seconds, 2) heads at every full second in the settled head's frame, in m.
        poses: (updates, T, modules, 6, 7) centres and quaternions of the rods after every control update.
        commands: (updates, T, modules, 5) commanded lengths of the internal cables, noise included, in m.
        sensed: (updates, T, inputs) what the networks were given.
        forces: (updates, T, modules, 12, 3) of the ground on every node in the last time step, in N.
    """

    path: np.ndarray
    poses: np.ndarray
    commands: np.ndarray
    sensed: np.ndarray
    forces: np.ndarray


class Start(NamedTuple):
    """A settled robot, ready for trials.

    Attributes:
        robot: its numbers.
        settled: simulations without walls, one of which is the robot's.
        lane: which.
        head: the robot's head.
        controller: that drives it.
    """

    robot: Robot
    settled: State
    lane: int
    head: HeadOf
    controller: Controller


class Trials:
    """Trials of robots of one size, each from its robot's settled state.

    What a trial gives does not depend on the vectors' width or on what else is tried.

    Args:
        starts: per trial its robot.
        n_updates: control updates between the drop and the trials' begin.
        targets: (T, 2) targets in the settled head's frame, in m.
        noise: per trial its run's seed, its evaluation's number, its target and its repeat.
        task: what is sensed and how the end scores.
        physics: time step, control period and noise.
        walls: per trial its walls in the settled head's frame, equally many for all; by default none.
        width: lanes of a vector. The last vector's spare lanes repeat its first trial.
    """

    def __init__(
        self,
        starts: Sequence[Start],
        *,
        n_updates: int,
        targets: np.ndarray,
        noise: Sequence[tuple[int, int, int, int]],
        task: Task,
        physics: Physics,
        walls: Sequence[Sequence[Wall]] | None = None,
        width: int,
    ) -> None:
        n = len(targets)
        walls = [()] * n if walls is None else walls
        assert len(starts) == len(noise) == len(walls) == n
        self._n = n
        self._robots = [start.robot for start in starts]
        kind = kind_of(task)
        self.models: list[Model] = []
        """The robots, a vector's worth each."""
        self.states: list[State] = []
        """The simulations, a vector's worth each."""
        self.loops: list[Loop] = []
        """What drives them."""
        for first in range(0, n, width):
            of_lane = [i if i < n else first for i in range(first, first + width)]
            of = [starts[i] for i in of_lane]
            model = model_of([start.robot for start in of])
            state = new_state(model, n_walls=len(walls[0]))
            for lane, start in enumerate(of):
                branch(state, lane, start.settled, start.lane)
            scene = make_scene(
                kind,
                units=task.units,
                by_distance=task.score is SQUEEZING_BY_DISTANCE.score,
                heads=[head_rods(start.head) for start in of],
                targets=np.asarray(targets)[of_lane],
                walls=[walls[i] for i in of_lane],
            )
            loop = make_loop(
                model,
                scene,
                physics,
                drive=CONTROLLER,
                start=n_updates,
                heads=[start.head for start in of],
                controllers=[start.controller for start in of],
                noise=[noise[i] for i in of_lane],
                blur=blur_of(task, physics.built),
            )
            begin(state, loop)
            forget(state)
            self.models.append(model)
            self.states.append(state)
            self.loops.append(loop)

    @property
    def in_kernel(self) -> bool:
        """Whether the kernel has the task's sensors and score; else ``give`` what it senses."""
        return self.loops[0].scene.kind != PYTHON

    @property
    def n_updates(self) -> int:
        """Control updates since the drop."""
        return int(self.loops[0].clock[0])

    @property
    def failures(self) -> np.ndarray:
        """(T,) why each trial was stopped, one of ``guard``'s codes, or 0."""
        return self._joined([by_lane(s.failed)[0] for s in self.states])

    @property
    def failed_at(self) -> np.ndarray:
        """(T,) control updates from the drop to each trial's failure, or 0; see ``Loop.failed_at``."""
        return self._joined([by_lane(p.failed_at)[0] for p in self.loops])

    @property
    def head(self) -> np.ndarray:
        """(T, 2) where the heads are in the settled head's frame, in m."""
        return self._joined([by_lane(p.head).T for p in self.loops])

    @property
    def scores(self) -> np.ndarray:
        """(T,) how a task of the kernel scores the present states, in m."""
        assert self.in_kernel
        return self._joined([by_lane(p.score)[0] for p in self.loops])

    @property
    def faces(self) -> np.ndarray:
        """(T, 2, 2) where the heads' front and rear faces are in the world, in m."""
        return self._joined([by_lane(p.scene.faces).T.reshape(-1, 2, 2) for p in self.loops])

    @property
    def frames(self) -> np.ndarray:
        """(T, 2, 2) origin and x axis of the settled heads' frames, in the world."""
        return self._joined([by_lane(p.scene.frame).T.reshape(-1, 2, 2) for p in self.loops])

    @property
    def targets(self) -> np.ndarray:
        """(T, 2) the targets in the world, in m."""
        return self._joined([by_lane(p.scene.target)[2:].T for p in self.loops])

    @property
    def walls(self) -> np.ndarray:
        """(T, walls, 8) the walls in the world, each as in ``engine.simulation.kernel.physics.state``."""
        return self._joined([by_lane(s.walls).T.reshape(width_of(s.walls), -1, 8) for s in self.states])

    @property
    def rods(self) -> np.ndarray:
        """(T, modules, 6, 13) the states of all rods, see ``engine.simulation.kernel``."""
        shape = (-1, self.models[0].n_modules, RODS, ROD)
        return self._joined([by_lane(s.rods).T.reshape(shape) for s in self.states])

    def give(self, sensed: np.ndarray) -> None:
        """Set what the networks are given at the next control update, (T, inputs)."""
        assert not self.in_kernel
        for loop, first in zip(self.loops, range(0, self._n, self._width), strict=True):
            part = sensed[first : first + self._width]
            inputs = by_lane(loop.values)[: loop.networks.n_inputs]
            inputs[:] = part[0][:, None]
            inputs[:, : len(part)] = part.T

    def run(self, n_updates: int, record: frozenset[str] = NOTHING, n_threads: int = 1) -> Motion:
        """Move all trials on.

        Args:
            n_updates: how many control updates; one, after ``give``, if the task is not in the kernel.
            record: which of ``Motion``'s other fields to fill; those left out are of length 0.
            n_threads: threads that share the vectors.
        """
        assert self.in_kernel or n_updates == 1

        def one(k: int) -> Recording:
            model, loop = self.models[k], self.loops[k]
            n_trials = min(self._width, self._n - k * self._width)
            recording = make_recording(model, loop, n_updates, record, n_trials=n_trials)
            run(model, self.states[k], loop, recording, n_updates)
            return recording

        recordings = threaded(one, range(len(self.states)), n_threads)
        m = self.models[0].n_modules
        path, poses, commands, sensed, forces = (
            np.concatenate(parts, axis=1) for parts in zip(*recordings, strict=True)
        )
        return Motion(
            path.transpose(1, 0, 2),
            poses.reshape(*poses.shape[:2], m, RODS, POSE),
            commands.reshape(*commands.shape[:2], m, INTERNAL),
            sensed,
            self._of_nodes(forces),
        )

    def _of_nodes(self, forces: np.ndarray) -> np.ndarray:
        """Return the forces on nodes, (updates, T, modules, 12, 3), from those on the ends at places."""
        shape = (*forces.shape[:2], self.models[0].n_modules, 2 * RODS, 3)
        if not len(forces):
            return np.empty(shape)
        places = np.array([rods_by_place(robot).argsort() for robot in self._robots])
        ends = forces.reshape(*forces.shape[:2], -1, 2, 3)
        of_rods = np.take_along_axis(ends, places[None, :, :, None, None], axis=2)
        # the first end is that which the rod's axis points to, the second of its nodes
        return of_rods[:, :, :, ::-1].reshape(shape)

    @property
    def _width(self) -> int:
        return width_of(self.states[0].rods)

    def _joined(self, parts: Sequence[np.ndarray]) -> np.ndarray:
        """Return what belongs to the trials, from (lanes, ...) of every vector."""
        return np.concatenate(parts)[: self._n]
