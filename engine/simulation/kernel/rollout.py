"""Roll-outs by the kernel, with the face of ``engine.simulation.rollout``.

Every robot is on its own: it is dropped, settles, shows which end is its head, and goes through its trials in
the lanes of vectors. Robots share nothing, so threads take them one by one.

Why a simulation failed is known at once. Its last moments, which a dump needs, are simulated again when it
has failed: the same call gives the same bits.
"""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeVar

import mujoco
import numpy as np

from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.simulation.divergence import MAX_UPDATES, Failure
from engine.simulation.kernel.batch import widest
from engine.simulation.kernel.guard import GOES_ON, read_robot, reason
from engine.simulation.kernel.lanes.simd import by_lane
from engine.simulation.kernel.loop.dropped import Dropped
from engine.simulation.kernel.loop.trials import Trials
from engine.simulation.kernel.physics.parameters import INTERNAL, RODS, Model
from engine.simulation.kernel.physics.state import ROD, State
from engine.simulation.model import RobotModel, with_walls
from engine.simulation.physics import Physics
from engine.simulation.rollout import BatchObserver, Head, TrialResults
from engine.tasks import GroundFrame, Task, View, scores, sensed
from engine.tasks.walls import Obstacles, Wall

RELEASED_LENGTH: Final = 1.0
"""A commanded length in m at which an internal cable is slack."""
_COMMANDS: Final = frozenset({"commands"})
_SENSED: Final = frozenset({"sensed"})

R = TypeVar("R")
Q = TypeVar("Q")


@dataclasses.dataclass(frozen=True, slots=True)
class Settled:
    """A robot after settling.

    Attributes:
        robot: what was dropped.
        model: its numbers.
        dropped: the simulation.
        failure: why settling failed, or None.
    """

    robot: RobotModel
    model: Model
    dropped: Dropped
    failure: Failure | None


