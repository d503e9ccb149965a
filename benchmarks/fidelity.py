"""Replay what was measured on the published simulator: ``python -m benchmarks.fidelity``.

Prints a table with a verdict for every figure and exits with 1 if one falls short.
"""

from __future__ import annotations

import dataclasses
import os
import sys

import tyro
from rich.console import Console

from benchmarks import population_fidelity as population
from benchmarks import reference
from benchmarks import static_fidelity as static
from benchmarks.rows import Row, show
from engine.simulation.physics import Physics

QUICK_STIFFNESS = (0.1, 0.5, 1.0)
QUICK_MODULES = 5


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arguments:
    """Compare shapes and locomotion with the published simulator's."""

    quick: bool = False
    """Three stiffnesses, small robots, one run each: under a minute instead of about ten."""
    convergence: bool = True
    """Also repeat with a quarter of the time step, which takes most of the time."""
    threads: int = os.cpu_count() or 1
    """Threads that simulate."""
    physics: Physics = dataclasses.field(default_factory=Physics)
    """How robots are simulated."""


def tables(arguments: Arguments) -> dict[str, list[Row]]:
    """Return the tables, by title."""
    physics = arguments.physics
    finer = dataclasses.replace(physics, timestep=physics.timestep / 4)
    stiffness = QUICK_STIFFNESS if arguments.quick else None
    robots = reference.robots()
    runs: tuple[int, ...] = population.RUNS
    if arguments.quick:
        robots = [r for r in robots if r.morphology.n_modules <= QUICK_MODULES]
        runs = (0, 1)
    ours = population.replay(robots, physics, runs=runs, n_threads=arguments.threads)
    result = {
        "One module, no gravity": static.floating_rows(physics, stiffness),
        "On the ground": static.ground_rows(physics, max_modules=4 if arguments.quick else 10),
        f"Locomotion of {len(robots)} robots": population.rows(
            robots, ours, population.published(robots, runs)
        ),
    }
    if arguments.convergence:
        fine = population.replay(robots, finer, runs=runs[::2], n_threads=arguments.threads)
        result["Convergence"] = [
            static.convergence_row(physics, finer, stiffness),
            *population.convergence_rows(ours, fine),
        ]
    return result


def main(arguments: Arguments) -> int:
    """Print the tables and return the exit status."""
    console = Console(width=None if sys.stdout.isatty() else 160, highlight=False)
    short = 0
    for title, rows in tables(arguments).items():
        show(title, rows, console)
        short += sum(row.passed is False for row in rows)
    console.print("every figure is met" if not short else f"{short} figures fall short")
    return int(short > 0)


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
