"""Simulates an evaluation again, with its run's physics and with another.

A sample is a whole evaluation: every target, as many repeats as in the run, its head found anew. Sample
0 has the recorded noise; the others have noise that the run never used.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import mujoco
import numpy as np

from engine.analysis.robustness import deviation_of, mean_of
from engine.config import RunConfig, task_of
from engine.errors import InvalidData
from engine.simulation.batch import Simulations
from engine.simulation.evaluation import Evaluation, LocalEvaluator, Solution
from engine.simulation.model import RobotModel, build_robot
from engine.simulation.physics import Physics, Simulator, check_timestep, with_inertia
from engine.simulation.trials import fresh_number

MAX_SEEDS: Final = 100
SMALLEST_FACTOR: Final = 0.01
"""Smallest factor on the time step; the simulation takes its inverse times as long."""


@dataclasses.dataclass(frozen=True, slots=True)
class Samples:
    """One solution, evaluated with one physics under the recorded noise and under N others.

    Attributes:
        physics: how it was simulated.
        recorded_noise: the evaluation with the recorded noise.
        fresh: N evaluations with fresh noise.
        motion: of all modules in all trials of all of them.
    """

    physics: Physics
    recorded_noise: Evaluation
    fresh: tuple[Evaluation, ...]
    motion: Motion

    @property
    def n_failed(self) -> int:
        """How many of the evaluations with fresh noise failed."""
        return sum(e.fitness is None for e in self.fresh)

    @property
    def fitness(self) -> np.ndarray:
        """(N - n_failed,) fitnesses under fresh noise, in m."""
        return np.array([e.fitness for e in self.fresh if e.fitness is not None])

    @property
    def mean(self) -> float | None:
        """Mean of ``fitness`` in m; None if every evaluation failed."""
        return mean_of(self.fitness)

    @property
    def deviation(self) -> float | None:
        """Standard deviation of ``fitness`` in m; None for fewer than two values."""
        return deviation_of(self.fitness)

    @property
    def distances(self) -> np.ndarray | None:
        """(targets,) mean final distances under fresh noise, in m; None if every evaluation failed."""
        found = [e.distances.mean(axis=1) for e in self.fresh if e.fitness is not None]
        return np.mean(found, axis=0) if found else None


@dataclasses.dataclass(frozen=True, slots=True)
class Verification:
    """An evaluation as recorded, simulated again, and simulated with another physics.

    Attributes:
        recorded: what the run holds.
        own: simulated again with the run's physics.
        changed: simulated with another physics, or None.
        plain: where MuJoCo is that physics, which knows no feet that grip one way, and the robot has some:
            the robot without them with the run's physics. ``changed`` is without them, too.
    """

    recorded: Evaluation
    own: Samples
    changed: Samples | None
    plain: Samples | None = None

    @property
    def identical(self) -> bool:
        """Whether the run's physics and the recorded noise give the recorded results to the last bit."""
        again = self.own.recorded_noise
        return (
            again.fitness == self.recorded.fitness
            and again.head_is_end == self.recorded.head_is_end
            and np.array_equal(again.distances, self.recorded.distances)
            and np.array_equal(again.trajectory, self.recorded.trajectory)
        )


def changed_physics(
    physics: Physics,
    *,
    inertia_scale: float | None = None,
    timestep_factor: float | None = None,
    simulator: Simulator | None = None,
) -> Physics:
    """Return a physics with another inertia, time step or simulator, or several of them.

    Args:
        physics: to start from.
        inertia_scale: factor on every inertia; the time step follows it to stay stable.
        timestep_factor: factor on the time step, after that.
        simulator: another one.

    Raises:
        InvalidData: a value is out of range, or the time step is no whole fraction of the control period.
    """
    if inertia_scale is not None and inertia_scale != physics.inertia_scale:
        physics = with_inertia(physics, inertia_scale)
    if timestep_factor is not None:
        if not SMALLEST_FACTOR <= timestep_factor < math.inf:
            raise InvalidData(f"timestep factor must be at least {SMALLEST_FACTOR}, not {timestep_factor}")
        physics = dataclasses.replace(physics, timestep=physics.timestep * timestep_factor)
    if simulator is not None:
        physics = dataclasses.replace(physics, simulator=simulator)
    return physics


def resimulate(
    config: RunConfig, evaluation: Evaluation, *, physics: Physics, n_seeds: int, n_threads: int = 1
) -> Samples:
    """Evaluate a solution again.

    Args:
        config: of the run that the evaluation belongs to.
        evaluation: of the solution.
        physics: how to simulate it.
        n_seeds: evaluations with fresh noise, besides the one with the recorded noise.
        n_threads: threads inside MuJoCo; the result does not depend on it.

    Raises:
        InvalidData: the number of seeds or the physics' time step is out of range.
    """
    if not 1 <= n_seeds <= MAX_SEEDS:
        raise InvalidData(f"seeds must be from 1 to {MAX_SEEDS}, not {n_seeds}")
    check_timestep(physics)
    task, solution = task_of(config), evaluation.solution
    recorder = MotionRecorder(build_robot(solution.morphology, physics), physics)
    evaluator = LocalEvaluator(
        task=task,
        physics=physics,
        trials=config.trials,
        run_seed=config.seed,
        n_threads=n_threads,
        observer=recorder,
    )
    samples = [with_noise(solution, k) for k in range(1 + n_seeds)]
    found = {e.solution.number: e for group in evaluator.evaluate(samples) for e in group}
    first, *fresh = (found[s.number] for s in samples)
    return Samples(physics, first, tuple(fresh), recorder.motion())


