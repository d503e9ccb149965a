"""The command ``compare``: a report of runs as a page, tables and figures."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import tyro
from rich.console import Console
from rich.table import Table

from engine.errors import ExportError, as_typed
from engine.files import write_files

if TYPE_CHECKING:  # statistics and figures take a while to import; other commands do not need them
    from engine.analysis.comparison import Comparison, TaskComparison
    from engine.analysis.comparison.measures import Measure

_MOST_COLUMNS: Final = 3
"""Groups up to which each is a column of the printed table; more would not fit a terminal."""


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
        texts = {
            "report.html": render_page(comparison, sections),
            "tables.md": markdown(comparison),
            **csv_files(comparison),
        }
        try:
            write_files({self.out / name: text for name, text in texts.items()})
        except OSError as e:
            raise ExportError(f"{e.filename} cannot be written: {e.strerror}") from None
        if self.images != "none":
            figures = [f for s in sections for f in s.figures]
            folder = self.out / "figures"
            try:
                folder.mkdir(exist_ok=True)
                write_images(figures, folder, self.images)
            except ExportError as e:
                console.print(f"tensatlas: note: {e}", markup=False)
        _print(comparison)
        console.print(f"Wrote the report to {as_typed(report)}", markup=False)


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise ExportError(f"{folder} cannot be used as the report's folder: {e.strerror}") from None


def _print(comparison: Comparison) -> None:
    console = Console(highlight=False)
    for task in comparison.tasks:
        console.print(_by_measure(task) if len(task.groups) <= _MOST_COLUMNS else _by_group(task))
        for line in _test_lines(task):
            console.print(line, markup=False, soft_wrap=True)


def _test_lines(task: TaskComparison) -> list[str]:
    from engine.analysis.comparison.measures import MEASURES

    lines = [
        f"{MEASURES[t.measure].named(task.threshold)}: {t.sentence()} (p = {t.corrected_p:.4f},"
        f" A12 {t.effect.value:.2f}, {t.result.kind})"
        for t in task.tests
        if t.significant
    ]
    n = len(task.tests) - len(lines)
    if task.remark:
        lines.append(task.remark)
    elif n:
        lines.append(f"{n} of {len(task.tests)} tests show no difference.")
    return lines


def _by_measure(task: TaskComparison) -> Table:
    """Return a row for every measure, the published one below it."""
    from engine.analysis.comparison import published
    from engine.analysis.comparison.measures import MEASURES

    table = _table(task, f"mean ± s.d. (n - 1) over runs; published (n): {published.CITATION}")
    table.add_column("")
    for g in task.groups:
        table.add_column(f"{g.name}\n{len(g.runs)} run{'s' if len(g.runs) > 1 else ''}", justify="right")
    for name in task.measures:
        measure = MEASURES[name]
        title = measure.named(task.threshold) + (f", {measure.unit}" if measure.unit else "")
        table.add_row(title, *(_ours(g.values(name), measure) for g in task.groups))
        papers = [published.statistics(name, task.task, g.algorithm) for g in task.groups]
        if any(papers):
            digits = measure.digits
            theirs = ["" if p is None else f"{p['mean']:.{digits}f} ± {p['std']:.{digits}f}" for p in papers]
            table.add_row("  published", *theirs, style="dim")
    return table


def _by_group(task: TaskComparison) -> Table:
    """Return a row for every group, of the measures that it is tested on; by fresh noise where known."""
    from engine.analysis.comparison.measures import MEASURES

    table = _table(task, "mean ± s.d. (n - 1) over runs")
    names = [m for m in task.measures if MEASURES[m].tested and f"robust_{m}" not in task.measures]
    table.add_column("", min_width=10)
    table.add_column("runs", justify="right")
    for name in names:
        measure = MEASURES[name]
        unit = f", {measure.unit}" if measure.unit else ""
        table.add_column(measure.named(task.threshold) + unit, justify="right")
    for g in task.groups:
        table.add_row(g.name, str(len(g.runs)), *(_ours(g.values(m), MEASURES[m]) for m in names))
    return table


def _table(task: TaskComparison, caption: str) -> Table:
    from viz.report.report import task_title

    return Table(title=task_title(task.task), title_justify="left", caption=caption)


def _ours(values: list[float], measure: Measure) -> str:
    from engine.analysis.comparison.statistics import describe

    if not values:
        return measure.text(None)
    s = describe(values)
    return measure.text(s.mean) + (f" ± {measure.text(s.std)}" if s.std else "")
