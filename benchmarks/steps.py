"""What a time step costs: by the kernel, by MuJoCo's batch, and at least.

Eight crawling robots of one kind, on one thread, are stepped by the kernel and by MuJoCo in turns, so that
what else the machine does weighs on all.
"""

from __future__ import annotations

import copy
import dataclasses
import random
import time
from collections.abc import Callable, Sequence
from typing import Final

import mujoco
import numpy as np
from mujoco import batch

from benchmarks.counting import Work, count_step
from engine.body import module as t
from engine.body import servo
from engine.body.morphology import Morphology
from engine.simulation.kernel import guard
from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.physics.state import N_COUPLED, N_SWEEPS, State, new_state
from engine.simulation.kernel.physics.walls import place_walls
from engine.simulation.kernel.robots.model import Model, model_of
from engine.simulation.kernel.step import run
from engine.simulation.model import RobotModel, build_robot, with_walls
from engine.simulation.physics import Physics
from engine.tasks.walls import Wall

LANES: Final = 8
STIFFNESS_LEVELS: Final = (5, 1, 10)
PHYSICS: Final = Physics()
PGS_TOLERANCE: Final = 1e-8
"""Of MuJoCo's PGS when runs were made with it."""
OPEN: Final[Sequence[Wall]] = ()
CORRIDOR: Final = (
    Wall(centre=(0.4, 0.062, 0.05), half_size=(0.6, 0.01, 0.07)),
    Wall(centre=(0.4, -0.062, 0.05), half_size=(0.6, 0.01, 0.07)),
    Wall(centre=(2.0, 0.0, 0.06), half_size=(0.1, 1.0, 0.06)),
    Wall(centre=(-1.0, 0.0, 0.06), half_size=(0.1, 1.0, 0.06)),
    Wall(centre=(0.4, 1.0, 0.06), half_size=(1.0, 0.1, 0.06)),
)
"""Two walls 10.4 cm apart along the robot, which rub its sides, and three that it never meets."""
CLOCK: Final = 4.0
"""Cycles of a core in a ns."""
CYCLES: Final = {"cheap": 0.25, "dear": 8.0, "loads": 0.5, "stores": 1.0}
"""Cycles that a core with vectors of eight doubles needs at least: for a sum or product (two of each at
once), a quotient or root, a load and a store."""
CHUNK: Final = 10
"""Control updates that one simulator is timed for before it is the next one's turn."""
SAMPLES: Final = 4
"""Steps whose operations are counted."""


@dataclasses.dataclass(frozen=True, slots=True)
class Cost:
    """What a step costs; medians over robots.

    Attributes:
        kernel, newton, pgs: CPU time per simulation, in microseconds.
        sweeps, coupled: sweeps per island and over coupled islands.
        operations: sums, products, quotients and roots per simulation.
        dear: of those, quotients and roots.
        traffic: vectors loaded and stored.
        memory: bytes of the vectors that a step touches.
        floor: microseconds per simulation that the operations or the loads and stores need at least.
    """

    kernel: float
    newton: float
    pgs: float
    sweeps: float
    coupled: float
    operations: float
    dear: float
    traffic: float
    memory: float
    floor: float


def cost(n: int, *, robots: int, seconds: float, seed: int, walls: Sequence[Wall]) -> Cost:
    """Time and count steps of robots of n modules.

    Args:
        n: modules.
        robots: how many; relative stiffness 0.5, 0.1 and 1.0 take turns.
        seconds: of crawling that are timed, after 3 s of settling.
        seed: of faces and gaits.
        walls: that stand around them.
    """
    costs = [_cost(n, k, seconds, seed, walls) for k in range(robots)]
    return Cost(*np.median([dataclasses.astuple(c) for c in costs], axis=0))


def parts(n: int, *, seed: int) -> dict[str, float]:
    """Return which part of a step's operations serves what, for a robot of n modules that crawls."""
    robot, model = _robot(n, 0, seed)
    state = _settled(robot, model, OPEN)
    for lengths in _commands(n, round(0.5 / PHYSICS.control_period), seed):
        _command(state, lengths)
        run(model, state, PHYSICS.steps_per_control)
    work = count_step(model, state)
    return {name: k / work.operations for name, k in work.parts.items()}


