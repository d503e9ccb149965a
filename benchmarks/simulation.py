"""What simulating costs: ``python -m benchmarks.simulation``.

Prints CPU time on one core: of time steps, beside MuJoCo's batch in the same run and the least that a
processor needs; of evaluations, and what runs of the presets take by that; of a whole replay. Exits with 1 if
a figure falls short.

The least is counted: a step is done again in Python, function by function as the kernel has them, with
vectors that count their operations (``benchmarks.counting``). A core with vectors of eight doubles is taken
to do two sums and two products, two loads and one store in a cycle, and a quotient or a root in eight, at
4 GHz, nothing ever waiting for anything.
"""

from __future__ import annotations

import dataclasses
import random
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from benchmarks.rows import Row, show
from benchmarks.steps import CORRIDOR, OPEN, cost, parts
from benchmarks.timing import Clock, machine, timed
from engine.body.morphology import Morphology
from engine.config import RunConfig, bodies_of, preset, replaced, task_of
from engine.control.operators import Neat
from engine.replay.replay import Replay
from engine.runs.evolve import evolve
from engine.simulation.compile_kernel import compile_kernel
from engine.simulation.evaluation import Evaluation, Solution
from engine.simulation.kernel.batch import widest
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics, with_inertia
from engine.simulation.trials import TrialConfig
from engine.workers.evaluator import create_evaluator
from engine.workers.processes import ProcessWorkers

RATIO: Final = 15.0
"""What a step of MuJoCo's batch with PGS, by which runs were once made, takes of the kernel's."""
EVALUATION: Final = 0.5
"""CPU seconds of an evaluation of eight simulations of 43 s."""
OUTSIDE: Final = 0.15
QUICK: Final = 90.0
"""Seconds of a run of preset ``quick`` on two cores."""
PAPER: Final = 7.0
"""Core hours of a run of preset ``paper``."""
REPLAY: Final = 0.3
"""Seconds to compute a replay of 40 s of ten modules."""
CORES: Final = 2
N_MUTATIONS: Final = 5


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arguments:
    """Measure what simulating costs."""

    sizes: tuple[int, ...] = (2, 6, 10)
    """Numbers of modules whose steps are timed; the last one's replay, too."""
    robots: int = 3
    """Robots per size; relative stiffness 0.5, 0.1 and 1.0 take turns."""
    seconds: float = 2.0
    """Seconds of crawling whose steps are timed, after 3 s of settling."""
    batch: int = 24
    """Robots of all sizes that are evaluated."""
    trials: TrialConfig = TrialConfig()
    """Of an evaluation; figures of whole runs take those of their presets to cost as much per second."""
    whole: bool = False
    """Let two processes work through a run of preset quick as well; otherwise its time is worked out."""
    seed: int = 0
    """Of bodies, networks and gaits."""


def main(arguments: Arguments) -> int:
    """Run and return the exit status."""
    a, console = arguments, Console()
    console.print(machine())
    console.print(f"vectors of {widest()}; loaded or compiled in {compile_kernel():.1f} CPU s")
    reached = _show_steps(a, console)
    rows = [*_evaluation_rows(a), *_run_rows(a), _replay_row(a)]
    show("What simulating costs, CPU time on one core", rows, console)
    passed = reached and all(row.passed is not False for row in rows)
    console.print("every figure is met" if passed else "a figure falls short")
    return int(not passed)


def _show_steps(a: Arguments, console: Console) -> bool:
    """Print what steps cost, in the open and between walls; return whether the goal is met."""
    table = Table(title="A time step of one simulation of eight, in microseconds", title_justify="left")
    for heading in (
        "robots",
        "kernel",
        "Newton",
        "PGS",
        "PGS / kernel",
        "at least",
        "kernel / least",
        "operations",
        "of them / and root",
        "loads + stores",
        "kB of 8",
        "sweeps",
        "coupled",
    ):
        table.add_column(heading, justify="left" if heading == "robots" else "right")
    reached = True
    for name, walls in (("", OPEN), (", squeezed", CORRIDOR)):
        for n in a.sizes:
            c = cost(n, robots=a.robots, seconds=a.seconds, seed=a.seed, walls=walls)
            reached &= bool(walls) or c.pgs / c.kernel >= RATIO
            table.add_row(
                f"{n} modules{name}",
                f"{c.kernel:.2f}",
                f"{c.newton:.1f}",
                f"{c.pgs:.1f}",
                f"{c.pgs / c.kernel:.1f}",
                f"{c.floor:.2f}",
                f"{c.kernel / c.floor:.1f}",
                f"{c.operations:,.0f}",
                f"{c.dear:,.0f}",
                f"{c.traffic:,.0f}",
                f"{c.memory / 1000:.0f}",
                f"{c.sweeps:.1f}",
                f"{c.coupled:.1f}",
            )
    console.print(table)
    console.print(f"wanted: a {RATIO:g}th of PGS's time in the open: {'ok' if reached else 'short'}")
    shares = parts(a.sizes[-1], seed=a.seed).items()
    console.print(
        f"operations of {a.sizes[-1]} modules that crawl: " + ", ".join(f"{k} {v:.0%}" for k, v in shares)
    )
    return reached


