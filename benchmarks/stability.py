"""Random robots of every size and stiffness through whole trials: ``python -m benchmarks.stability``.

Prints one line per size and exits with 1 if a simulation diverged. With ``--task squeezing`` the robots
have walls around them, which few of them reach; a robot has passed the gate if its head got 18.9 cm ahead.
With ``--corridor 0.08`` walls stand so close that they cut into the settled robots, with a step before them.
"""

from __future__ import annotations

import dataclasses
import os
import random
import sys
import time

import numpy as np
import tyro

from engine.body.module import MAX_MODULES, MIN_MODULES, N_STIFFNESS_LEVELS
from engine.body.morphology import Morphology
from engine.control.operators import Neat
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.simulation.physics import Physics
from engine.simulation.trials import TrialConfig
from engine.tasks import GOAL_REACHING, SQUEEZING, Task, get_task
from engine.tasks.walls import Wall


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arguments:
    """Simulate random robots and count divergences."""

    task: str = GOAL_REACHING.name
    """Whose world the robots are in; they are tried on its first target."""
    corridor: float | None = None
    """Put all robots, which sense as in squeezing, into a corridor of this width in m instead."""
    robots: int = 200
    """How many; sizes and stiffness levels take turns, so that all occur."""
    seed: int = 0
    """Of faces, networks and noise."""
    threads: int = os.cpu_count() or 1
    """Threads that simulate."""


def main(arguments: Arguments) -> int:
    """Run and return the exit status."""
    task = get_task(arguments.task) if arguments.corridor is None else _corridor(arguments.corridor)
    rng, neat = random.Random(arguments.seed), Neat(n_inputs=task.n_inputs)
    sizes = range(MIN_MODULES, MAX_MODULES + 1)
    bodies = [
        Morphology(1 + k % N_STIFFNESS_LEVELS, tuple(rng.randint(1, 8) for _ in range(sizes[k % len(sizes)])))
        for k in range(arguments.robots)
    ]
    # one target is enough: each robot runs once, 43 s
    task = dataclasses.replace(task, target_bearings=task.target_bearings[:1], names=task.names[:1])
    evaluator = LocalEvaluator(
        task=task,
        physics=Physics(),
        trials=TrialConfig(repeats=1),
        run_seed=arguments.seed,
        n_threads=arguments.threads,
    )
    solutions = [
        Solution(number=k, morphology=body, controller=neat.random(rng)) for k, body in enumerate(bodies)
    ]
    failed = 0
    print("modules  robots  diverged  CPU s per robot  median net head displacement, farthest ahead, cm")
    for size in sizes:
        group = [s for s in solutions if s.morphology.n_modules == size]
        started = time.process_time()
        results = [e for chunk in evaluator.evaluate(group) for e in chunk]
        seconds = (time.process_time() - started) / max(len(group), 1)
        bad = [e for e in results if e.failure]
        failed += len(bad)
        net = [100 * float(np.hypot(*e.trajectory[0, -1])) for e in results if not e.failure]
        ahead = max((100 * float(e.trajectory[0, :, 0].max()) for e in results if not e.failure), default=0)
        print(
            f"{size:7}  {len(group):6}  {len(bad):8}  {seconds:15.2f}"
            f"  {np.median(net) if net else 0:28.1f}  {ahead:18.1f}",
            flush=True,
        )
        for e in bad:
            print(f"         robot {e.solution.number}, {e.solution.morphology}: {e.failure}")
    print(f"{failed} of {len(solutions)} diverged")
    return int(failed > 0)


def _corridor(width: float) -> Task:
    def walls(_target: int, _n_modules: int) -> tuple[Wall, ...]:
        aside = width / 2.0 + 0.02
        return (
            Wall(centre=(-0.3, aside, 0.06), half_size=(0.9, 0.02, 0.06), yaw=0.05),
            Wall(centre=(-0.3, -aside, 0.06), half_size=(0.9, 0.02, 0.06)),
            Wall(centre=(0.05, 0.0, 0.01), half_size=(0.02, width / 2.0, 0.01), yaw=0.3),
        )

    return dataclasses.replace(SQUEEZING, walls=walls)


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
