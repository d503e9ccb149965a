"""What simulating costs: ``python -m benchmarks.simulation``.

Prints, for robots of 2 to 10 modules, CPU seconds of one simulation of 43 s, settling, controller and
noise included: alone on one thread, and as one of eight of the same robot, as in an evaluation. Then the
same at the real inertia, and what evaluating a mixed batch costs. Exits with 1 if a goal is missed or a
simulation diverged: alone a tenth of the published simulator's time at every size; in the company of an
evaluation at most 10 % of the time outside MuJoCo's step.
"""

from __future__ import annotations

import dataclasses
import random
import sys
from collections.abc import Sequence
from typing import Final

import numpy as np
import tyro

from benchmarks.timing import Timed, machine, median_cpu, simulate, timed
from engine.body.module import MAX_MODULES, MIN_MODULES, N_STIFFNESS_LEVELS
from engine.body.morphology import Morphology
from engine.control.genome import Controller, Neat
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics, with_inertia
from engine.simulation.trials import TrialConfig
from engine.tasks import GOAL_REACHING, SETTLE_TIME, TRIAL_TIME

PUBLISHED: Final = {2: 5.2, 4: 10.0, 6: 15.0, 8: 23.0, 10: 28.0}
"""CPU seconds of the published simulator by number of modules, on a machine like those of today: medians
over relative stiffness 0.1, 0.5 and 1.0."""
STIFFNESS_LEVELS: Final = (5, 1, 10)
COPIES: Final = 8
SPEEDUP_GOAL: Final = 10.0
OUTSIDE_GOAL: Final = 0.1
N_MUTATIONS: Final = 5

Robot = tuple[Morphology, Controller]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arguments:
    """Time simulations of random robots."""

    robots: int = 3
    """Robots per size; relative stiffness 0.5, 0.1 and 1.0 take turns."""
    repeats: int = 3
    """Times each simulation alone is timed; the median counts."""
    batch: int = 24
    """Robots of the mixed batch; 0 leaves it out."""
    sizes: tuple[int, ...] = tuple(PUBLISHED)
    """Numbers of modules, of 2, 4, 6, 8 and 10."""
    seed: int = 0
    """Of faces and networks."""
    settle_time: float = SETTLE_TIME
    """Seconds of settling; the published times are of 3."""
    trial_time: float = TRIAL_TIME
    """Seconds of a trial; the published times are of 40."""
    quick: bool = False
    """One robot per size, timed once, and a mixed batch of six."""


def main(arguments: Arguments) -> int:
    """Run and return the exit status."""
    if arguments.quick:
        arguments = dataclasses.replace(arguments, robots=1, repeats=1, batch=min(6, arguments.batch))
    print(machine())
    rng, neat = random.Random(arguments.seed), Neat(n_inputs=GOAL_REACHING.n_inputs)
    robots = {
        n: [
            (_body(rng, STIFFNESS_LEVELS[k % len(STIFFNESS_LEVELS)], n), neat.random(rng))
            for k in range(arguments.robots)
        ]
        for n in arguments.sizes
    }
    goals, alone = _cost(arguments, robots)
    goals &= _inertia(arguments, robots, alone)
    if arguments.batch:
        goals &= _mixed_batch(arguments, rng, neat)
    print("every goal reached" if goals else "a goal was missed or a simulation diverged")
    return int(not goals)


def _cost(a: Arguments, robots: dict[int, list[Robot]]) -> tuple[bool, dict[int, list[Timed]]]:
    """Print the table of costs; return whether the goals were reached, and a run per robot alone."""
    seconds = a.settle_time + a.trial_time
    scale = seconds / (SETTLE_TIME + TRIAL_TIME)
    physics = Physics()
    print(f"\nCPU s of one simulation of {seconds:g} s, time step {1000 * physics.timestep:g} ms")
    if scale != 1.0:
        print(f"published times scaled to {seconds:g} s")
    print(
        f"         ------------- alone -------------  ------- as one of {COPIES} -------  per minute, threads"
        "\nmodules   CPU s  us/step  outside    ratio   CPU s  us/step  outside    1 thread   2 threads"
        "   published  verdict"
    )
    reached, kept = True, {}
    for n, members in robots.items():
        runs = [_repeated(a, r, physics) for r in members]
        kept[n] = [r[0] for r in runs]
        cpu = float(np.median([median_cpu(r) for r in runs]))
        outside = float(np.median([r.clock.outside for group in runs for r in group]))
        one, two = (_simulate(a, members[0], physics, copies=COPIES, n_threads=k) for k in (1, 2))
        steps, ratio = kept[n][0].n_steps, scale * PUBLISHED[n] / cpu
        failed = any(r.failed for r in [*kept[n], one, two])
        missed = [
            text
            for text, bad in (
                ("not a tenth", ratio < SPEEDUP_GOAL),
                ("too much outside", one.clock.outside > OUTSIDE_GOAL),
                ("diverged", failed),
            )
            if bad
        ]
        reached &= not missed
        each = one.clock.cpu / COPIES
        print(
            f"{n:7} {cpu:7.2f} {1e6 * cpu / steps:8.1f} {outside:8.1%} {ratio:6.1f} x"
            f" {each:7.2f} {1e6 * each / steps:8.1f} {one.clock.outside:8.1%}"
            f" {60 * COPIES / one.clock.wall:11.1f} {60 * COPIES / two.clock.wall:11.1f}"
            f" {scale * PUBLISHED[n]:11.2f}  {', '.join(missed) or 'reached'}",
            flush=True,
        )
    return reached, kept


