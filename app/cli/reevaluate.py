"""The command ``reevaluate``: how much of each map's fitness was luck."""

from __future__ import annotations

import dataclasses
import json

from rich.console import Console
from rich.table import Table

from app.cli import commands as c
from app.cli.progress import counting
from engine.analysis.reevaluation import reevaluate
from engine.analysis.robustness import MapRobustness, robust_path


def reevaluate_run(command: c.Reevaluate, console: Console) -> None:
    """Evaluate a run's elites again and print what came out, for people or as JSON."""
    try:
        with counting(console, "evaluating again") as observer:
            _, maps = reevaluate(
                command.run,
                repeats=command.repeats,
                archive=command.archive,
                n_threads=command.workers,
                observer=observer,
            )
    except KeyboardInterrupt:
        console.print("Stopped. What is finished is saved; the same command goes on with it.", markup=False)
        raise
    if command.json:
        print(json.dumps([dataclasses.asdict(m) for m in maps], indent=2))
        return
    out = Console(highlight=False)
    out.print(_table(maps, command.repeats))
    for m in maps:
        out.print(_sentence(m), markup=False, soft_wrap=True)
    console.print(f"Kept in {robust_path(command.run)}", markup=False)


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
