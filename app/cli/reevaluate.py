"""The command ``reevaluate``: how much of each map's fitness was luck."""

from __future__ import annotations

import dataclasses
import functools
import os
from pathlib import Path
from typing import TYPE_CHECKING

import tyro
from rich.console import Console
from rich.table import Table

from app.cli.progress import counting
from app.worker_flags import check_workers
from engine.analysis.reevaluation import BuiltOf, reevaluate
from engine.analysis.robustness import MapRobustness, robust_path
from engine.analysis.run_files import run_files
from engine.errors import as_typed, printable
from engine.files import readable_json
from engine.storage.reader import RunReader

if TYPE_CHECKING:
    from engine.simulation.physics import Physics


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reevaluate:
    """Simulate elites again under fresh noise and say how much of their map's fitness was luck.

    Keeps the results beside each run, in NAME.robust.json or NAME.as_built.json, and continues from those
    that are there. ``compare`` shows the former, the app colours maps by either.
    """

    paths: tyro.conf.Positional[tuple[Path, ...]]
    """Run files, or folders of them."""
    repeats: int = 5
    """Evaluations of each elite, each of all targets and the run's repeats."""
    archive: str | None = None
    """The only map whose elites are evaluated; without it, all archives. compare needs the morphology map."""
    as_built: str | None = None
    """Simulate robots as they would be built of latex-sheet, tpu-85a, silicone-sheet or a materials file."""
    workers: int = os.cpu_count() or 1
    """Threads that simulate; the result does not depend on it."""
    json: bool = False
    """Print JSON."""

    def run(self, console: Console) -> None:
        """Simulate the elites again and print the results, as text or as JSON.

        Raises:
            InvalidData: a number is out of range, results from before are of another run or of other
                versions, or today's robots do not survive the run's physics.
            RunFileError: the run cannot be read or has no such archive, or the results cannot be written.
        """
        check_workers(self.workers)
        runs, notes = run_files(self.paths)
        for note in notes:
            console.print(f"tensatlas: note: {note}", markup=False)
        facts = []
        for run in runs:
            maps = self._reevaluate(run, console)
            facts += [{"run": str(run)} | dataclasses.asdict(m) for m in maps]
            if not self.json:
                self._print(run, maps, console, several=len(runs) > 1)
        if self.json:
            print(readable_json(facts))

    def _reevaluate(self, run: Path, console: Console) -> list[MapRobustness]:
        try:
            with counting(console, f"evaluating {printable(run.stem)} again") as observer:
                return reevaluate(
                    run,
                    robots=self._robots(run),
                    repeats=self.repeats,
                    archive=self.archive,
                    n_threads=self.workers,
                    observer=observer,
                )[1]
        except KeyboardInterrupt:
            console.print(
                "Stopped. What is finished is saved; the same command continues from there.", markup=False
            )
            raise

    def _robots(self, run: Path) -> BuiltOf | None:
        """Return what robots are built from and a run's physics with them, each evaluation another one."""
        if self.as_built is None:
            return None
        from engine.fabrication.as_built import search_physics
        from engine.fabrication.materials import load_materials

        with RunReader(run) as reader:
            physics, footed = reader.config.physics, reader.config.body.feet != "none"
        materials = load_materials(self.as_built)

        @functools.cache
        def of_level(level: int) -> Physics:
            return search_physics(physics, materials, spread=True, level=level, footed=footed)

        return self.as_built, of_level

    def _print(self, run: Path, maps: list[MapRobustness], console: Console, *, several: bool) -> None:
        out = Console(highlight=False)
        if several:
            out.print(f"\n{printable(str(run))}", markup=False, soft_wrap=True)
        out.print(_table(maps, self.repeats))
        for m in maps:
            out.print(_sentence(m), markup=False, soft_wrap=True)
        path = robust_path(run, as_built=self.as_built is not None)
        console.print(f"Kept in {as_typed(path)}", markup=False)


def _table(maps: list[MapRobustness], repeats: int) -> Table:
    table = Table(caption=f"f_s in cm; again: mean of {repeats} or more, fresh noise")
    table.add_column("")
    for m in maps:
        table.add_column(m.archive, justify="right")
    rows = {
        "elites": [
            f"{m.n_known} of {m.n_elites}" if m.n_known < m.n_elites else f"{m.n_elites}" for m in maps
        ],
        "best, as recorded": [_cm(m.best and m.best[0]) for m in maps],
        "the same robot, again": [_cm(m.best and m.best[1]) for m in maps],
        "best, again": [_cm(m.best_again) for m in maps],
        "mean, as recorded": [_cm(m.mean) for m in maps],
        "mean, again": [_cm(m.mean_again) for m in maps],
        "luck: mean ± s.d. over elites": [f"{_cm(m.luck)} ± {_cm(m.luck_deviation)}" for m in maps],
        "s.d. of one elite's evaluations": [_cm(m.deviation) for m in maps],
        "QD score, as recorded": [_cm(m.qd_score, 1) for m in maps],
        "QD score, corrected": [_cm(m.corrected_qd_score, 1) for m in maps],
    }
    if any(m.n_failed for m in maps):
        rows["evaluations that failed"] = [f"{m.n_failed}" for m in maps]
    for name, values in rows.items():
        table.add_row(name, *values)
    return table


def _sentence(m: MapRobustness) -> str:
    if m.luck is None:
        return f"{m.archive}: none of its elites could be evaluated again."
    way = "falls" if m.luck >= 0 else "rises"
    return (
        f"{m.archive}: evaluated again, an elite's f_s {way} by {_cm(abs(m.luck))} cm on average; the QD"
        f" score goes from {_cm(m.qd_score, 1)} to {_cm(m.corrected_qd_score, 1)} cm."
    )


def _cm(value: float | None, digits: int = 2) -> str:
    return "-" if value is None else f"{100 * value:.{digits}f}"