def _inertia(a: Arguments, robots: dict[int, list[Robot]], scaled: dict[int, list[Timed]]) -> bool:
    """Print what the real inertia costs and changes; return whether no robot diverged."""
    physics = with_inertia(Physics(), 1.0)
    print(
        f"\ninertia_scale 1, time step {1000 * physics.timestep:g} ms, against {Physics().inertia_scale:g}:"
        " CPU s alone, and medians of the head's displacement and 1 Hz path, cm"
        "\nmodules   CPU s    price   diverged     net: 1   scaled    path: 1   scaled"
    )
    all_real: list[Timed] = []
    for n, members in robots.items():
        real = [_simulate(a, r, physics) for r in members]
        all_real += real
        _print_inertia(f"{n:7}", real, scaled[n])
    _print_inertia("    all", all_real, [r for runs in scaled.values() for r in runs])
    return not any(r.failed for r in all_real)


def _print_inertia(label: str, real: Sequence[Timed], scaled: Sequence[Timed]) -> None:
    price = median_cpu(real) / median_cpu(scaled)
    net = [_median_cm([r.net for r in runs if not r.failed]) for runs in (real, scaled)]
    path = [_median_cm([r.path for r in runs if not r.failed]) for runs in (real, scaled)]
    print(
        f"{label} {median_cpu(real):7.2f} {price:6.1f} x {sum(r.failed for r in real):10}"
        f" {net[0]:10.1f} {net[1]:8.1f} {path[0]:10.1f} {path[1]:8.1f}",
        flush=True,
    )


def _median_cm(lengths: Sequence[float]) -> float:
    return 100.0 * float(np.median(lengths)) if lengths else float("nan")


def _mixed_batch(a: Arguments, rng: random.Random, neat: Neat) -> bool:
    """Print what evaluating a mixed batch costs; return whether the goal was reached."""
    solutions = []
    for k in range(a.batch):
        controller = neat.random(rng)
        for _ in range(N_MUTATIONS):
            controller = neat.mutate(controller, rng)
        body = _body(rng, rng.randint(1, N_STIFFNESS_LEVELS), rng.randint(MIN_MODULES, MAX_MODULES))
        solutions.append(Solution(number=k, morphology=body, controller=controller))
    trials = TrialConfig(repeats=2, settle_time=a.settle_time, trial_time=a.trial_time)
    evaluator = LocalEvaluator(task=GOAL_REACHING, physics=Physics(), trials=trials, run_seed=a.seed)
    build_robot.cache_clear()
    with timed() as clock:
        found = [e for group in evaluator.evaluate(solutions) for e in group]
    failed = sum(e.failure is not None for e in found)
    reached = clock.outside <= OUTSIDE_GOAL and not failed
    print(
        f"\nmixed batch of {len(found)} robots, {GOAL_REACHING.n_targets * trials.repeats} simulations each,"
        f" and the search for its head: {clock.cpu / len(found):.2f} CPU s per evaluation,"
        f" {clock.outside:.1%} outside MuJoCo's step, {failed} diverged:"
        f" {'reached' if reached else 'missed'}",
        flush=True,
    )
    return reached


def _repeated(a: Arguments, robot: Robot, physics: Physics) -> list[Timed]:
    return [_simulate(a, robot, physics) for _ in range(a.repeats)]


def _simulate(a: Arguments, robot: Robot, physics: Physics, *, copies: int = 1, n_threads: int = 1) -> Timed:
    return simulate(
        *robot,
        physics=physics,
        copies=copies,
        n_threads=n_threads,
        settle_time=a.settle_time,
        trial_time=a.trial_time,
    )


def _body(rng: random.Random, level: int, n_modules: int) -> Morphology:
    return Morphology(level, tuple(rng.randint(1, 8) for _ in range(n_modules)))


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
