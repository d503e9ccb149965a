"""How far the kernel's robots are from MuJoCo's after whole trials: ``python -m benchmarks.agreement``.

Random robots with random networks are simulated without noise by both, from the drop on, MuJoCo solving by
Newton's method to 1e-12. Where rods hit rods, rounding decides which way a robot goes, and single robots end
up apart. Exits with 1 if the median head, or the way it went, is more than ``LIMIT`` off.
"""

from __future__ import annotations

import dataclasses
import os
import random
import sys
import time
from collections.abc import Sequence
from typing import Final

import numpy as np
import tyro

from engine.body.module import MAX_MODULES, MIN_MODULES, N_STIFFNESS_LEVELS
from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.control.operators import Neat
from engine.simulation.physics import Physics, Simulator
from engine.simulation.trials import TrialConfig, start_trials, trials_of
from engine.tasks import GOAL_REACHING, Task, get_task

LIMIT: Final = 1e-4
"""In m: a sixth of what two noise seeds differ by."""
SEEN: Final = 1e-3
"""In m: a robot that is farther off is named."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arguments:
    """Compare the kernel with MuJoCo."""

    task: str = GOAL_REACHING.name
    """Whose world the robots are in."""
    robots: int = 20
    """How many; sizes and stiffness levels take turns."""
    seed: int = 0
    """Of faces and networks."""
    trial_time: float = 40.0
    """Seconds of every trial."""
    threads: int = os.cpu_count() or 1
    """Threads that simulate."""


def main(a: Arguments) -> int:
    """Run and return the exit status."""
    task = get_task(a.task)
    rng, neat = random.Random(a.seed), Neat(n_inputs=task.n_inputs)
    sizes = range(MIN_MODULES, MAX_MODULES + 1)
    robots = []
    for k in range(a.robots):
        faces = tuple(rng.randint(1, 8) for _ in range(sizes[k % len(sizes)]))
        robots.append((Morphology(1 + k % N_STIFFNESS_LEVELS, faces), neat.random(rng)))
    simulators: tuple[Simulator, ...] = ("kernel", "mujoco")
    paths, heads, seconds = {}, {}, {}
    for simulator in simulators:
        started = time.process_time()
        paths[simulator], heads[simulator] = _simulate(robots, task, simulator, a)
        seconds[simulator] = time.process_time() - started
    off = np.linalg.norm(paths["kernel"] - paths["mujoco"], axis=-1)
    for what, values in (("at the end", off[..., -1]), ("at their farthest", off.max(axis=-1))):
        median, upper, most = 100 * np.percentile(values, [50, 75, 100])
        print(
            f"{values.size} heads differ {what} of {a.trial_time:g} s by {median:.1e} cm in the median,"
            f" {upper:.1e} cm in the upper quartile, {most:.1e} cm at most"
        )
    for k, (body, _) in enumerate(robots):
        if off[k].max() > SEEN:
            size = f"{body.n_modules} modules, stiffness {body.stiffness_text}"
            print(f"  robot {k}, {size}: {100 * off[k].max():.1e} cm")
    same = sum(x == y for x, y in zip(heads["kernel"], heads["mujoco"], strict=True))
    print(f"{same} of {a.robots} robots have the same head")
    print(f"CPU seconds: kernel {seconds['kernel']:.1f} (compiling included), MuJoCo {seconds['mujoco']:.1f}")
    return int(np.median(off.max(axis=-1)) > LIMIT or same < a.robots)


def _simulate(
    robots: Sequence[tuple[Morphology, Controller]], task: Task, simulator: Simulator, a: Arguments
) -> tuple[np.ndarray, list[bool]]:
    """Return (robots, targets, seconds + 1, 2) heads in m, and whether each robot's head is its end."""
    paths, heads = [np.empty(0)] * len(robots), [False] * len(robots)
    for n in range(MIN_MODULES, MAX_MODULES + 1):
        members = [k for k, (body, _) in enumerate(robots) if body.n_modules == n]
        if not members:
            continue
        started = start_trials(
            [robots[k][0] for k in members],
            [robots[k][1] for k in members],
            trials_of(task, n, 1),
            numbers=members,
            run_seed=0,
            task=task,
            physics=Physics(simulator=simulator, servo_noise=0.0),
            times=TrialConfig(),
            n_threads=a.threads,
        )
        results = started.loop.run(a.trial_time)
        for k, result, head in zip(members, results, started.heads, strict=True):
            paths[k], heads[k] = result.trajectory, head.is_end
    return np.array(paths), heads


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
