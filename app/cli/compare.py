"""The command ``compare``: a report of runs as a page, tables and figures."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from rich.console import Console
from rich.table import Table

from app.cli import commands as c
from engine.analysis import published
from engine.analysis.comparison import Comparison, TaskComparison, compare_runs
from engine.analysis.comparison_tables import csv_files
from engine.analysis.statistics import describe, too_few_runs
from engine.errors import ExportError
from viz.report.images import write_images
from viz.report.report import render_page, report_sections, task_title

_MEASURES: Final = {
    "best": ("best f_s, cm", 2),
    "qd_score": ("QD score, cm", 1),
    "coverage": ("coverage, %", 1),
    "evaluations": ("evaluations", 0),
    "hours": ("hours", 2),
}


def compare(command: c.Compare, console: Console) -> None:
    """Compare runs, write the report and print its main table.

    Raises:
        RunFileError: a run cannot be read.
        InvalidData: there is nothing to compare.
        ExportError: the report cannot be written.
    """
    comparison = compare_runs(command.run, at=command.at)
    _make_folder(command.out)
    for note in comparison.notes:
        console.print(f"tensatlas: note: {note}", markup=False)
    sections = report_sections(comparison)
    report = command.out / "report.html"
    _write(report, render_page(comparison, sections))
    for name, text in csv_files(comparison).items():
        _write(command.out / name, text)
    if command.images != "none":
        figures = [f for s in sections for f in s.figures]
        folder = command.out / "figures"
        try:
            folder.mkdir(exist_ok=True)
            write_images(figures, folder, command.images)
        except ExportError as e:
            console.print(f"tensatlas: note: {e}", markup=False)
    _print(comparison)
    console.print(f"Wrote the report to {report}", markup=False)


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise ExportError(f"{folder} cannot be used as the report's folder: {e.strerror}") from None


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as e:
        raise ExportError(f"{path} cannot be written: {e.strerror}") from None


def _print(comparison: Comparison) -> None:
    console = Console(highlight=False)
    for task in comparison.tasks:
        console.print(_table(task))
        for line in _test_lines(task):
            console.print(line, markup=False, soft_wrap=True)


def _test_lines(task: TaskComparison) -> list[str]:
    tests = task.tests()
    if tests and not any(t.result.enough for t in tests):
        return [too_few_runs()]
    lines = []
    for test in tests:
        p = f" (p = {test.result.p:.4f})" if test.result.enough else ""
        what = {"best": "best f_s", "qd_score": "QD score"}[test.measure]
        lines.append(f"{what}: {test.result.sentence(test.first.name, test.second.name)}{p}")
    return lines


def _table(task: TaskComparison) -> Table:
    table = Table(
        title=task_title(task.task),
        title_justify="left",
        caption=f"mean ± s.d. over runs; published: {published.CITATION}",
    )
    table.add_column("")
    for g in task.groups:
        table.add_column(f"{g.name}\n{len(g.runs)} run{'s' if len(g.runs) > 1 else ''}", justify="right")
    for measure, (name, digits) in _MEASURES.items():
        table.add_row(name, *(_ours(g.values(measure), digits) for g in task.groups))
        theirs = [_theirs(measure, task.task, g.algorithm, digits) for g in task.groups]
        if any(theirs):
            table.add_row("  published", *theirs, style="dim")
    return table


def _ours(values: list[float], digits: int) -> str:
    if not values:
        return "-"
    s = describe(values)
    return f"{s.mean:.{digits}f}" + (f" ± {s.std:.{digits}f}" if s.std else "")


def _theirs(measure: str, task: str, algorithm: str, digits: int) -> str:
    paper = published.statistics(measure, task, algorithm)
    return "" if paper is None else f"{paper['mean']:.{digits}f} ± {paper['std']:.{digits}f}"
