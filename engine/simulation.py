"""Closed-loop roll-outs of many robots at once.

A trial goes through three phases: the robot is dropped and settles without actuation; the target is
placed relative to the settled head; the controller drives the robot. Which end is the head is found
once per robot, on a branch of its own: 10 s open loop after settling.

Results are the same bits whatever the number of threads and whichever robots share a call.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Final

import mujoco
import numpy as np
from mujoco import batch

from engine import servo
from engine import tensegrity as t
from engine.controller import Controller
from engine.morphology import Morphology
from engine.network import NetworkBatch
from engine.robot import Physics, RobotModel, build_robot, face_rods
from engine.tasks import SETTLE_TIME, TRIAL_TIME, Task

OPEN_LOOP_TIME: Final = 10.0
"""Seconds of open-loop motion, all modules at 0.5 Hz and phase 0, that show which end is the head."""
OPEN_LOOP_FREQUENCY: Final = 0.5
ARENA_RADIUS: Final = 10.0
"""A rod further than this from the origin, in m, means that a simulation has diverged."""
NOISE_BLOCK: Final = 50
"""Control updates whose noise is drawn at once."""

_DIVERGENCE_WARNINGS: Final = [
    mujoco.mjtWarning.mjWARN_BADQPOS.value,
    mujoco.mjtWarning.mjWARN_BADQVEL.value,
    mujoco.mjtWarning.mjWARN_BADQACC.value,
]


class SimulationBatch:
    """Robots with the same number of modules, each simulated in several copies.

    Args:
        robots: the compiled robots.
        copies: simulations per robot.
        physics: time step and control period.
        n_threads: threads inside MuJoCo.
    """

    def __init__(
        self, robots: Sequence[RobotModel], *, copies: int, physics: Physics, n_threads: int
    ) -> None:
        self._batch = batch.Batch(robots[0].model, len(robots) * copies, n_threads)
        self._batch.set_models([r.model for r in robots for _ in range(copies)])
        self._batch.reset()
        self._physics = physics
        self.shape = (len(robots), copies)
        self.n_modules = robots[0].n_modules
        # all robots of a size number their bodies alike; each has one free joint of 7 coordinates
        columns = robots[0].model.jnt_qposadr[robots[0].model.body_jntadr[robots[0].rod_bodies]]
        self._xyz = columns[..., None] + np.arange(3)
        self._qpos = self._batch.bind("qpos")
        self._ctrl = self._batch.bind("ctrl")
        self.failure: list[str | None] = [None] * self._batch.nsim
        self._alive = np.ones(self._batch.nsim, dtype=bool)
        self.n_updates = 0

    @property
    def time(self) -> float:
        """Seconds since the robots were dropped."""
        return self.n_updates * self._physics.control_period

    @property
    def qpos(self) -> np.ndarray:
        """(robots, copies, nq) generalised coordinates; a view."""
        return self._qpos.reshape(*self.shape, -1)

    @property
    def commanded(self) -> np.ndarray:
        """(robots, copies, modules, 5) commanded lengths of the internal cables, in m; a view."""
        return self._ctrl.reshape(*self.shape, self.n_modules, -1)

    def rods(self, module: np.ndarray, rods: np.ndarray) -> np.ndarray:
        """Return (robots, copies, n, 3) centres of n chosen rods per robot, in m.

        Args:
            module: (robots,) which module.
            rods: (robots, n) which of its rods.
        """
        columns = self._xyz[module[:, None], rods]
        robot = np.arange(self.shape[0])[:, None, None, None]
        copy = np.arange(self.shape[1])[None, :, None, None]
        return self.qpos[robot, copy, columns[:, None]]

    def state(self) -> np.ndarray:
        """Return a copy of the (robots, copies, n) complete states."""
        return self._batch.state.reshape(*self.shape, -1).copy()

    def branch(self, other: SimulationBatch) -> None:
        """Continue from another batch's robots, whose only copy is copied to all of this one's."""
        self._batch.state[:] = np.repeat(other._batch.state, self.shape[1], axis=0)
        self.n_updates = other.n_updates
        self.failure = [f for f in other.failure for _ in range(self.shape[1])]
        self._alive[:] = np.repeat(other._alive, self.shape[1])

    def step(self, lengths: np.ndarray) -> None:
        """Advance by one control period.

        Args:
            lengths: (robots, copies, modules, 5) commanded lengths of the internal cables, in m.
        """
        self._ctrl[:] = lengths.reshape(len(self._ctrl), -1)
        ids = None if self._alive.all() else np.flatnonzero(self._alive)
        if ids is None or len(ids):
            try:
                self._batch.step(ids, nstep=self._physics.steps_per_control)
            except batch.SimulationError as e:
                for i in e.ids:
                    self._fail(int(i), f"MuJoCo: {self._batch.error(int(i))}")
        self.n_updates += 1
        self._check()

    def _check(self) -> None:
        bad = self._batch.warning[:, _DIVERGENCE_WARNINGS, 1].any(axis=1)
        xyz = self._qpos[:, self._xyz.ravel()]
        bad |= ~(np.abs(xyz).max(axis=1) < ARENA_RADIUS)
        for i in np.flatnonzero(bad & self._alive):
            self._fail(int(i), f"diverged {self.time:.2f} s after the drop")

    def _fail(self, i: int, reason: str) -> None:
        self._alive[i] = False
        self.failure[i] = reason


Observer = Callable[[SimulationBatch], None]
"""Called after every control update; may raise to abandon the roll-out."""


@dataclasses.dataclass(frozen=True, slots=True)
class Head:
    """Which end of a robot is its head, and where its faces are.

    Attributes:
        module: index of the head module.
        front, rear: rods whose centres average to the head's front face and to the opposite one.
        is_end: True when the head is the end of the chain (its last module), False when its start.
    """

    module: int
    front: tuple[int, ...]
    rear: tuple[int, ...]
    is_end: bool

    @classmethod
    def of(cls, morphology: Morphology, is_end: bool) -> Head:
        """Return the head of a robot for a known direction."""
        module = morphology.n_modules - 1 if is_end else 0
        face = morphology.faces[module]
        opposite = t.OPPOSITE_FACE[face]
        front, rear = (face, opposite) if is_end else (opposite, face)
        return cls(module, face_rods(front), face_rods(rear), is_end)


class HeadSensor:
    """Reads positions and directions of the heads of a batch."""

    def __init__(self, heads: Sequence[Head]) -> None:
        self._module = np.array([h.module for h in heads])
        self._front = np.array([h.front for h in heads])
        self._rear = np.array([h.rear for h in heads])

    def faces(self, sim: SimulationBatch) -> tuple[np.ndarray, np.ndarray]:
        """Return the horizontal positions (robots, copies, 2) of front and rear face, in m."""
        front = sim.rods(self._module, self._front).mean(axis=2)
        rear = sim.rods(self._module, self._rear).mean(axis=2)
        return front[..., :2], rear[..., :2]


def build_robots(morphologies: Sequence[Morphology], task: Task, physics: Physics) -> list[RobotModel]:
    """Compile the robots of a batch in the world of a task."""
    return [build_robot(m, physics, task.walls(m.n_modules)) for m in morphologies]


def settle(
    robots: Sequence[RobotModel],
    *,
    physics: Physics,
    n_threads: int = 1,
    duration: float = SETTLE_TIME,
    observer: Observer | None = None,
) -> SimulationBatch:
    """Drop robots of one size and let them come to rest, servos off."""
    sim = SimulationBatch(robots, copies=1, physics=physics, n_threads=n_threads)
    released = np.ones((*sim.shape, sim.n_modules, len(t.SERVO_NODES)))
    for _ in range(round(duration / physics.control_period)):
        sim.step(released)
        if observer:
            observer(sim)
    return sim


def find_heads(
    settled: SimulationBatch,
    robots: Sequence[RobotModel],
    morphologies: Sequence[Morphology],
    *,
    physics: Physics,
    n_threads: int = 1,
    duration: float = OPEN_LOOP_TIME,
) -> tuple[list[Head], list[str | None]]:
    """Find which end goes first when all modules pulse together.

    The end of the chain is the head unless the rear face of its module has by then crossed, backwards,
    the line through its own starting point, perpendicular to the robot.

    Returns:
        The heads and, per robot, why its simulation failed or None.
    """
    sim = SimulationBatch(robots, copies=1, physics=physics, n_threads=n_threads)
    sim.branch(settled)
    heads = [Head.of(m, True) for m in morphologies]
    sensor = HeadSensor(heads)
    front, rear = sensor.faces(sim)
    direction = front - rear
    frequency = np.full((*sim.shape, sim.n_modules), OPEN_LOOP_FREQUENCY)
    for _ in range(round(duration / physics.control_period)):
        command = servo.command_angle(frequency, np.zeros_like(frequency), sim.time)
        sim.step(servo.target_lengths(command))
    moved = ((sensor.faces(sim)[1] - rear) * direction).sum(axis=-1)[:, 0]
    heads = [Head.of(m, bool(d >= 0.0)) for m, d in zip(morphologies, moved, strict=True)]
    return heads, sim.failure


@dataclasses.dataclass(frozen=True, slots=True)
class Trials:
    """What the trials of one robot gave; S trials.

    Attributes:
        final_distance: (S,) from head to target at the end, in m.
        trajectory: (S, seconds + 1, 2) head position at 1 Hz in the settled head's frame, x ahead, y
            left, in m; the first is the origin.
        failure: why a trial failed, or None.
    """

    final_distance: np.ndarray
    trajectory: np.ndarray
    failure: str | None


class ClosedLoop:
    """Drives settled robots with their controllers towards targets.

    Args:
        settled: the robots after settling, one copy each.
        robots: the same robots' models.
        heads: their heads.
        controllers: one per robot.
        targets: (robots, copies, 2) targets in the settled head's frame: x ahead, y left, in m.
        seeds: per robot and copy the seed of its actuation noise.
        task: what the controllers sense.
    """

    def __init__(
        self,
        settled: SimulationBatch,
        robots: Sequence[RobotModel],
        *,
        heads: Sequence[Head],
        controllers: Sequence[Controller],
        targets: np.ndarray,
        seeds: Sequence[Sequence[Sequence[int]]],
        task: Task,
        physics: Physics,
        n_threads: int = 1,
    ) -> None:
        n_copies = targets.shape[1]
        self.sim = SimulationBatch(robots, copies=n_copies, physics=physics, n_threads=n_threads)
        self.sim.branch(settled)
        self._physics = physics
        self._task = task
        self._sensor = HeadSensor(heads)
        front, rear = self._sensor.faces(self.sim)
        self.origin = front[:, :1]
        ahead = front[:, :1] - rear[:, :1]
        ahead = ahead / np.linalg.norm(ahead, axis=-1, keepdims=True)
        self._axes = np.stack([ahead, _turn_left(ahead)], axis=-2)  # (robots, 1, axis, xy)
        self.targets = self.origin + np.einsum("rcax,rca->rcx", _like(self._axes, n_copies), targets)
        self._network = NetworkBatch(controllers, n_outputs=2 * self.sim.n_modules)
        n = self.sim.n_modules
        self._order = np.array([range(n)[::-1] if h.is_end else range(n) for h in heads])
        self._noise = _Noise(seeds, (n, len(t.SERVO_NODES)), physics.servo_noise)

    def head(self) -> np.ndarray:
        """Return (robots, copies, 2) head positions in the settled head's frame, in m."""
        front, _ = self._sensor.faces(self.sim)
        return np.einsum("rcax,rcx->rca", _like(self._axes, front.shape[1]), front - self.origin)

    def distance(self) -> np.ndarray:
        """Return (robots, copies) distances from head to target, in m."""
        front, _ = self._sensor.faces(self.sim)
        return np.linalg.norm(self.targets - front, axis=-1)

    def update(self) -> None:
        """Sense, think, act for one control period."""
        front, rear = self._sensor.faces(self.sim)
        outputs = self._network.activate(self._task.sense(front, front - rear, self.targets))
        frequency = servo.pick(servo.FREQUENCIES, outputs[..., 0::2])
        phase = servo.pick(servo.PHASES, outputs[..., 1::2])
        # the first pair of outputs drives the head module
        command = servo.command_angle(frequency, phase, self.sim.time)
        command = np.take_along_axis(command, self._order[:, None], axis=2)
        self.sim.step(servo.target_lengths(command) + self._noise.next())

    def run(self, duration: float = TRIAL_TIME, observer: Observer | None = None) -> list[Trials]:
        """Run to the end and return one result per robot."""
        per_second = round(1.0 / self._physics.control_period)
        path = [self.head()]
        for k in range(round(duration / self._physics.control_period)):
            self.update()
            if observer:
                observer(self.sim)
            if (k + 1) % per_second == 0:
                path.append(self.head())
        trajectory = np.stack(path, axis=2)
        distance = self.distance()
        n = self.sim.shape[1]
        results = []
        for r in range(self.sim.shape[0]):
            reasons = [f for f in self.sim.failure[r * n : (r + 1) * n] if f]
            results.append(Trials(distance[r], trajectory[r], reasons[0] if reasons else None))
        return results


class _Noise:
    """Gaussian noise, one stream per simulation, so that no simulation feels another's presence."""

    def __init__(
        self, seeds: Sequence[Sequence[Sequence[int]]], shape: tuple[int, int], sigma: float
    ) -> None:
        self._streams = [[np.random.default_rng(list(s)) for s in row] for row in seeds]
        self._shape = shape
        self._sigma = sigma
        self._block = np.empty(0)
        self._used = NOISE_BLOCK

    def next(self) -> np.ndarray:
        """Return (robots, copies, modules, 5) draws in m."""
        if self._used == NOISE_BLOCK:
            size = (NOISE_BLOCK, *self._shape)
            self._block = np.array([[g.normal(size=size) for g in row] for row in self._streams])
            self._used = 0
        self._used += 1
        return self._sigma * self._block[:, :, self._used - 1]


def _turn_left(v: np.ndarray) -> np.ndarray:
    return np.stack([-v[..., 1], v[..., 0]], axis=-1)


def _like(axes: np.ndarray, n_copies: int) -> np.ndarray:
    return np.broadcast_to(axes, (axes.shape[0], n_copies, *axes.shape[2:]))
