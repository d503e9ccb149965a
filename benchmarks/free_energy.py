"""Whether robots gain from the simulator's errors: ``python -m benchmarks.free_energy RUN``.

The run's best elites are evaluated with fresh noise, N times with the run's time step and N times with a
quarter of it, the same noise for both. An elite falls short if the means of the two sets of fitnesses
differ by more than the spread, which is twice their pooled standard deviation; with 8 evaluations each,
chance alone does that to one elite in 750. Robots whose servos are off must come to rest.

Exits with 1 if a row falls short.
"""

from __future__ import annotations

import dataclasses
import os
import random
import sys
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import tyro

from engine.analysis.verify import Samples, changed_physics, resimulate
from engine.body.module import MAX_MODULES, MIN_MODULES, N_STIFFNESS_LEVELS
from engine.body.morphology import Morphology
from engine.config import RunConfig
from engine.control.operators import Neat
from engine.errors import RunFileError, TensAtlasError
from engine.simulation.batch import Span
from engine.simulation.evaluation import Evaluation
from engine.simulation.physics import Physics, Simulator
from engine.simulation.rollout import Head
from engine.simulation.trials import Trial, TrialConfig, start_trials
from engine.storage.reader import RunReader
from engine.tasks import GOAL_REACHING, get_task

QUARTER: Final = 0.25
REST: Final = 0.0001
"""Largest mean speed in m/s of a module's centre, over the last half of the time, that counts as rest."""
ARCHIVE: Final = "morphology"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arguments:
    """Look for free energy in a run's elites and in passive robots."""

    run: tyro.conf.Positional[Path]
    """Run file."""
    elites: int = 20
    """How many of the best elites by body; 0 leaves them out."""
    seeds: Annotated[int, tyro.conf.arg(metavar="N")] = 8
    """Evaluations with each time step, at least 2."""
    simulator: Simulator | None = None
    """What simulates; by default what the run was made with."""
    passive: int = 10
    """Random robots to drop with their servos off; 0 leaves them out."""
    passive_time: float = 20.0
    """Seconds in which they must come to rest."""
    threads: int = os.cpu_count() or 1
    """Threads that simulate."""


def main(arguments: Arguments) -> int:
    """Run and return the exit status.

    Raises:
        TensAtlasError: the run cannot be read or a number is out of range.
    """
    with RunReader(arguments.run) as reader:
        config = reader.config
        last = reader.last_generation()
        if last is None:
            raise RunFileError(f"{arguments.run} has no archives yet")
        held = reader.contents(ARCHIVE, last).values()
    physics = changed_physics(config.physics, simulator=arguments.simulator)
    best = sorted(held, key=_fitness)[: arguments.elites]
    well = True
    if best:
        well &= _elites(arguments, config, physics, best)
    if arguments.passive:
        well &= _passive(arguments, physics)
    print("no row falls short" if well else "a row falls short")
    return int(not well)


def differs(own: Samples, other: Samples) -> tuple[float, float] | None:
    """Return the difference of two means and the spread, twice the pooled standard deviation, in m.

    None if an evaluation failed or there are fewer than two of each.
    """
    if own.n_failed or other.n_failed or own.deviation is None or other.deviation is None:
        return None
    assert own.mean is not None
    assert other.mean is not None
    pooled = np.sqrt((own.deviation**2 + other.deviation**2) / 2.0)  # as many of each
    return other.mean - own.mean, float(2.0 * pooled)


