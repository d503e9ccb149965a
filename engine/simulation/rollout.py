"""Closed-loop roll-outs of many robots at once.

A trial goes through three phases: the robot is dropped and settles without actuation; the target is placed,
and walls are put up, relative to the settled head; the controller drives the robot. Which end is the head is
found once per robot, on a separate branch without walls: 10 s open loop after settling.

Results are the same bits whatever the number of threads and whichever robots share a call.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Final, Protocol

import mujoco
import numpy as np

from engine.body import module as t
from engine.body import servo
from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.control.network import NetworkBatch
from engine.simulation.batch import BatchObserver, SimulationBatch, Simulations, Span
from engine.simulation.divergence import Failure
from engine.simulation.model import RobotModel, build_robot, face_rods, with_walls
from engine.simulation.physics import Physics
from engine.simulation.senses import Messages, ServoAngles
from engine.tasks import SETTLE_TIME, TRIAL_TIME, GroundFrame, Task, View, scores, sensed
from engine.tasks.walls import Obstacles, Wall

OPEN_LOOP_TIME: Final = 10.0
"""Seconds of open-loop motion that show which end is the head."""
NOISE_BLOCK: Final = 50
"""Control updates whose noise is drawn at once."""


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
        """Return the head of a robot whose head is known to be the end, or the start, of the chain."""
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

    def height(self, sim: SimulationBatch) -> np.ndarray:
        """Return the heights (robots, copies) of the front faces above the ground, in m."""
        return sim.rods(self._module, self._front)[..., 2].mean(axis=2)

    def faces(self, sim: SimulationBatch) -> tuple[np.ndarray, np.ndarray]:
        """Return the horizontal positions (robots, copies, 2) of front and rear face, in m."""
        front = sim.rods(self._module, self._front).mean(axis=2)
        rear = sim.rods(self._module, self._rear).mean(axis=2)
        return front[..., :2], rear[..., :2]


def build_robots(morphologies: Sequence[Morphology], physics: Physics) -> list[RobotModel]:
    """Compile the robots of a batch."""
    return [build_robot(m, physics) for m in morphologies]


def settle(
    robots: Sequence[RobotModel],
    *,
    physics: Physics,
    n_threads: int = 1,
    duration: float = SETTLE_TIME,
    observer: BatchObserver | None = None,
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
) -> tuple[list[Head], list[Failure | None]]:
    """Find which end goes first when all modules pulse together, or by their rhythms.

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
    rhythms = np.array([m.open_loop for m in morphologies])[:, None]
    servos = Servos(physics, (*sim.shape, sim.n_modules))
    frequency = servo.FREQUENCIES[rhythms // len(servo.PHASES)]
    phase = servo.PHASES[rhythms % len(servo.PHASES)]
    for _ in range(round(duration / physics.control_period)):
        command = servo.command_angle(frequency, phase, sim.time)
        sim.step(servos.lengths(command))
    moved = ((sensor.faces(sim)[1] - rear) * direction).sum(axis=-1)[:, 0]
    heads = [Head.of(m, bool(d >= 0.0)) for m, d in zip(morphologies, moved, strict=True)]
    return heads, sim.failures


@dataclasses.dataclass(frozen=True, slots=True)
class TrialResults:
    """The results of one robot's S trials.

    Attributes:
        scores: (S,) the task's scores of the final states in m, for most tasks the distance from head to
            target.
        trajectory: (S, seconds + 1, 2) head position at 1 Hz in the settled head's frame, x ahead, y
            left, in m; the first is the origin.
        failures: (S,) why a trial failed, or None.
    """

    scores: np.ndarray
    trajectory: np.ndarray
    failures: tuple[Failure | None, ...]

    @property
    def failed(self) -> int | None:
        """The first trial that failed, or None."""
        return next((k for k, f in enumerate(self.failures) if f), None)


class RollOut(Protocol):
    """Settled robots under way to their targets, whatever simulates them: R robots in C copies each."""

    @property
    def sim(self) -> Simulations:
        """The simulations."""

    @property
    def walls(self) -> Sequence[Sequence[tuple[Wall, ...]]]:
        """Per robot and copy the walls as they stand in the world."""

    @property
    def targets(self) -> np.ndarray:
        """(R, C, 2) the targets in the world, in m."""

    @property
    def sensed(self) -> np.ndarray | None:
        """(R, C, inputs) what the controllers sensed at the last update, None before the first."""

    def head(self) -> np.ndarray:
        """Return (R, C, 2) head positions in the settled head's frame, in m."""

    def from_world(self, point: np.ndarray) -> np.ndarray:
        """Convert a (2,) point from the world to the first settled head's frame, in m."""

    def view(self) -> View:
        """Return the task's view of the present moment."""

    def scores(self) -> np.ndarray:
        """Return the task's scores of the present state, (R, C) in m."""

    def update(self) -> None:
        """Sense, think, act for one control period."""

    def advance(self, n_updates: int) -> Span:
        """Do so for some control periods, at least one, and return what happened."""

    def run(self, duration: float, observer: BatchObserver | None = None) -> list[TrialResults]:
        """Run to the end and return one result per robot."""


def update_by_update(loop: RollOut, n_updates: int) -> Span:
    """Return what ``loop.advance`` does, by as many calls of ``loop.update``."""
    spans = []
    for _ in range(n_updates):
        loop.update()
        spans.append(Span.of(loop.sim, loop.sensed))
    return Span.joined(spans)


class ClosedLoop:
    """Drives settled robots with their controllers towards targets.

    Args:
        settled: the robots after settling, one copy each.
        robots: the same robots' models.
        heads: their heads.
        controllers: one per robot.
        targets: (robots, copies, 2) targets in the settled head's frame: x ahead, y left, in m.
        seeds: per robot and copy the seed of its actuation noise.
        task: decides what the controllers sense and how the final state scores.
        walls: per copy the walls in the settled head's frame, the same number for each; by default none.
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
        walls: Sequence[tuple[Wall, ...]] | None = None,
    ) -> None:
        n_copies = targets.shape[1]
        walls = [()] * n_copies if walls is None else walls
        assert len({len(w) for w in walls}) == 1
        self._physics = physics
        self._task = task
        self._sensor = HeadSensor(heads)
        self._frame = GroundFrame.of(*self._sensor.faces(settled))
        self._obstacles = Obstacles(walls)
        self.walls = [
            [self._frame.place(r, w) if ok else w for w in walls] for r, ok in enumerate(settled.alive[:, 0])
        ]
        """Per robot and copy the walls as they stand in the world."""
        self.sim = SimulationBatch(
            robots, copies=n_copies, physics=physics, n_threads=n_threads, models=_models(robots, self.walls)
        )
        self.sim.branch(settled)
        self._start_time = settled.time
        self.targets = self._frame.to_world(targets)
        self._network = NetworkBatch(controllers, n_outputs=2 * self.sim.n_modules)
        n = self.sim.n_modules
        self._order = np.array([range(n)[::-1] if h.is_end else range(n) for h in heads])
        self._noise = _Noise(seeds, (n, len(t.SERVO_NODES)), physics.servo_noise)
        self._messages = Messages(task, physics, seeds)
        self._servos = Servos(physics, (*self.sim.shape, n))
        self.sensed: np.ndarray | None = None
        """(robots, copies, inputs) what the controllers were told last, None before the first update."""

    def head(self) -> np.ndarray:
        """Return (robots, copies, 2) head positions in the settled head's frame, in m."""
        front, _ = self._sensor.faces(self.sim)
        return self._frame.from_world(front)

    def from_world(self, point: np.ndarray) -> np.ndarray:
        """Convert a (2,) point from the world to the first settled head's frame, in m."""
        return self._frame.from_world(point[None, None])[0, 0]

    def view(self) -> View:
        """Return the task's view of the present moment."""
        front, rear = self._sensor.faces(self.sim)
        return View(
            front=front,
            rear=rear,
            target=self.targets,
            frame=self._frame,
            obstacles=self._obstacles,
            time=self.sim.time - self._start_time,
            rods=self.sim.all_rods,
            height=lambda: self._sensor.height(self.sim),
        )

    def scores(self) -> np.ndarray:
        """Return the task's scores of the present state, (robots, copies) in m."""
        return scores(self._task, self.view(), self.sim.alive)

    def update(self) -> None:
        """Sense, think, act for one control period."""
        self.sensed = self._messages.told(sensed(self._task, self.view(), self.sim.alive))
        outputs = self._network.activate(self.sensed)
        frequency = servo.pick(servo.FREQUENCIES, outputs[..., 0::2])
        phase = servo.pick(servo.PHASES, outputs[..., 1::2])
        # the first pair of outputs drives the head module
        command = servo.command_angle(frequency, phase, self.sim.time)
        command = np.take_along_axis(command, self._order[:, None], axis=2)
        self.sim.step(self._servos.lengths(command) + self._noise.next())

    def advance(self, n_updates: int) -> Span:
        """Do so for some control periods, at least one, and return what happened."""
        return update_by_update(self, n_updates)

    def run(self, duration: float = TRIAL_TIME, observer: BatchObserver | None = None) -> list[TrialResults]:
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
        final = self.scores()
        n = self.sim.shape[1]
        results = []
        for r in range(self.sim.shape[0]):
            failures = tuple(self.sim.failures[r * n : (r + 1) * n])
            results.append(TrialResults(final[r], trajectory[r], failures))
        return results


class Servos:
    """The internal cables of some robots as their servos wind them up.

    Args:
        physics: what the robots are like.
        shape: (robots, copies, modules), or what it is to be broadcast to.
    """

    def __init__(self, physics: Physics, shape: tuple[int, ...]) -> None:
        self._angles = ServoAngles(physics, shape)
        self._table = physics.built.target_lengths()
        self._errors = physics.built.errors_of(shape[-1]) if physics.built.line_errors else None

    def lengths(self, command: np.ndarray) -> np.ndarray:
        """Return the (..., modules, 5) lengths in m a control period after commands in degrees."""
        lengths = servo.target_lengths(self._angles.after(command), self._table)
        return lengths if self._errors is None else lengths + self._errors


class _Noise:
    """Gaussian noise, one stream per simulation, so that no simulation depends on another."""

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


def _models(
    robots: Sequence[RobotModel], walls: Sequence[Sequence[tuple[Wall, ...]]]
) -> list[mujoco.MjModel] | None:
    """Return the model of every simulation, robot by robot, or None if there are no walls.

    Copies with the same walls share a model.
    """
    if not walls[0][0]:
        return None
    models = []
    for robot, worlds in zip(robots, walls, strict=True):
        built = {w: with_walls(robot, w) for w in dict.fromkeys(worlds)}
        models += [built[w] for w in worlds]
    return models