class KernelSimulations:
    """Simulations at one moment, with the face of ``engine.simulation.batch.SimulationBatch``.

    Args:
        robots: their models.
        states: per robot the lanes that hold its simulations.
        copies: simulations per robot.
        physics: control period.
        n_updates: control updates since the drop.
        walls: per robot and copy the walls in the world.
        failures: robot by robot, why each simulation was stopped, or None.
    """

    def __init__(
        self,
        robots: Sequence[RobotModel],
        states: Sequence[Sequence[State]],
        *,
        copies: int,
        physics: Physics,
        n_updates: int,
        walls: Sequence[Sequence[tuple[Wall, ...]]],
        failures: list[Failure | None],
    ) -> None:
        self.shape = (len(robots), copies)
        self.n_modules = robots[0].n_modules
        self.n_updates = n_updates
        self.failures = failures
        self._robots = robots
        self._states = states
        self._physics = physics
        self._walls = walls
        self._models: dict[int, mujoco.MjModel] = {}

    @property
    def time(self) -> float:
        """Seconds since the robots were dropped."""
        return self.n_updates * self._physics.control_period

    @property
    def alive(self) -> np.ndarray:
        """(robots, copies) whether a simulation goes on."""
        return np.array([f is None for f in self.failures]).reshape(self.shape)

    @property
    def qpos(self) -> np.ndarray:
        """(robots, copies, 7 x rods) generalised coordinates, in MuJoCo's order."""
        return self._rods()[..., :7].reshape(*self.shape, -1)

    @property
    def commanded(self) -> np.ndarray:
        """(robots, copies, modules, 5) commanded lengths of the internal cables, in m."""
        return self._lanes("commanded").reshape(*self.shape, self.n_modules, INTERNAL)

    def all_rods(self) -> np.ndarray:
        """Return (robots, copies, modules, 6, 3) centres of all rods, in m."""
        return self._rods()[..., :3].reshape(*self.shape, self.n_modules, RODS, 3)

    def model(self, i: int) -> mujoco.MjModel:
        """Return the MuJoCo model of a simulation, robot by robot, which must not be changed."""
        if i not in self._models:
            r, copy = divmod(i, self.shape[1])
            self._models[i] = with_walls(self._robots[r], self._walls[r][copy])
        return self._models[i]

    def state(self) -> np.ndarray:
        """Return the (robots, copies, n) complete states of MuJoCo (``mjSTATE_INTEGRATION``)."""
        rods = self._rods().reshape(-1, self.n_modules * RODS, ROD)
        commanded = self.commanded.reshape(len(rods), -1)
        states = [
            mujoco_state(self.model(i), rods[i], commanded[i], self.time) for i in range(len(self.failures))
        ]
        return np.array(states).reshape(*self.shape, -1)

    def _rods(self) -> np.ndarray:
        return self._lanes("rods").reshape(*self.shape, -1, ROD)

    def _lanes(self, field: str) -> np.ndarray:
        """Return the (robots, copies, n) numbers of a field of all simulations."""
        n = self.shape[1]
        return np.array(
            [np.concatenate([by_lane(getattr(s, field)).T for s in states])[:n] for states in self._states]
        )


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
        walls: per copy the walls in the settled head's frame, the same number for each.
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

        def begin(robot: int) -> Trials:
            return Trials(
                settled[robot].model,
                settled[robot].dropped.state,
                n_updates=settled[robot].dropped.n_updates,
                head=heads[robot],
                controller=controllers[robot],
                targets=targets,
                noise=noise[robot],
                task=task,
                physics=physics,
                walls=walls,
                width=widest(),
            )

        self._begin: Callable[[int], Trials] = begin
        self._trials = [begin(r) for r in range(len(settled))]
        self._start = self._trials[0].n_updates
        self._height_rods = [(h.module, list(h.front)) for h in heads]
        self.walls = [
            [tuple(map(_wall, placed)) if walls[0] else () for placed in trials.walls]
            for trials in self._trials
        ]
        """Per robot and copy the walls as they stand in the world."""
        self.targets = np.array([trials.targets for trials in self._trials])
        """(robots, copies, 2) the targets in the world, in m."""
        self.sensed: np.ndarray | None = None
        """(robots, copies, inputs) what the controllers sensed at the last update, None before the first."""
        self.sim = KernelSimulations(
            [s.robot for s in settled],
            [trials.states for trials in self._trials],
            copies=len(targets),
            physics=physics,
            n_updates=self._start,
            walls=self.walls,
            failures=[s.failure for s in settled for _ in targets],
        )

    def head(self) -> np.ndarray:
        """Return (robots, copies, 2) head positions in the settled head's frame, in m."""
        return np.array([trials.head for trials in self._trials])

    def from_world(self, point: np.ndarray) -> np.ndarray:
        """Convert a (2,) point from the world to the first settled head's frame, in m."""
        return self._frame().from_world(point[None, None])[0, 0]

    def view(self) -> View:
        """Return the task's view of the present moment."""
        faces = np.array([trials.faces for trials in self._trials])
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
        if self._trials[0].in_kernel:
            return np.array([trials.scores for trials in self._trials])
        return scores(self._task, self.view(), self.sim.alive)

    def update(self) -> None:
        """Sense, think, act for one control period."""
        if self._trials[0].in_kernel:
            found = self._map(lambda trials: trials.run(1, _SENSED).sensed[0], self._trials)
            self.sensed = np.array(found)
        else:
            self.sensed = sensed(self._task, self.view(), self.sim.alive)
            for trials, given in zip(self._trials, self.sensed, strict=True):
                trials.give(given)
            self._map(lambda trials: trials.run(1), self._trials)
        self._noticed()

    def run(self, duration: float, observer: BatchObserver | None = None) -> list[TrialResults]:
        """Run to the end and return one result per robot."""
        n = round(duration / self._physics.control_period)
        if observer is None and self._trials[0].in_kernel:
            start = self.head()
            motions = self._map(lambda trials: trials.run(n).path, self._trials)
            self._noticed()
            path = np.concatenate([start[:, :, None], np.array(motions)], axis=2)
        else:
            path = self._run_watched(n, observer)
        final, failures = self.scores(), self._failures()
        copies = self.sim.shape[1]
        return [
            TrialResults(final[r], path[r], tuple(failures[r * copies : (r + 1) * copies]))
            for r in range(len(self._trials))
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
        frames = np.array([trials.frame for trials in self._trials])
        ahead = frames[:, 1]
        left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=-1)
        return GroundFrame(frames[:, None, 0], np.stack([ahead, left], axis=1)[:, None])

    def _height(self) -> np.ndarray:
        """Return the (robots, copies) heights of the heads' front faces, in m."""
        rods = self.sim.all_rods()
        faces = [rods[r, :, module][:, front, 2] for r, (module, front) in enumerate(self._height_rods)]
        return np.array(faces).mean(axis=-1)

    def _noticed(self) -> None:
        """Bring the time and the failures of the simulations up to date."""
        self.sim.n_updates = self._trials[0].n_updates
        for r, trials in enumerate(self._trials):
            for copy, code in enumerate(trials.failures.tolist()):
                i = r * self.sim.shape[1] + copy
                if code != GOES_ON and self.sim.failures[i] is None:
                    at = int(trials.failed_at[copy])
                    self.sim.failures[i] = _failure(code, at, trials.model, self._physics)

    def _failures(self) -> list[Failure | None]:
        """Return the failures with their last moments, which are simulated again."""
        copies = self.sim.shape[1]
        for i, failure in enumerate(self.sim.failures):
            r, copy = divmod(i, copies)
            if failure is not None and self._settled[r].failure is None and not len(failure.controls):
                self.sim.failures[i] = self._with_past(failure, r, copy)
        return list(self.sim.failures)

    def _with_past(self, failure: Failure, robot: int, copy: int) -> Failure:
        trials = self._begin(robot)
        n = min(failure.n_updates - self._start, MAX_UPDATES)
        before = failure.n_updates - self._start - n
        if not trials.in_kernel:  # Python decided what was sensed, and is not asked again
            n, before = 1, 0
        if before:
            trials.run(before)
        state = mujoco_state(
            self.sim.model(robot * self.sim.shape[1] + copy),
            trials.rods[copy].reshape(-1, ROD),
            np.full(INTERNAL * trials.model.n_modules, RELEASED_LENGTH),
            (self._start + before) * self._physics.control_period,
        )
        if not trials.in_kernel:
            trials.give(np.zeros((self.sim.shape[1], self._task.n_inputs)))
        commands = trials.run(n, _COMMANDS).commands[:, copy]
        return dataclasses.replace(failure, state=state, controls=commands.reshape(n, -1))

    def _map(self, function: Callable[[Q], R], items: Sequence[Q]) -> list[R]:
        return threaded(function, items, self._n_threads)