def _elites(a: Arguments, config: RunConfig, physics: Physics, best: list[Evaluation]) -> bool:
    start = get_task(config.task).target_distance
    quarter = changed_physics(physics, timestep_factor=QUARTER)
    print(
        f"{len(best)} best elites of {a.run.name}, f_s in cm over {a.seeds} fresh evaluations each with time"
        f" steps of {1000 * physics.timestep:g} and {1000 * quarter.timestep:g} ms; the motion is that with"
        f" the run's step\n"
        " robot  modules  stiffness  recorded     at the step     at a quarter  difference  spread"
        "  airborne  height, cm  speed, m/s  verdict"
    )
    well, differences = True, []
    for e in best:
        own, other = (
            resimulate(config, e, physics=p, n_seeds=a.seeds, n_threads=a.threads) for p in (physics, quarter)
        )
        body, motion, found = e.solution.morphology, own.motion, differs(own, other)
        if found:
            differences.append(-100 * found[0])
        good = found is not None and abs(found[0]) <= found[1]
        well &= good
        print(
            f"{e.solution.number:6} {body.n_modules:8} {body.stiffness_text:>10}"
            f" {100 * (start - _fitness(e)):9.2f} {_mean(start, own)} {_mean(start, other)}"
            + (f" {-100 * found[0]:11.2f} {100 * found[1]:7.2f}" if found else f" {'-':>11} {'-':>7}")
            + f" {motion.airborne:9.2%} {100 * motion.height:11.1f} {motion.speed:11.3f}"
            + f"  {'holds' if good else 'falls short' if found else 'an evaluation failed'}",
            flush=True,
        )
    if len(differences) > 1:
        error = np.std(differences, ddof=1) / np.sqrt(len(differences))
        print(f"mean difference: {np.mean(differences):.2f} cm, standard error {error:.2f} cm")
    return well


def _passive(a: Arguments, physics: Physics) -> bool:
    rng = random.Random(0)
    half = a.passive_time / 2.0
    print(
        f"\npassive robots, {half:g} to {a.passive_time:g} s after the drop\n"
        "modules  stiffness  moved, mm  mm/s  jitter, mm/s  verdict"
    )
    well, fastest = True, 0.0
    for k in range(a.passive):
        n = MIN_MODULES + k % (MAX_MODULES - MIN_MODULES + 1)
        body = Morphology(rng.randint(1, N_STIFFNESS_LEVELS), tuple(rng.randint(1, 8) for _ in range(n)))
        centres, failed = _settled(body, physics, a)
        moved = float(np.linalg.norm(centres[-1] - centres[len(centres) // 2 - 1], axis=-1).max())
        jitter = float(np.linalg.norm(centres[-1] - centres[-2], axis=-1).max()) / physics.control_period
        good = moved <= REST * half and not failed
        well, fastest = well and good, max(fastest, moved / half)
        print(
            f"{n:7} {body.stiffness:10.1f} {1000 * moved:10.3f} {1000 * moved / half:5.3f}"
            f" {1000 * jitter:13.3f}  {'rests' if good else 'falls short'}",
            flush=True,
        )
    print(f"largest residual speed: {1000 * fastest:.4f} mm/s")
    return well


def _settled(body: Morphology, physics: Physics, a: Arguments) -> tuple[np.ndarray, bool]:
    """Drop a robot with its servos off.

    Returns:
        (updates, modules, 3) centres of its modules in m after every control update, and whether it failed.
    """
    spans: list[Span] = []
    started = start_trials(
        [body],
        [Neat(n_inputs=GOAL_REACHING.n_inputs).random(random.Random(0))],
        [Trial(0, 0, np.array([1.0, 0.0]), ())],
        numbers=[0],
        run_seed=0,
        task=GOAL_REACHING,
        physics=physics,
        times=TrialConfig(settle_time=a.passive_time),
        heads=[Head.of(body, True)],
        n_threads=a.threads,
        observer=spans.append,
    )
    qpos = Span.joined(spans).qpos
    return qpos.reshape(len(qpos), body.n_modules, -1, 7)[..., :3].mean(axis=2), bool(started.settling[0])


def _mean(start: float, samples: Samples) -> str:
    if samples.mean is None or samples.deviation is None:
        return f"{'-':>16}"
    return f"{100 * (start - samples.mean):8.2f} ± {100 * samples.deviation:5.2f}"


def _fitness(e: Evaluation) -> float:
    assert e.fitness is not None  # an elite has one
    return e.fitness


if __name__ == "__main__":
    try:
        sys.exit(main(tyro.cli(Arguments)))
    except TensAtlasError as error:
        sys.exit(f"free_energy: {error}")
