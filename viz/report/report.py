"""A comparison of runs as sections of tables and figures: for one self-contained page, or for the app."""

from __future__ import annotations

import dataclasses
import html
from importlib import resources
from typing import Final

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from engine.analysis.comparison import Comparison, TaskComparison, published
from engine.analysis.elite_maps import GRID
from viz import words
from viz.report.maps import MOST_RUNS, maps_figure
from viz.report.nested import nested_figure
from viz.report.style import LIGHT, ReportLook
from viz.report.tables import runs_table, settings_table, significance_table, statistics_table
from viz.report.trends import ends_figure, profile_figure, trend_figure

_CONVENTIONS: Final = (
    "s.d. is the sample's (n − 1); the published one divides by n in the authors' scripts, which makes it"
    " 5 % smaller for ten runs. A single run has none: —."
)
_TESTS: Final = (
    "The tests are exact and two-sided: the rank-sum test (Mann-Whitney), or the signed-rank test of pairs"
    " (Wilcoxon) where the runs of one group began with the same random robots as those of the other, which"
    " makes them dependent. p (Holm) is corrected for all tests of one measure. The published p-values are by"
    " the normal approximation and without correction. A<sub>12</sub> is how often a run of the first group"
    " is above one of the second: 0.5 where they are alike; its interval is the bootstrap's."
)
_MOST_NESTED: Final = 3
"""Groups up to which the 4-D maps of all their runs are drawn; of more, each group's first."""
_TASK_TITLES: Final = {"goal-reaching": "Goal reaching", "squeezing": "Squeezing"}


@dataclasses.dataclass(frozen=True, slots=True)
class ReportFigure:
    """A figure of a report.

    Attributes:
        name: of its file, without an ending.
        caption: what it shows, as HTML.
        figure: to draw.
    """

    name: str
    caption: str
    figure: go.Figure


@dataclasses.dataclass(frozen=True, slots=True)
class ReportSection:
    """A part of a report under a heading.

    Attributes:
        name: for links to it.
        title: its heading.
        lead: text and tables, as HTML styled by ``report.css``.
        figures: below them.
    """

    name: str
    title: str
    lead: str
    figures: tuple[ReportFigure, ...] = ()


def report_sections(comparison: Comparison, look: ReportLook = LIGHT) -> tuple[ReportSection, ...]:
    """Return what there is to show of a comparison, in order."""
    sections = []
    if comparison.notes:
        notes = "".join(f"<li>{html.escape(n)}</li>" for n in comparison.notes)
        sections.append(ReportSection("notes", "Before you read on", f'<ul class="ta-notes">{notes}</ul>'))
    for task in comparison.tasks:
        sections += _task_sections(task, comparison, look)
    return tuple(sections)


def style() -> str:
    """Return the style sheet of the sections' HTML; it takes its colours from the text around it."""
    return _css("report.css")


def _css(name: str) -> str:
    return (resources.files("viz.report") / name).read_text(encoding="utf-8")


def _task_sections(task: TaskComparison, comparison: Comparison, look: ReportLook) -> list[ReportSection]:
    name, title = _file_name(task.task), task_title(task.task)
    several = len(comparison.tasks) > 1
    prefix = f"{title}: " if several else ""

    def heading(text: str) -> str:
        return prefix + (text if prefix else text[0].upper() + text[1:])

    sections = [
        ReportSection(
            f"{name}-trends",
            heading("over the evaluations"),
            "",
            (
                ReportFigure(
                    f"{name}-best-fitness",
                    "Best fitness against evaluations. Bold: the mean; band: one sample standard deviation"
                    " to either side; thin: single runs.",
                    trend_figure(task, ("best",), look),
                ),
                ReportFigure(
                    f"{name}-qd-score-and-coverage",
                    "QD score and coverage of the morphology map against evaluations.",
                    trend_figure(task, ("qd_score", "coverage"), look),
                ),
                ReportFigure(
                    f"{name}-cells-above",
                    f"Left: cells of the morphology map above {100 * task.threshold:.2f} cm against"
                    " evaluations. Right: cells above any f<sub>s</sub> at the end of the runs, their mean;"
                    " dotted: by the elites' means under fresh noise; dashed: the threshold.",
                    profile_figure(task, look),
                ),
                ReportFigure(f"{name}-ends", "Where each run ended, by group.", ends_figure(task, look)),
            ),
        ),
        ReportSection(
            f"{name}-maps",
            heading("the maps"),
            "",
            (
                ReportFigure(
                    f"{name}-maps",
                    "The best robot of every kind, by body and by the way its head moves. Grey cells are"
                    f" empty; all maps share one scale.{_missing(task)}{_left_out(task)}",
                    maps_figure(task, comparison.labels, look),
                ),
            ),
        ),
    ]
    nested = _nested_figures(task, comparison, look)
    if nested:
        sections.append(
            ReportSection(
                f"{name}-nested",
                heading("bodies and movements at once"),
                "<p>The 4-D map, drawn nested: a block for every body, and in it a cell for every way to"
                " move.</p>",
                nested,
            )
        )
    results = ReportSection(
        f"{name}-results",
        heading("results"),
        "".join(statistics_table(task, m) for m in task.measures)
        + f"<p>{_CONVENTIONS} Published figures: {published.CITATION}.</p>"
        + significance_table(task)
        + f"<p>{_TESTS}</p>"
        + settings_table(task),
    )
    runs = ReportSection(f"{name}-runs", heading("the runs"), runs_table(task, comparison.labels))
    # of one run of each group the runs themselves say more than their statistics
    single = all(len(g.runs) == 1 for g in task.groups)
    return [*sections, *((runs, results) if single else (results, runs))]


