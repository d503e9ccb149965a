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
FINER = (2, 4)
"""How many times finer steps are for the convergence."""


TWO_DIRECTIONS = "Locomotion, against two friction directions"
PUBLISHED = "Locomotion, against the published simulator"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arguments:
    """Compare shapes and locomotion with the published simulator's."""

    quick: bool = False
    """Three stiffnesses and chains of up to four modules at rest; everything about locomotion."""
    convergence: bool = True
    """Also repeat with a half and a quarter of the time step, which takes most of the time."""
    threads: int = os.cpu_count() or 1
    """Threads that simulate."""
    physics: Physics = dataclasses.field(default_factory=Physics)
    """How robots are simulated."""


def tables(arguments: Arguments) -> dict[str, list[Row]]:
    """Return the tables, by title."""
    physics = arguments.physics
    stiffness = QUICK_STIFFNESS if arguments.quick else None
    robots = reference.robots()
    ours = population.replay(robots, physics, n_threads=arguments.threads)
    result = {
        "One module, no gravity": static.floating_rows(physics, stiffness),
        "On the ground": static.ground_rows(physics, max_modules=4 if arguments.quick else 10),
        TWO_DIRECTIONS: population.against_two_directions(robots, ours),
        PUBLISHED: population.against_published(robots, ours, population.published(robots)),
    }
    if arguments.convergence:
        finer = {n: dataclasses.replace(physics, timestep=physics.timestep / n) for n in FINER}
        result["Convergence"] = [static.convergence_row(physics, finer[FINER[-1]], stiffness)]
        for factor, changed in finer.items():
            fine = population.replay(robots, changed, n_threads=arguments.threads)
            result["Convergence"] += population.convergence_rows(ours, fine, factor)
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