def _cost(n: int, k: int, seconds: float, seed: int, walls: Sequence[Wall]) -> Cost:
    """Time and count one robot."""
    robot, model = _robot(n, k, seed)
    state = _settled(robot, model, walls)
    simulators: list[Callable[[np.ndarray], None]] = [
        _Mujoco(with_walls(robot, walls), state, solver).step
        for solver in (mujoco.mjtSolver.mjSOL_NEWTON, mujoco.mjtSolver.mjSOL_PGS)
    ]

    def step(lengths: np.ndarray) -> None:
        _command(state, lengths)
        run(model, state, PHYSICS.steps_per_control)

    simulators.insert(0, step)
    state.work.counts[[N_SWEEPS, N_COUPLED]] = 0
    commands = _commands(n, round(seconds / PHYSICS.control_period), seed + k)
    chunks = [commands[i : i + CHUNK] for i in range(0, len(commands), CHUNK)]
    times = np.array([[_timed(s, chunk) for s in simulators] for chunk in chunks])
    # a trial enters compiled code once, not at every command
    entering = np.median([_timed(lambda _: run(model, state, 0), commands[:1]) for _ in range(100)])
    times[:, 0] -= entering * np.array([len(chunk) for chunk in chunks])
    n_steps = len(commands) * PHYSICS.steps_per_control
    each = np.array([len(chunk) for chunk in chunks])[:, None] * PHYSICS.steps_per_control * LANES
    kernel, newton, pgs = 1e6 * np.median(times / each, axis=0)
    sweeps = state.work.counts[N_SWEEPS] / n_steps / model.n_islands
    coupled = state.work.counts[N_COUPLED] / n_steps
    works = [count_step(model, state) for _ in range(SAMPLES)]
    return Cost(kernel, newton, pgs, sweeps, coupled, *np.mean([_counted(w) for w in works], axis=0))


def _counted(work: Work) -> tuple[float, float, float, float, float]:
    computing = CYCLES["cheap"] * work.cheap + CYCLES["dear"] * work.dear
    moving = CYCLES["loads"] * work.loads + CYCLES["stores"] * work.stores
    floor = max(computing, moving) / CLOCK / 1000.0 / LANES
    memory = 8.0 * LANES * len(work.touched)
    return work.operations, work.dear, work.loads + work.stores, memory, floor


def _timed(step: Callable[[np.ndarray], None], commands: np.ndarray) -> float:
    start = time.process_time()
    for lengths in commands:
        step(lengths)
    return time.process_time() - start


def _robot(n: int, k: int, seed: int) -> tuple[RobotModel, Model]:
    rng = random.Random(seed + 100 * n + k)
    faces = tuple(rng.randint(1, 8) for _ in range(n))
    robot = build_robot(Morphology(STIFFNESS_LEVELS[k % len(STIFFNESS_LEVELS)], faces), PHYSICS)
    return robot, model_of([guard.read_robot(robot)] * LANES)


def _settled(robot: RobotModel, model: Model, walls: Sequence[Wall]) -> State:
    """Return lanes of one robot after 3 s with its servos off, then with walls around it."""
    state = new_state(model, n_walls=len(walls))
    simd.by_lane(state.rods).reshape(-1, 13, LANES)[:, :7] = robot.model.qpos0.reshape(-1, 7)[..., None]
    simd.by_lane(state.commanded)[:] = 1.0
    for lane in range(LANES):
        place_walls(state, lane, [])
    run(model, state, round(3.0 / PHYSICS.timestep))
    for lane in range(LANES):
        place_walls(state, lane, walls)
    state.work.counts[0] = -1
    return state


def _command(state: State, lengths: np.ndarray) -> None:
    simd.by_lane(state.commanded)[:] = lengths.T


def _commands(n: int, n_updates: int, seed: int) -> np.ndarray:
    """Return (updates, lanes, modules x 5) noisy commands of a gait per lane."""
    rng = np.random.default_rng(seed)
    frequency, phase = (rng.choice(o, (LANES, n)) for o in (servo.FREQUENCIES, servo.PHASES))
    angles = [
        servo.command_angle(frequency, phase, 3.0 + u * PHYSICS.control_period) for u in range(n_updates)
    ]
    lengths = servo.target_lengths(np.array(angles))
    noise = PHYSICS.servo_noise * rng.normal(size=lengths.shape)
    return (lengths + noise).reshape(n_updates, LANES, n * len(t.SERVO_NODES))


class _Mujoco:
    """MuJoCo's batch on one thread, from the state of the kernel's lanes."""

    def __init__(self, model: mujoco.MjModel, state: State, solver: mujoco.mjtSolver) -> None:
        model = copy.copy(model)
        model.opt.solver = solver
        if solver == mujoco.mjtSolver.mjSOL_PGS:
            model.opt.tolerance = PGS_TOLERANCE
        self._batch = batch.Batch(model, LANES, 1)
        self._batch.set_models([model] * LANES)
        self._batch.reset()
        rods = simd.by_lane(state.rods).reshape(-1, 13, LANES).transpose(2, 0, 1)
        self._batch.bind("qpos")[:] = rods[..., :7].reshape(LANES, -1)
        self._batch.bind("qvel")[:] = rods[..., 7:].reshape(LANES, -1)
        self._ctrl = self._batch.bind("ctrl")

    def step(self, lengths: np.ndarray) -> None:
        """Advance by one control period."""
        self._ctrl[:] = lengths
        self._batch.step(None, nstep=PHYSICS.steps_per_control)
