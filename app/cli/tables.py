"""The commands ``table`` and ``project``."""

from __future__ import annotations

from rich.console import Console

from app.cli import commands as c
from app.cli.progress import counting
from engine.analysis.elite_table import elite_table, write_table
from engine.analysis.projection_run import UP, project_run
from engine.storage.reader import RunReader


def write_elites(command: c.Table, console: Console) -> None:
    """Write a run's elites as a table."""
    with RunReader(command.run) as reader:
        table = elite_table(reader, command.archive)
    write_table(table, command.out)
    console.print(f"Wrote {len(table['index'])} elites to {command.out}", markup=False)


def project(command: c.Project, console: Console) -> None:
    """Write a projected run and say what became of its elites."""
    with counting(console, "simulating again") as observer:
        report = project_run(command.run, command.out, n_threads=command.workers, observer=observer)
    held = " and ".join(f"{n} of {name}" for name, n in report.n_elites.items())
    filled = " and ".join(f"{n} cells of {name}" for name, n in report.filled.items())
    say = [f"Projected {held} onto {filled}: {report.kind}."]
    if report.n_resimulated:
        say.append(f"{report.n_resimulated} robots without a trajectory were simulated again.")
    if report.n_differing:
        say.append(
            f"{report.n_differing} of them did not repeat their recorded fitness to the last bit (another"
            " MuJoCo or another processor): where they lie in the map is not certain."
        )
    if report.kind == UP and report.n_clipped:
        say.append(
            f"{report.n_clipped} robots lie outside the final bounds of the components and went to the"
            " nearest cell."
        )
    say.append(f"Look at it with: tensatlas explore {command.out}")
    console.print(" ".join(say), markup=False)