def settle(
    robots: Sequence[RobotModel],
    morphologies: Sequence[Morphology],
    *,
    physics: Physics,
    duration: float,
    n_threads: int = 1,
    observer: BatchObserver | None = None,
) -> list[Settled]:
    """Drop robots and let them come to rest, servos off.

    Args:
        robots: their models.
        morphologies: their bodies.
        physics: time step and control period.
        duration: seconds.
        n_threads: threads that simulate.
        observer: sees every robot after each of its control updates.
    """

    def one(pair: tuple[RobotModel, Morphology]) -> Settled:
        robot, morphology = pair
        model = read_robot(robot)
        poses = robot.model.qpos0.reshape(-1, 7)
        end = Head.of(morphology, True)
        dropped = Dropped(model, poses, end=end, physics=physics, width=widest())
        if observer is None:
            dropped.settle(duration)
        else:
            for _ in range(round(duration / physics.control_period)):
                dropped.settle(physics.control_period)
                observer(_at_rest(robot, dropped, physics))
        failure = None
        if dropped.failure != GOES_ON:
            failure = _settling_failure(robot, model, end, dropped, physics)
        return Settled(robot, model, dropped, failure)

    return threaded(one, list(zip(robots, morphologies, strict=True)), n_threads)


def find_heads(
    settled: Sequence[Settled],
    morphologies: Sequence[Morphology],
    *,
    physics: Physics,
    duration: float,
    n_threads: int = 1,
) -> tuple[list[Head], list[Failure | None]]:
    """Find which end of each robot goes first when all modules pulse together.

    Returns:
        The heads and, per robot, why its simulation failed or None.
    """

    def one(pair: tuple[Settled, Morphology]) -> tuple[Head, Failure | None]:
        robot, morphology = pair
        is_end, code = robot.dropped.goes_end_first(duration)
        failure = robot.failure
        if failure is None and code != GOES_ON:
            n = robot.dropped.n_updates + round(duration / physics.control_period)
            failure = _failure(code, n, robot.model, physics)
            failure = dataclasses.replace(
                failure,
                state=_at_rest(robot.robot, robot.dropped, physics).state()[0, 0],
                controls=np.full((1, INTERNAL * robot.model.n_modules), RELEASED_LENGTH),
            )
        return Head.of(morphology, is_end), failure

    found = threaded(one, list(zip(settled, morphologies, strict=True)), n_threads)
    return [head for head, _ in found], [failure for _, failure in found]


