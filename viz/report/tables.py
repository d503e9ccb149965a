"""The tables of a report, as HTML."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import Any, Final

from engine.analysis import published
from engine.analysis.comparison import TaskComparison
from engine.analysis.statistics import ALPHA, too_few_runs
from viz.report.style import colors

MEASURES: Final = {
    "best": ("Best f<sub>s</sub>", "cm", 2),
    "qd_score": ("QD score of the morphology map", "cm", 1),
    "coverage": ("Coverage of the morphology map", "%", 1),
    "evaluations": ("Evaluations", "", 0),
    "hours": ("Computing time", "h", 2),
}
"""Title, unit and decimals of every measure."""
_COLUMNS: Final = ("mean", "std", "min", "max", "median")
_HEADINGS: Final = {"std": "s.d."}


def number(value: float | None, digits: int) -> str:
    """Return a number for people, a dash for none."""
    return "–" if value is None else f"{value:,.{digits}f}".replace("-", "−")


def p_value(p: float) -> str:
    """Return a p-value for people."""
    return f"{p:.4f}" if p >= 0.0001 else "< 0.0001"


def runs_table(task: TaskComparison, labels: Mapping[Any, str]) -> str:
    """Return a row for every run."""
    palette = colors([g.name for g in task.groups])
    rows = [
        [
            _named(group.name, palette),
            html.escape(labels[run.path]),
            str(run.config.seed),
            *(number(run.measure(m), digits) for m, (_, _, digits) in MEASURES.items()),
        ]
        for group in task.groups
        for run in group.runs
    ]
    head = [
        "algorithm",
        "run",
        "seed",
        "best f<sub>s</sub> (cm)",
        "QD score (cm)",
        "coverage (%)",
        "evaluations",
        "hours",
    ]
    return _table([head], rows, texts=2)


def statistics_table(task: TaskComparison, measure: str) -> str:
    """Return a measure's statistics over the runs of each algorithm, the paper's beside them."""
    title, unit, digits = MEASURES[measure]
    palette = colors([g.name for g in task.groups])
    paper = {g.name: published.statistics(measure, task.task, g.algorithm) for g in task.groups}
    columns = [c for c in _COLUMNS if any(p and c in p for p in paper.values())]
    rows = []
    for group in task.groups:
        s = group.statistics(measure)
        row = [_named(group.name, palette), str(0 if s is None else s.n)]
        row += [number(None if s is None else getattr(s, c), digits) for c in _COLUMNS]
        row += [number((paper[group.name] or {}).get(c), digits) for c in columns]
        rows.append(row)
    names = [_HEADINGS.get(c, c) for c in _COLUMNS]
    head: list[list[Any]] = [["algorithm", "runs", *names, *(_HEADINGS.get(c, c) for c in columns)]]
    if columns:
        where = f"published ({published.n_runs()} runs of {published.n_evaluations():,})"
        head.insert(0, [("", 2), ("these runs", len(names)), (where, len(columns))])
    caption = title + (f" <span>({unit})</span>" if unit else "")
    return _table(head, rows, texts=1, caption=caption, split=2 + len(names) if columns else None)


def rank_sum_table(task: TaskComparison) -> str:
    """Return the rank-sum tests of all pairs of algorithms and what each says, the paper's p beside it."""
    tests = task.tests()
    if not tests:
        return "<p>There is a single algorithm: nothing to test it against.</p>"
    lead = ""
    if not any(t.result.enough for t in tests):
        lead = f"<p>{too_few_runs()}</p>"
    rows = []
    for test in tests:
        theirs = published.rank_sum_p(test.measure, task.task, test.first.algorithm, test.second.algorithm)
        result = test.result
        rows.append(
            [
                MEASURES[test.measure][0],
                html.escape(f"{test.first.name} – {test.second.name}"),
                "too few runs" if lead else html.escape(result.sentence(test.first.name, test.second.name)),
                p_value(result.p) if result.enough else "–",
                "–" if theirs is None else p_value(theirs),
            ]
        )
    head = ["measure", "algorithms", f"what the test says (α = {ALPHA:g})", "p", "published p"]
    return _table([head], rows, texts=3, caption="Wilcoxon rank-sum tests") + lead


def _named(name: str, palette: Mapping[str, str]) -> str:
    return f'<i style="background:{palette[name]}"></i>{html.escape(name)}'


def _table(
    head: Sequence[Sequence[Any]],
    rows: Sequence[Sequence[str]],
    *,
    texts: int,
    caption: str = "",
    split: int | None = None,
) -> str:
    """Return a table.

    Args:
        head: rows of headings, each a text or (text, columns it spans).
        rows: cells as HTML.
        texts: how many columns from the left hold text; the others are set flush right.
        caption: as HTML.
        split: the column before which a line separates ours from theirs.
    """

    def name(k: int) -> str:
        kinds = ["t" if k < texts else "n", *(["s"] if k == split else [])]
        return f' class="{" ".join(kinds)}"'

    parts = ['<div class="ta-scroll"><table class="ta-table">']
    if caption:
        parts.append(f"<caption>{caption}</caption>")
    parts.append("<thead>")
    for line in head:
        cells, k = [], 0
        for cell in line:
            text, span = cell if isinstance(cell, tuple) else (cell, 1)
            spans = f' colspan="{span}"' if span > 1 else ""
            group = ' style="text-align:left"' if span > 1 else ""
            cells.append(f"<th{name(k)}{spans}{group}>{text}</th>")
            k += span
        parts.append(f"<tr>{''.join(cells)}</tr>")
    parts.append("</thead><tbody>")
    for row in rows:
        parts.append("<tr>" + "".join(f"<td{name(k)}>{c}</td>" for k, c in enumerate(row)) + "</tr>")
    parts.append("</tbody></table></div>")
    return "".join(parts)
