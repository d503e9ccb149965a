"""The commands ``table`` and ``project``: a run's elites in another form."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import tyro
from rich.console import Console

from app.cli.progress import counting
from app.worker_flags import check_workers
from engine.analysis.elite_table import elite_table, write_table
from engine.analysis.evaluation_table import evaluation_table
from engine.analysis.projection_run import UP, project_run
from engine.errors import InvalidData, as_typed
from engine.storage.reader import RunReader


@dataclasses.dataclass(frozen=True, kw_only=True)
class Table:
    """Write a run's elites, or all its evaluations, as a table with pyribs' column names."""

    path: tyro.conf.Positional[Path]
    """Run file."""
    archive: str | None = None
    """The only archive to write; without it, all, told apart by the column ``archive``."""
    all: bool = False
    """Write every evaluation instead of the elites."""
    out: Path
    """File to write, *.csv or *.parquet."""

    def run(self, console: Console) -> None:
        """Write the table.

        Raises:
            InvalidData: both all evaluations and one archive are asked for.
            RunFileError: the run cannot be read or has no such archive.
            ExportError: the file's name ends in something else, or it cannot be written.
        """
        if self.all and self.archive is not None:
            raise InvalidData("--all writes every evaluation; leave out --archive")
        with RunReader(self.path) as reader:
            table = evaluation_table(reader) if self.all else elite_table(reader, self.archive)
        write_table(table, self.out)
        n, what = len(table["evaluation"]), "evaluations" if self.all else "elites"
        console.print(f"Wrote {n} {what} to {as_typed(self.out)}", markup=False)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Project:
    """Write a 4-D archive as its two 2-D maps, or two 2-D archives as one 4-D map: a run file again."""

    path: tyro.conf.Positional[Path]
    """Run file of MAP-Elites or DM-ME."""
    out: Path
    """Run file to create, *.tsmr."""
    workers: int = os.cpu_count() or 1
    """Threads that simulate elites without a trajectory; the result does not depend on it."""

    def run(self, console: Console) -> None:
        """Write the projected run, and report what happened to its elites.

        Raises:
            InvalidData: the number of workers is out of range.
            RunFileError: the run cannot be read or projected, or the new file cannot be written.
        """
        check_workers(self.workers)
        with counting(console, "simulating again") as observer:
            report = project_run(self.path, self.out, n_threads=self.workers, observer=observer)
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
        say.append(f"Look at it with: tensatlas explore {as_typed(self.out)}")
        console.print(" ".join(say), markup=False)