def verify(
    config: RunConfig,
    evaluation: Evaluation,
    *,
    physics: Physics | None = None,
    n_seeds: int = 5,
    n_threads: int = 1,
) -> Verification:
    """Simulate an evaluation again with the run's physics and, if given, with another.

    Args:
        config: of the run that the evaluation belongs to.
        evaluation: what the run holds.
        physics: another physics; its control period and noise may differ too.
        n_seeds: evaluations with fresh noise for each physics.
        n_threads: threads inside MuJoCo; the result does not depend on it.

    Raises:
        InvalidData: the number of seeds or the physics' time step is out of range.
    """
    if physics is not None:
        check_timestep(physics)  # bad values are refused before time is spent
    own = resimulate(config, evaluation, physics=config.physics, n_seeds=n_seeds, n_threads=n_threads)
    if physics is None:
        return Verification(evaluation, own, None)
    plain, again = None, evaluation
    if physics.simulator == "mujoco" and evaluation.solution.morphology.feet != "none":
        again = _without_feet(evaluation)
        plain = resimulate(config, again, physics=config.physics, n_seeds=n_seeds, n_threads=n_threads)
    changed = resimulate(config, again, physics=physics, n_seeds=n_seeds, n_threads=n_threads)
    return Verification(evaluation, own, changed, plain)


def _without_feet(e: Evaluation) -> Evaluation:
    body = dataclasses.replace(e.solution.morphology, feet="none")
    return dataclasses.replace(e, solution=dataclasses.replace(e.solution, morphology=body))


def with_noise(solution: Solution, sample: int) -> Solution:
    """Return a solution under the number that gives a sample's noise; 0 is the recorded noise.

    The noise of the others is that of no evaluation of the run and of no other sample.
    """
    return dataclasses.replace(solution, number=fresh_number(solution.number, sample))


@dataclasses.dataclass(frozen=True, slots=True)
class Motion:
    """The extreme motions of modules in some simulations; a module's centre is its rods' mean.

    Failed simulations count until they fail; everything is 0 if nothing was observed.

    Attributes:
        airborne: share of the control updates, 0 to 1, at which no rod touched the ground.
        height: largest height of a module's centre above the ground, in m.
        speed: largest speed of a module's centre, in m/s, over one control period.
        final_speed: the same, over the last control period that was observed.
    """

    airborne: float
    height: float
    speed: float
    final_speed: float


class MotionRecorder:
    """An observer of simulations, of one batch after another, of robots of one size.

    A rod is a capsule and the ground a plane, so a rod touches the ground exactly when the lower end of
    its capsule lies below it; MuJoCo uses the same criterion.

    Args:
        robot: any of the robots; their rods are alike.
        physics: of the simulations.
    """

    def __init__(self, robot: RobotModel, physics: Physics) -> None:
        model = robot.model
        geoms = model.body_geomadr[robot.rod_bodies]
        assert (model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_CAPSULE).all()
        matrix = np.empty((*geoms.shape, 9))
        for index in np.ndindex(*geoms.shape):
            mujoco.mju_quat2Mat(matrix[index], model.geom_quat[geoms[index]])
        self._middle = model.geom_pos[geoms]
        # a capsule lies along the z axis of its geom; both in the frame of the rod
        self._half = matrix.reshape(*geoms.shape, 3, 3)[..., 2] * model.geom_size[geoms, 1, None]
        self._radius = model.geom_size[geoms, 0]
        self._period = physics.control_period
        self._sim: Simulations | None = None
        self._centres = np.empty(0)
        self._n_airborne = 0
        self._n_seen = 0
        self._height = 0.0
        self._speed = 0.0
        self._final_speed = 0.0

    def __call__(self, sim: Simulations) -> None:
        """Look at every simulation of a batch that has not failed."""
        alive = np.array([f is None for f in sim.failures])
        pose = sim.qpos.reshape(len(alive), sim.n_modules, -1, 7)
        self._n_seen += int(alive.sum())
        self._n_airborne += int((alive & (self._lowest(pose) >= 0.0)).sum())
        centres = pose[..., :3].mean(axis=2)
        if alive.any():
            self._height = max(self._height, float(centres[alive, :, 2].max()))
        # a new batch starts from rest
        if sim is self._sim and alive.any():
            moved = np.linalg.norm(centres[alive] - self._centres[alive], axis=-1)
            self._final_speed = float(moved.max()) / self._period
            self._speed = max(self._speed, self._final_speed)
        self._sim, self._centres = sim, centres

    def motion(self) -> Motion:
        """Return what was observed so far."""
        return Motion(
            airborne=self._n_airborne / max(1, self._n_seen),
            height=self._height,
            speed=self._speed,
            final_speed=self._final_speed,
        )

    def _lowest(self, pose: np.ndarray) -> np.ndarray:
        """Return the (n,) heights in m of the lowest points of n robots.

        Args:
            pose: (n, modules, 6, 7) positions and quaternions of the rods.
        """
        w, x, y, z = np.moveaxis(pose[..., 3:], -1, 0)
        # the row that turns a point of a rod's frame into its height above the rod's middle
        up = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=-1)
        middle = pose[..., 2] + (up * self._middle).sum(axis=-1)
        return (middle - np.abs((up * self._half).sum(axis=-1)) - self._radius).min(axis=(1, 2))