def threaded(function: Callable[[Q], R], items: Sequence[Q], n_threads: int) -> list[R]:
    """Return a function's results for items, in their order, computed on some threads."""
    if n_threads == 1 or len(items) == 1:
        return [function(item) for item in items]
    with concurrent.futures.ThreadPoolExecutor(n_threads) as pool:
        return list(pool.map(function, items))


def mujoco_state(model: mujoco.MjModel, rods: np.ndarray, commanded: np.ndarray, time: float) -> np.ndarray:
    """Return MuJoCo's complete state (``mjSTATE_INTEGRATION``) of a simulation of the kernel.

    MuJoCo's solver starts from nothing there: the kernel keeps forces, MuJoCo accelerations.

    Args:
        model: of the robot in its world.
        rods: (rods, 13) their states.
        commanded: (modules x 5,) commanded lengths in m.
        time: seconds since the drop.
    """
    data = mujoco.MjData(model)
    data.time = time
    data.qpos[:] = rods[:, :7].ravel()
    data.qvel[:] = rods[:, 7:].ravel()
    data.ctrl[:] = commanded
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return state


def _at_rest(robot: RobotModel, dropped: Dropped, physics: Physics) -> KernelSimulations:
    failed = dropped.failure
    failure = _failure(failed, dropped.n_updates, dropped.model, physics) if failed != GOES_ON else None
    return KernelSimulations(
        [robot],
        [[dropped.state]],
        copies=1,
        physics=physics,
        n_updates=dropped.n_updates,
        walls=[[()]],
        failures=[failure],
    )


def _failure(code: int, n_updates: int, model: Model, physics: Physics) -> Failure:
    """Return a failure without its past."""
    seconds = n_updates * physics.control_period
    text = f"diverged {seconds:.2f} s after the drop: {reason(code, model)}"
    return Failure(text, n_updates, np.empty(0), np.empty((0, INTERNAL * model.n_modules)))


def _settling_failure(
    robot: RobotModel, model: Model, end: Head, dropped: Dropped, physics: Physics
) -> Failure:
    """Return why a robot failed while it settled, with its last moments."""
    again = Dropped(model, robot.model.qpos0.reshape(-1, 7), end=end, physics=physics, width=widest())
    at = 0
    while again.failure == GOES_ON:
        again.settle(physics.control_period)
        at += 1
    n = min(at, MAX_UPDATES)
    before = Dropped(model, robot.model.qpos0.reshape(-1, 7), end=end, physics=physics, width=widest())
    if at > n:
        before.settle((at - n) * physics.control_period)
    return dataclasses.replace(
        _failure(dropped.failure, at, model, physics),
        state=_at_rest(robot, before, physics).state()[0, 0],
        controls=np.full((n, INTERNAL * model.n_modules), RELEASED_LENGTH),
    )


def _wall(placed: Any) -> Wall:
    """Return a wall of the kernel: centre, half sizes, cosine and sine of its turn about the vertical."""
    x, y, z, *sizes, cosine, sine = map(float, placed)
    return Wall(centre=(x, y, z), half_size=(sizes[0], sizes[1], sizes[2]), yaw=math.atan2(sine, cosine))
