"""What feet that grip one way do: ``python -m benchmarks.feet``.

First the check that they are no Brownian ratchet: random robots hold their servos still in three postures,
under the servos' noise; after 20 s, in which some still tip over, their way is measured for 40 s. Then a
comparison: random bodies with random networks reach for their targets with plain friction, with feet, and
with feet whose two coefficients are closer; bodies, networks and noise are the same.

Exits with 1 if a robot that holds still has moved by more than 0.5 cm.
"""

from __future__ import annotations

import dataclasses
import os
import random
import sys
from collections.abc import Sequence
from typing import Annotated, Final

import numpy as np
import tyro

from engine.body.feet import FEET, Feet
from engine.body.module import MIN_MODULES, N_STIFFNESS_LEVELS
from engine.body.morphology import Morphology
from engine.control.operators import Neat
from engine.search.variation import VariationConfig
from engine.simulation.evaluation import Evaluation, LocalEvaluator, Solution
from engine.simulation.kernel.guard import read_robot
from engine.simulation.kernel.lanes.simd import by_lane
from engine.simulation.kernel.loop.dropped import Dropped
from engine.simulation.kernel.loop.trials import Start, Trials
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics
from engine.simulation.rollout import Head
from engine.simulation.trials import TrialConfig
from engine.tasks import GOAL_REACHING, target_offsets

MOST: Final = 0.005
"""How far in m a robot that holds still may move."""
POSTURES: Final = {"released": -np.pi / 2, "half": 0.0, "contracted": np.pi / 2}
"""Phases that a servo of frequency 0 stays at."""
SETTLES: Final = 250
"""Control updates in which a robot settles."""
RESTS: Final = 1000
"""Control updates in which it takes its posture, and tips over if noise makes it."""
PERIOD: Final = 2000
"""Control updates for which it holds still: 40 s."""
WIDTH: Final = 8
SIZES: Final = 8
"""Numbers of modules: 2 to 9."""
PAIRS: Final = ((0.3, 0.8), (0.4, 0.6), (0.45, 0.55))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arguments:
    """Measure what feet that grip one way do."""

    robots: Annotated[int, tyro.conf.arg(metavar="N")] = 60
    """Random robots that reach for targets; 0 leaves them out."""
    still: Annotated[int, tyro.conf.arg(metavar="N")] = 64
    """Random robots that hold still, in multiples of 8; 0 leaves them out."""
    threads: int = os.cpu_count() or 1
    """Threads that simulate."""


def main(arguments: Arguments) -> int:
    """Run and return the exit status."""
    well = not arguments.still or _still(arguments.still)
    if arguments.robots:
        _compared(arguments.robots, arguments.threads)
    if arguments.still:
        print("no robot that holds still moves" if well else "a robot that holds still moves")
    return int(not well)


