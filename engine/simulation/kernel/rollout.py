"""The closed loop of settled robots by the kernel, with the interface of ``engine.simulation.rollout``.

All robots' trials lie side by side in the lanes of vectors, which threads take one by one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.control.genome import Controller
from engine.simulation.batch import Span
from engine.simulation.divergence import MAX_UPDATES, Failure
from engine.simulation.kernel.batch import widest
from engine.simulation.kernel.guard import GOES_ON
from engine.simulation.kernel.loop.trials import Start, Trials
from engine.simulation.kernel.settling import Settled, failure_at
from engine.simulation.kernel.simulations import KernelSimulations, wall_of
from engine.simulation.physics import Physics
from engine.simulation.rollout import BatchObserver, Head, TrialResults, update_by_update
from engine.tasks import GroundFrame, Task, View, scores, sensed
from engine.tasks.walls import Obstacles, Wall

_SENSED: Final = frozenset({"sensed"})
_SPAN: Final = frozenset({"poses", "commands", "sensed", "forces"})


class KernelLoop:
    """Drives settled robots with their controllers towards targets: ``rollout.ClosedLoop`` by the kernel.

    Args:
        settled: the robots after settling.
        heads: their heads.
        controllers: one per robot.
        targets: (copies, 2) targets in the settled head's frame: x ahead, y left, in m.
        noise: per robot and copy its run's seed, its evaluation's number, its target and its repeat.
        task: decides what the controllers sense and how the final state scores.
        physics: time step, control period and noise.
        n_threads: threads that simulate.
        walls: per copy the walls in the settled head's frame; every copy has equally many.
    """

    def __init__(
        self,
        settled: Sequence[Settled],
        *,
        heads: Sequence[Head],
        controllers: Sequence[Controller],
        targets: np.ndarray,
        noise: Sequence[Sequence[tuple[int, int, int, int]]],
        task: Task,
        physics: Physics,
        n_threads: int,
        walls: Sequence[tuple[Wall, ...]],
    ) -> None:
        self._settled = settled
        self._task = task
        self._physics = physics
        self._n_threads = n_threads
        self._obstacles = Obstacles(walls)

        self._trials = Trials(
            [
                Start(robot.numbers, robot.dropped.state, robot.lane, head, controller)
                for robot, head, controller in zip(settled, heads, controllers, strict=True)
                for _ in targets
            ],
            n_updates=settled[0].dropped.n_updates,
            targets=np.tile(targets, (len(settled), 1)),
            noise=[stream for streams in noise for stream in streams],
            task=task,
            physics=physics,
            walls=[w for _ in settled for w in walls],
            width=widest(),
        )

        def again(r: int) -> KernelLoop:
            return KernelLoop(
                settled[r : r + 1],
                heads=heads[r : r + 1],
                controllers=controllers[r : r + 1],
                targets=targets,
                noise=noise[r : r + 1],
                task=task,
                physics=physics,
                n_threads=1,
                walls=walls,
            )

        self._again = again
        self._start = self._trials.n_updates
        self._height_rods = [(h.module, list(h.front)) for h in heads]
        placed = self._of_robots(self._trials.walls)
        self.walls = [[tuple(map(wall_of, w)) if walls[0] else () for w in own] for own in placed]
        """Per robot and copy the walls as they stand in the world."""
        self.targets = self._of_robots(self._trials.targets)
        """(robots, copies, 2) the targets in the world, in m."""
        self.sensed: np.ndarray | None = None
        """(robots, copies, inputs) what the controllers were told last, None before the first update."""
        self.sim = KernelSimulations(
            [s.robot for s in settled],
            self._trials.states,
            copies=len(targets),
            physics=physics,
            n_updates=self._start,
            walls=self.walls,
            failures=[s.failure for s in settled for _ in targets],
        )

    def head(self) -> np.ndarray:
        """Return (robots, copies, 2) head positions in the settled head's frame, in m."""
        return self._of_robots(self._trials.head)

    def from_world(self, point: np.ndarray) -> np.ndarray:
        """Convert a (2,) point from the world to the first settled head's frame, in m."""
        return self._frame().from_world(point[None, None])[0, 0]

    def view(self) -> View:
        """Return the task's view of the present moment."""
        faces = self._of_robots(self._trials.faces)
        return View(
            front=faces[:, :, 0],
            rear=faces[:, :, 1],
            target=self.targets,
            frame=self._frame(),
            obstacles=self._obstacles,
            time=self.sim.time - self._start * self._physics.control_period,
            rods=self.sim.all_rods,
            height=self._height,
        )

    def scores(self) -> np.ndarray:
        """Return the task's scores of the present state, (robots, copies) in m."""
        if self._trials.in_kernel:
            return self._of_robots(self._trials.scores)
        return scores(self._task, self.view(), self.sim.alive)

    def update(self) -> None:
        """Sense, think, act for one control period."""
        if self._trials.in_kernel:
            self.sensed = self._of_robots(self._trials.run(1, _SENSED).sensed[0])
        else:
            self.sensed = sensed(self._task, self.view(), self.sim.alive)
            self._trials.give(self.sensed.reshape(-1, self.sensed.shape[-1]))
            self.sensed = self._of_robots(self._trials.run(1, _SENSED).sensed[0])
        self._update_failures()

    def advance(self, n_updates: int) -> Span:
        """Do so for some control periods, at least one, and return what happened."""
        if not self._trials.in_kernel:
            return update_by_update(self, n_updates)
        motion = self._trials.run(n_updates, _SPAN, n_threads=self._n_threads)
        self._update_failures()
        n = self.sim.shape
        told = motion.sensed.reshape(n_updates, *n, -1)
        self.sensed = told[-1]
        return Span(
            self.sim,
            self.sim.n_updates,
            motion.poses.reshape(n_updates, *n, -1),
            motion.commands.reshape(n_updates, *n, *motion.commands.shape[2:]),
            told,
            motion.forces.reshape(n_updates, *n, *motion.forces.shape[2:]),
        )

    def run(self, duration: float, observer: BatchObserver | None = None) -> list[TrialResults]:
        """Run to the end and return one result per robot."""
        n = round(duration / self._physics.control_period)
        if observer is None and self._trials.in_kernel:
            start = self.head()
            motion = self._of_robots(self._trials.run(n, n_threads=self._n_threads).path)
            self._update_failures()
            path = np.concatenate([start[:, :, None], motion], axis=2)
        else:
            path = self._run_watched(n, observer)
        final, failures = self.scores(), self._failures()
        copies = self.sim.shape[1]
        return [
            TrialResults(final[r], path[r], tuple(failures[r * copies : (r + 1) * copies]))
            for r in range(self.sim.shape[0])
        ]

    def _run_watched(self, n: int, observer: BatchObserver | None) -> np.ndarray:
        """Run update by update; return the (robots, copies, seconds + 1, 2) paths of the heads."""
        per_second = round(1.0 / self._physics.control_period)
        path = [self.head()]
        for k in range(1, n + 1):
            self.update()
            if observer:
                observer(self.sim)
            if k % per_second == 0:
                path.append(self.head())
        return np.stack(path, axis=2)

    def _frame(self) -> GroundFrame:
        frames = self._of_robots(self._trials.frames)[:, 0]
        ahead = frames[:, 1]
        left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=-1)
        return GroundFrame(frames[:, None, 0], np.stack([ahead, left], axis=1)[:, None])

    def _height(self) -> np.ndarray:
        """Return the (robots, copies) heights of the heads' front faces, in m."""
        rods = self.sim.all_rods()
        faces = [rods[r, :, module][:, front, 2] for r, (module, front) in enumerate(self._height_rods)]
        return np.array(faces).mean(axis=-1)

    def _update_failures(self) -> None:
        """Bring the time and the failures of the simulations up to date."""
        self.sim.n_updates = self._trials.n_updates
        failed_at = self._trials.failed_at.tolist()
        for i, code in enumerate(self._trials.failures.tolist()):
            if code != GOES_ON and self.sim.failures[i] is None:
                robot = self._settled[i // self.sim.shape[1]].numbers
                self.sim.failures[i] = failure_at(code, failed_at[i], robot, self._physics)

    def _of_robots(self, of_trials: np.ndarray) -> np.ndarray:
        """Return what belongs to trials, (trials, ...), by (robots, copies, ...)."""
        n = len(self._settled)
        return of_trials.reshape(n, len(of_trials) // n, *of_trials.shape[1:])

    def _failures(self) -> list[Failure | None]:
        """Return the failures; the first of every robot with its last moments, which are simulated again."""
        copies, failures = self.sim.shape[1], list(self.sim.failures)
        for r, robot in enumerate(self._settled):
            own = range(r * copies, (r + 1) * copies)
            first = next(((i, f) for i in own if (f := failures[i]) is not None), None)
            if first is not None and robot.failure is None:
                i, failure = first
                failures[i] = self._again(r)._with_past(failure, i - own.start)
        return failures

    def _with_past(self, failure: Failure, copy: int) -> Failure:
        """Return the failure of a copy of this loop's only robot with its last moments."""
        n_updates = failure.n_updates - self._start
        n = min(n_updates, MAX_UPDATES)
        if self._trials.in_kernel:
            self._trials.run(n_updates - n)
            self._update_failures()
        else:
            for _ in range(n_updates - n):
                self.update()
        state, controls = self.sim.state()[0, copy], []
        for _ in range(n):
            self.update()
            controls.append(self.sim.commanded[0, copy].ravel())
        return dataclasses.replace(failure, state=state, controls=np.array(controls))