def _nested_figures(
    task: TaskComparison, comparison: Comparison, look: ReportLook
) -> tuple[ReportFigure, ...]:
    figures = []
    for group in task.groups:
        runs = [r for r in group.runs if GRID in r.maps and len(r.maps[GRID].axes) == 4]
        if not runs:
            continue
        how = (
            "both archives' elites placed in one map, by the final components and bounds"
            if runs[0].maps[GRID].projected
            else "the archive that it works with"
        )
        few = len(task.groups) <= _MOST_NESTED
        figures.append(
            ReportFigure(
                f"{_file_name(task.task)}-nested-{_file_name(group.name)}",
                f"{html.escape(group.name)}, the 4-D map{'' if few else ' of its first run'}: {how}.",
                nested_figure(task, runs if few else runs[:1], comparison.labels, look),
            )
        )
    return tuple(figures)


def _missing(task: TaskComparison) -> str:
    """Return why algorithms have no map where others have one."""
    if not any(r.config.algorithm == "vie-neat" for r in task.runs):
        return ""
    return (
        " ViE-NEAT works with populations, not with archives: its morphology map is reconstructed from all"
        " robots that it tried. It has no controller map, because it describes no movements by which robots"
        " could be sorted."
    )


def _left_out(task: TaskComparison) -> str:
    more = max(len(g.runs) for g in task.groups) - MOST_RUNS
    return f" The first {MOST_RUNS} runs of each group are drawn." if more > 0 else ""


def task_title(task: str) -> str:
    """Return a task's name for people."""
    return _TASK_TITLES.get(task, task.replace("-", " ").capitalize())


def _file_name(name: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in name.lower()).replace("--", "-").strip("-")


def render_page(comparison: Comparison, sections: tuple[ReportSection, ...]) -> str:
    """Return a report as one HTML page that needs nothing else, not even a network."""
    tasks = " and ".join(task_title(t.task).lower() for t in comparison.tasks)
    n = sum(len(t.runs) for t in comparison.tasks)
    groups = sorted({g.name for t in comparison.tasks for g in t.groups})
    at = f", at {comparison.at:,} evaluations at most" if comparison.at is not None else ""
    links = "".join(f'<a href="#{s.name}">{html.escape(s.title)}</a>' for s in sections)
    body = "".join(_render_section(s) for s in sections)
    title = f"TensAtlas: {n} {'run' if n == 1 else 'runs'} of {tasks}"
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        f"<title>{html.escape(title)}</title><style>{_css('page.css')}{style()}</style>"
        f"<script>{get_plotlyjs()}</script></head><body><header><h1>{html.escape(tasks.capitalize())}</h1>"
        f"<p>{n} {'run' if n == 1 else 'runs'} of {html.escape('; '.join(groups))}{at}."
        f" {words.markup(words.F_S)} {words.markup(words.QD_SCORE)} {words.PCA}</p>"
        f"<nav>{links}</nav></header><main>{body}</main>"
        "<footer>Made by TensAtlas.</footer></body></html>"
    )


def _render_section(section: ReportSection) -> str:
    figures = "".join(
        f'<figure id="{f.name}"><div class="ta-scroll">'
        + f.figure.to_html(
            full_html=False,
            include_plotlyjs=False,
            div_id=f"plot-{f.name}",
            config={
                "displaylogo": False,
                "modeBarButtonsToRemove": ["select2d", "lasso2d", "autoScale2d"],
                "toImageButtonOptions": {"format": "svg", "filename": f.name},
            },
        )
        + f"</div><figcaption>{f.caption}</figcaption></figure>"
        for f in section.figures
    )
    return (
        f'<section id="{section.name}"><h2>{html.escape(section.title)}</h2>{section.lead}{figures}</section>'
    )