def _still(n: int) -> bool:
    print(
        f"{n} random robots, servos held still under noise, 40 s; the way of the mean of all rods, in cm\n"
        "posture      feet    forward: mean ± s.e.  largest  any way: median     90 %  largest"
    )
    well = True
    for posture, phase in POSTURES.items():
        for feet in FEET:
            groups = [_held(k, feet, phase) for k in range(n // WIDTH)]
            moved, forward = (100 * np.concatenate(part) for part in zip(*groups, strict=True))
            print(
                f"{posture:12} {feet:6}       {forward.mean():+.4f} ± {_error(forward):.4f}"
                f" {forward.max():8.3f} {np.median(moved):16.3f} {np.percentile(moved, 90):8.3f}"
                f" {moved.max():8.3f}",
                flush=True,
            )
            well &= feet == "none" or bool(moved.max() <= 100 * MOST)
    return well


def _held(group: int, feet: Feet, phase: float) -> tuple[np.ndarray, np.ndarray]:
    """Return how far eight robots move while they hold still, and how far along their feet's way, in m."""
    rng, physics = random.Random(group), Physics()
    n = MIN_MODULES + group % SIZES
    bodies = [_body(rng, n, feet) for _ in range(WIDTH)]
    robots = [build_robot(body, physics) for body in bodies]
    numbers = [read_robot(robot) for robot in robots]
    heads = [Head.of(body, True) for body in bodies]
    dropped = Dropped(
        numbers,
        np.array([robot.model.qpos0.reshape(-1, 7) for robot in robots]),
        ends=heads,
        rhythms=[body.open_loop for body in bodies],
        physics=physics,
        width=WIDTH,
    )
    dropped.settle(SETTLES)
    controller = Neat(n_inputs=GOAL_REACHING.n_inputs).random(rng)  # whatever it says, servos stand still
    trials = Trials(
        [Start(numbers[k], dropped.state, k, heads[k], controller) for k in range(WIDTH)],
        n_updates=dropped.n_updates,
        targets=np.tile(target_offsets(GOAL_REACHING)[0], (WIDTH, 1)),
        noise=[(0, WIDTH * group + k, 0, 0) for k in range(WIDTH)],
        task=GOAL_REACHING,
        physics=physics,
        width=WIDTH,
    )
    for loop in trials.loops:
        by_lane(loop.servos.frequency)[:] = 0.0
        by_lane(loop.servos.phase)[:] = phase
    trials.run(RESTS)
    before = trials.rods[..., :2].mean(axis=2)
    trials.run(PERIOD)
    way = (trials.rods[..., :2].mean(axis=2) - before).mean(axis=1)
    along = before[:, -1] - before[:, 0]
    along *= (-1.0 if feet == "start" else 1.0) / np.linalg.norm(along, axis=1, keepdims=True)
    return np.linalg.norm(way, axis=1), (way * along).sum(axis=1)


def _compared(n: int, threads: int) -> None:
    rng, neat = random.Random(1), Neat(n_inputs=GOAL_REACHING.n_inputs, rates=VariationConfig().neat)
    solutions = [
        Solution(
            number=k, morphology=_body(rng, MIN_MODULES + k % SIZES, "none"), controller=neat.random(rng)
        )
        for k in range(n)
    ]
    print(
        f"\n{n} random bodies and networks, four targets each, one noise seed, the same for all rows; in cm\n"
        "feet   friction      net way of the head: quartiles and largest      path  f_s: median   best"
        "  farther than without"
    )
    plain = _row("none", Physics(), solutions, threads, None)
    for forward, backward in PAIRS:
        _row("end", Physics(feet_forward=forward, feet_backward=backward), solutions, threads, plain)
    _row("start", Physics(), solutions, threads, plain)


def _row(
    feet: Feet, physics: Physics, solutions: Sequence[Solution], threads: int, plain: np.ndarray | None
) -> np.ndarray:
    """Evaluate robots and print a row; return the net ways of their heads in cm, by their numbers."""
    evaluator = LocalEvaluator(
        task=GOAL_REACHING,
        physics=physics,
        trials=TrialConfig(repeats=1, trajectory_bits=0),
        run_seed=0,
        n_threads=threads,
    )
    own = [dataclasses.replace(s, morphology=dataclasses.replace(s.morphology, feet=feet)) for s in solutions]
    found = sorted(
        (e for group in evaluator.evaluate(own) for e in group if e.fitness is not None),
        key=lambda e: e.solution.number,
    )
    net = np.array([_net(e) for e in found])
    gained = np.array([100 * (GOAL_REACHING.target_distance - (e.fitness or 0.0)) for e in found])
    low, middle, high = np.percentile(net, [25, 50, 75])
    friction = f"{physics.feet_forward:g} / {physics.feet_backward:g}" if feet != "none" else "0.5"
    more = "" if plain is None else f"{(net > plain).sum()} of {len(net)}"
    print(
        f"{feet:6} {friction:12} {low:7.2f} {middle:7.2f} {high:7.2f} {net.max():7.2f}"
        f" {np.median([_path(e) for e in found]):23.1f} {np.median(gained):12.2f} {gained.max():6.2f}"
        f" {more:>21}",
        flush=True,
    )
    return net


def _net(e: Evaluation) -> float:
    """Return how far the head gets in a trial, in cm: mean over targets."""
    return 100 * float(np.linalg.norm(e.trajectory[:, -1], axis=-1).mean())


def _path(e: Evaluation) -> float:
    """Return the length of the head's path at 1 Hz, in cm: mean over targets."""
    return 100 * float(np.linalg.norm(np.diff(e.trajectory, axis=1), axis=-1).sum(axis=1).mean())


def _body(rng: random.Random, n: int, feet: Feet) -> Morphology:
    faces = tuple(rng.randint(1, 8) for _ in range(n))
    return Morphology(rng.randint(1, N_STIFFNESS_LEVELS), faces, (), feet)


def _error(values: np.ndarray) -> float:
    return float(values.std(ddof=1) / np.sqrt(len(values)))


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
