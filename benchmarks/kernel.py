"""What a step of the kernel costs beside MuJoCo's batch: ``python -m benchmarks.kernel``.

Prints microseconds of CPU per step and simulation for eight crawling robots of one kind, on one thread: the
kernel, MuJoCo's batch with Newton and with PGS as the models have it, in turns within one run, so that what
else the machine does weighs on all. Every size has a second row, of robots squeezed between walls. Exits with
1 if the kernel misses its goal, a fifteenth of MuJoCo's time with PGS, in the open.

The floor is what must be computed even at rest: 29 cables of 115 operations and six rods of 130 are 4,100 in
a module and step. Vectors of eight doubles, two sums and two products a cycle at 4 GHz, are 128 operations a
nanosecond at most: 0.03 us per module and simulation, of which the kernel's free motion takes 0.08 and
everything else at rest 0.03. State, pose and acceleration are 11 kB per module and eight lanes: four modules
fit the first cache, ten the second. What remains is sweeps over contacts that slide.
"""

from __future__ import annotations

import copy
import dataclasses
import random
import sys
import time
from collections.abc import Callable, Sequence
from typing import Final

import mujoco
import numpy as np
import tyro
from mujoco import batch
from rich.console import Console
from rich.table import Table

from benchmarks.timing import machine
from engine.body import module as t
from engine.body import servo
from engine.body.morphology import Morphology
from engine.simulation.kernel import guard
from engine.simulation.kernel.batch import widest
from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.physics.state import N_COUPLED, N_SWEEPS, State, new_state
from engine.simulation.kernel.physics.walls import place_walls
from engine.simulation.kernel.robots.model import model_of
from engine.simulation.kernel.step import run
from engine.simulation.model import RobotModel, build_robot, with_walls
from engine.simulation.physics import Physics
from engine.tasks.walls import Wall

LANES: Final = 8
STIFFNESS_LEVELS: Final = (5, 1, 10)
GOAL: Final = 15.0
PHYSICS: Final = Physics()
CORRIDOR: Final = (
    Wall(centre=(0.4, 0.062, 0.05), half_size=(0.6, 0.01, 0.07)),
    Wall(centre=(0.4, -0.062, 0.05), half_size=(0.6, 0.01, 0.07)),
    Wall(centre=(2.0, 0.0, 0.06), half_size=(0.1, 1.0, 0.06)),
    Wall(centre=(-1.0, 0.0, 0.06), half_size=(0.1, 1.0, 0.06)),
    Wall(centre=(0.4, 1.0, 0.06), half_size=(1.0, 0.1, 0.06)),
)
"""Two walls 10.4 cm apart along the robot, which rub its sides, and three that it never meets."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arguments:
    """Time steps of the kernel and of MuJoCo."""

    sizes: tuple[int, ...] = (2, 6, 10)
    """Numbers of modules."""
    robots: int = 3
    """Robots per size; relative stiffness 0.5, 0.1 and 1.0 take turns."""
    seconds: float = 4.0
    """Seconds of crawling that are timed, after 3 s of settling."""
    seed: int = 0
    """Of faces and gaits."""


@dataclasses.dataclass(frozen=True, slots=True)
class Cost:
    """Microseconds per step and simulation, and sweeps per island and over coupled islands in a step."""

    kernel: float
    newton: float
    pgs: float
    sweeps: float
    coupled: float


def main(arguments: Arguments) -> int:
    """Run and return the exit status."""
    console = Console()
    console.print(machine())
    compiled = _compile_time(arguments.sizes[0])
    console.print(f"{LANES} lanes, vectors of {widest()}; loaded or compiled in {compiled:.1f} CPU s")
    table = Table("robots", "kernel", "Newton", "PGS", "Newton / kernel", "PGS / kernel", "sweeps", "coupled")
    reached = True
    for n in arguments.sizes:
        for walls in ((), CORRIDOR):
            cost = _median([_cost(arguments, n, k, walls) for k in range(arguments.robots)])
            reached &= bool(walls) or cost.pgs / cost.kernel >= GOAL
            table.add_row(
                f"{n} modules" + (", squeezed" if walls else ""),
                f"{cost.kernel:.2f} us",
                f"{cost.newton:.1f} us",
                f"{cost.pgs:.1f} us",
                f"{cost.newton / cost.kernel:.1f}",
                f"{cost.pgs / cost.kernel:.1f}",
                f"{cost.sweeps:.1f}",
                f"{cost.coupled:.1f}",
            )
    console.print(table)
    console.print("every goal reached" if reached else f"not a {GOAL:g}th everywhere")
    return int(not reached)


def _median(costs: Sequence[Cost]) -> Cost:
    return Cost(*np.median([dataclasses.astuple(c) for c in costs], axis=0))


def _compile_time(n: int) -> float:
    """Return the CPU seconds of the first step."""
    robot = build_robot(Morphology(5, (1,) * n), PHYSICS)
    model = model_of([guard.read_robot(robot)] * LANES)
    state = new_state(model)
    start = time.process_time()
    run(model, state, 1)
    return time.process_time() - start


def _cost(a: Arguments, n: int, k: int, walls: Sequence[Wall]) -> Cost:
    """Time one robot."""
    rng = random.Random(a.seed + 100 * n + k)
    faces = tuple(rng.randint(1, 8) for _ in range(n))
    robot = build_robot(Morphology(STIFFNESS_LEVELS[k % len(STIFFNESS_LEVELS)], faces), PHYSICS)
    model = model_of([guard.read_robot(robot)] * LANES)
    state = _settled(robot, walls)
    simulators: list[Callable[[np.ndarray], None]] = [
        _Mujoco(with_walls(robot, walls), state, solver).step
        for solver in (mujoco.mjtSolver.mjSOL_NEWTON, mujoco.mjtSolver.mjSOL_PGS)
    ]

    def step(lengths: np.ndarray) -> None:
        simd.by_lane(state.commanded)[:] = lengths.T
        run(model, state, PHYSICS.steps_per_control)

    simulators.insert(0, step)
    state.work.counts[[N_SWEEPS, N_COUPLED]] = 0
    commands = _commands(n, round(a.seconds / PHYSICS.control_period), a.seed + k)
    times = np.array([[_timed(s, lengths) for s in simulators] for lengths in commands])
    n_steps = len(commands) * PHYSICS.steps_per_control
    kernel, newton, pgs = 1e6 * np.median(times, axis=0) / PHYSICS.steps_per_control / LANES
    sweeps = state.work.counts[N_SWEEPS] / n_steps / model.n_islands
    return Cost(kernel, newton, pgs, sweeps, state.work.counts[N_COUPLED] / n_steps)


def _timed(step: Callable[[np.ndarray], None], lengths: np.ndarray) -> float:
    start = time.process_time()
    step(lengths)
    return time.process_time() - start


def _settled(robot: RobotModel, walls: Sequence[Wall]) -> State:
    """Return lanes of one robot after 3 s with its servos off, then with walls around it."""
    model = model_of([guard.read_robot(robot)] * LANES)
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


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