def _evaluation_rows(a: Arguments) -> list[Row]:
    """Evaluate a mixed batch."""
    config = replaced(RunConfig(), trials=a.trials, seed=a.seed)
    clock, found = _evaluated(config, _mixed(config, a))
    each, failed = clock.cpu / len(found), sum(e.failure is not None for e in found)
    copies, length = task_of(config).n_targets * a.trials.repeats, a.trials.settle_time + a.trials.trial_time
    return [
        Row(
            f"an evaluation, {copies} simulations of {length:g} s, of {len(found)} robots of all sizes",
            f"{each:.3f} CPU s; {failed} diverged",
            f"at most {EVALUATION:g} CPU s",
            each <= EVALUATION and not failed,
        ),
        Row(
            "share outside the kernel's compiled code",
            f"{clock.outside:.1%}",
            f"at most {OUTSIDE:.0%}",
            clock.outside <= OUTSIDE,
        ),
        _inertia_row(a),
    ]


def _inertia_row(a: Arguments) -> Row:
    """Evaluate one robot at the real inertia."""
    scaled = replaced(RunConfig(), trials=dataclasses.replace(a.trials, repeats=1), seed=a.seed)
    body = Morphology(5, (1,) * a.sizes[len(a.sizes) // 2])
    solution = dataclasses.replace(_mixed(scaled, a)[0], morphology=body)
    real = replaced(scaled, physics=with_inertia(Physics(), 1.0))
    cpu = [_evaluated(config, [solution])[0].cpu for config in (scaled, real)]
    return Row(
        f"price of the real inertia, {body.n_modules} modules",
        f"{cpu[1] / cpu[0]:.1f} times the CPU time",
        "",
    )


def _run_rows(a: Arguments) -> list[Row]:
    """Work out, or measure, what whole runs take."""
    rows = []
    for name in ("quick", "paper"):
        config = replaced(preset(name), seed=a.seed)
        scale = 1.0
        if a.trials != TrialConfig():  # a shorter batch stands for a whole one
            scale = config.trials.trial_time / a.trials.trial_time
            config = replaced(config, trials=dataclasses.replace(a.trials, repeats=config.trials.repeats))
        clock, found = _evaluated(config, _mixed(config, a))
        cpu = config.evaluations * scale * clock.cpu / len(found)
        if name == "quick":
            seconds = cpu / CORES
            rows.append(_quick_row(f"by {len(found)} robots", seconds))
        else:
            ours = f"{cpu / 3600:.1f} core hours, by {len(found)} robots"
            rows.append(Row("a run of preset paper", ours, f"at most {PAPER:g}", cpu / 3600 <= PAPER))
    if a.whole:
        with tempfile.TemporaryDirectory() as folder, ProcessWorkers(CORES) as workers:
            started = time.monotonic()
            evolve(Path(folder) / "quick.tsmr", replaced(preset("quick"), seed=a.seed), workers=workers)
            rows.append(_quick_row("wall time", time.monotonic() - started))
    return rows


def _quick_row(how: str, seconds: float) -> Row:
    return Row(
        f"a run of preset quick on {CORES} cores",
        f"{seconds:.0f} s, {how}",
        f"at most {QUICK:g} s",
        seconds <= QUICK,
    )


def _replay_row(a: Arguments) -> Row:
    """Compute whole replays."""
    config = replaced(RunConfig(), trials=dataclasses.replace(a.trials, repeats=1), seed=a.seed)
    n, times = a.sizes[-1], []
    for k, solution in enumerate(_mixed(config, a)[: a.robots]):
        faces = solution.morphology.faces
        body = Morphology(solution.morphology.stiffness_level, tuple(np.resize(faces, n).tolist()))
        evaluation = _unevaluated(config, dataclasses.replace(solution, number=k, morphology=body))
        started = time.process_time()
        Replay(config, evaluation).advance(config.trials.trial_time)
        times.append(time.process_time() - started)
    seconds = float(np.median(times))
    return Row(
        f"a whole replay of {config.trials.trial_time:g} s of {n} modules",
        f"{1000 * seconds:.0f} ms",
        f"at most {1000 * REPLAY:.0f} ms",
        seconds <= REPLAY,
    )


def _unevaluated(config: RunConfig, solution: Solution) -> Evaluation:
    """Return what a replay needs to know of a robot."""
    nothing = np.zeros((task_of(config).n_targets, 1))
    return Evaluation(
        solution=solution, fitness=0.0, distances=nothing, trajectory=nothing, head_is_end=True, failure=None
    )


def _evaluated(config: RunConfig, solutions: Sequence[Solution]) -> tuple[Clock, list[Evaluation]]:
    """Evaluate solutions on one thread, models and all."""
    build_robot.cache_clear()
    with timed() as clock:
        found = [e for group in create_evaluator(config).evaluate(solutions) for e in group]
    return clock, found


def _mixed(config: RunConfig, a: Arguments) -> list[Solution]:
    """Return robots of all sizes with networks that have grown a little."""
    rng, neat, found = random.Random(a.seed), Neat(n_inputs=task_of(config).n_inputs), []
    for k in range(a.batch):
        controller = neat.random(rng)
        for _ in range(N_MUTATIONS):
            controller = neat.mutate(controller, rng)
        body = bodies_of(config).draw(rng)
        found.append(Solution(number=k, morphology=body, controller=controller))
    return found


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
