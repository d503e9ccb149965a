"""The command ``compare``: a report of runs as a page, tables and figures."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import tyro
from rich.console import Console
from rich.table import Table

from engine.errors import ExportError

if TYPE_CHECKING:  # statistics and figures take a while to import; other commands do not need them
    from engine.analysis.comparison import Comparison, TaskComparison


@dataclasses.dataclass(frozen=True, kw_only=True)
class Compare:
    """Compare runs: tables, tests and figures by task and by what the runs differ in, beside the paper's.

    Writes one page that works offline, report.html, the tables as CSV and Markdown and each figure as a file.
    """

    paths: tyro.conf.Positional[tuple[Path, ...]]
    """Run files, or folders of them."""
    out: Path = Path("comparison")
    """Folder to write into."""
    at: int | None = None
    """Evaluations to compare at; later generations do not count. Without it, the ends of the runs."""
    baseline: str | None = None
    """The group that all others are tested against: its name, or that of one of its runs. Without it, all
    groups are tested against each other."""
    above: float | None = None
    """f_s in cm above which cells are counted; without it, what no robot reaches that does not steer."""
    images: Literal["svg", "png", "none"] = "svg"
    """Kind of the figures' files; needs a Chromium."""

    def run(self, console: Console) -> None:
        """Compare the runs, write the report and print its main table to standard output.

        Raises:
            RunFileError: a run cannot be read.
            InvalidData: there is nothing to compare.
            ExportError: the report cannot be written.
        """
        from engine.analysis.comparison import compare_runs
        from engine.analysis.comparison.tables import csv_files, markdown
        from viz.report.images import write_images
        from viz.report.report import render_page, report_sections

        above = None if self.above is None else self.above / 100.0
        comparison = compare_runs(self.paths, at=self.at, above=above, baseline=self.baseline)
        _make_folder(self.out)
        for note in comparison.notes:
            console.print(f"tensatlas: note: {note}", markup=False)
        sections = report_sections(comparison)
        report = self.out / "report.html"
        _write(report, render_page(comparison, sections))
        for name, text in csv_files(comparison).items():
            _write(self.out / name, text)
        _write(self.out / "tables.md", markdown(comparison))
        if self.images != "none":
            figures = [f for s in sections for f in s.figures]
            folder = self.out / "figures"
            try:
                folder.mkdir(exist_ok=True)
                write_images(figures, folder, self.images)
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
    from engine.analysis.comparison.measures import MEASURES

    tests = task.tests
    remark = [task.remark] if task.remark else []
    if not any(t.result.enough for t in tests):
        return remark
    lines = []
    for test in tests:
        a12 = f"A12 {test.effect.value:.2f}"
        p = f" (p = {test.corrected_p:.4f}, {a12}, {test.result.kind})" if test.result.enough else f" ({a12})"
        lines.append(f"{MEASURES[test.measure].named(task.threshold)}: {test.sentence()}{p}")
    return lines + remark


def _table(task: TaskComparison) -> Table:
    from engine.analysis.comparison import published
    from engine.analysis.comparison.measures import MEASURES
    from viz.report.report import task_title

    table = Table(
        title=task_title(task.task),
        title_justify="left",
        caption=f"mean ± s.d. (n - 1) over runs; published (n): {published.CITATION}",
    )
    table.add_column("")
    for g in task.groups:
        table.add_column(f"{g.name}\n{len(g.runs)} run{'s' if len(g.runs) > 1 else ''}", justify="right")
    for name in task.measures:
        measure = MEASURES[name]
        digits = measure.digits
        title = measure.named(task.threshold) + (f", {measure.unit}" if measure.unit else "")
        table.add_row(title, *(_ours(g.values(name), digits) for g in task.groups))
        papers = [published.statistics(name, task.task, g.algorithm) for g in task.groups]
        if any(papers):
            theirs = ["" if p is None else f"{p['mean']:.{digits}f} ± {p['std']:.{digits}f}" for p in papers]
            table.add_row("  published", *theirs, style="dim")
    return table


def _ours(values: list[float], digits: int) -> str:
    from engine.analysis.comparison.statistics import describe

    if not values:
        return "—"
    s = describe(values)
    # counts have means that are not whole
    digits = max(digits, 1) if len(values) > 1 else digits
    return f"{s.mean:.{digits}f}" + (f" ± {s.std:.{digits}f}" if s.std is not None else "")
