"""The tables of a report, as HTML."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import Any, Final

from engine.analysis.comparison import TaskComparison, published
from engine.analysis.comparison.groups import differing, value_text
from engine.analysis.comparison.measures import DASH, MEASURES, number
from engine.analysis.comparison.significance import ALPHA, CONFIDENCE
from engine.analysis.comparison.tables import interval
from viz.report.style import colors

_COLUMNS: Final = ("mean", "std", "min", "max", "median")
_HEADINGS: Final = {"std": "s.d."}


def p_value(p: float) -> str:
    """Return a p-value for people."""
    return f"{p:.4f}" if p >= 0.0001 else "< 0.0001"


def title(measure: str, threshold: float) -> str:
    """Return what a measure is called, as HTML.

    Args:
        measure: its name.
        threshold: in m, above which cells are counted.
    """
    return MEASURES[measure].named(threshold).replace("f_s", "f<sub>s</sub>")


def runs_table(task: TaskComparison, labels: Mapping[Any, str]) -> str:
    """Return a row for every run."""
    palette = colors([g.name for g in task.groups])
    rows = [
        [
            _named(group.name, palette),
            html.escape(labels[run.path]),
            str(run.config.seed),
            *(MEASURES[m].text(run.measure(m)) for m in task.measures),
        ]
        for group in task.groups
        for run in group.runs
    ]
    units = {m: f" ({u})" if (u := MEASURES[m].unit) else "" for m in task.measures}
    head = ["group", "run", "seed", *(title(m, task.threshold) + units[m] for m in task.measures)]
    return _table([head], rows, texts=2)


def statistics_table(task: TaskComparison, measure: str) -> str:
    """Return a measure's statistics over the runs of each group, the paper's beside them."""
    unit, digits = MEASURES[measure].unit, MEASURES[measure].digits
    palette = colors([g.name for g in task.groups])
    paper = {g.name: published.statistics(measure, task.task, g.algorithm) for g in task.groups}
    columns = [c for c in _COLUMNS if any(p and c in p for p in paper.values())]
    rows = []
    for group in task.groups:
        s = group.statistics(measure)
        row = [_named(group.name, palette), str(0 if s is None else s.n)]
        row += [MEASURES[measure].text(None if s is None else getattr(s, c)) for c in _COLUMNS]
        row += [number((paper[group.name] or {}).get(c), digits) for c in columns]
        rows.append(row)
    names = [_HEADINGS.get(c, c) for c in _COLUMNS]
    head: list[list[Any]] = [["group", "runs", *names, *(_HEADINGS.get(c, c) for c in columns)]]
    if columns:
        where = f"published ({published.n_runs()} runs of {published.n_evaluations():,})"
        head.insert(0, [("", 2), ("these runs", len(names)), (where, len(columns))])
    caption = title(measure, task.threshold) + (f" <span>({unit})</span>" if unit else "")
    return _table(head, rows, texts=1, caption=caption, split=2 + len(names) if columns else None)


def significance_table(task: TaskComparison) -> str:
    """Return the tests of pairs of groups and what each says, the paper's p beside it."""
    tests = task.tests
    if not tests:
        return "<p>There is a single group of runs: nothing to test it against.</p>"
    few = not any(t.result.enough for t in tests)
    rows = []
    for test in tests:
        theirs = published.rank_sum_p(test.measure, task.task, test.first.algorithm, test.second.algorithm)
        result, known = test.result, test.result.enough
        rows.append(
            [
                title(test.measure, task.threshold),
                html.escape(f"{test.first.name} – {test.second.name}"),
                html.escape(test.verdict if known or few else test.sentence()),
                f"{result.kind}, {test.sizes}",
                f"{test.effect.value:.2f}",
                interval(test.effect),
                p_value(result.p) if known else DASH,
                p_value(test.corrected_p) if known else DASH,
                DASH if theirs is None else p_value(theirs),
            ]
        )
    head = ["measure", "groups", f"what the test says (α = {ALPHA:g})", "test, runs", "A<sub>12</sub>"]
    head += [f"{CONFIDENCE:.0%} interval", "p", "p (Holm)", "published p"]
    remark = f"<p>{html.escape(task.remark)}</p>" if task.remark else ""
    return _table([head], rows, texts=4, caption="Tests") + remark


def settings_table(task: TaskComparison) -> str:
    """Return in which settings the groups differ; nothing where there is a single group."""
    keys = differing(g.settings for g in task.groups)
    if not keys:
        return ""
    palette = colors([g.name for g in task.groups])
    rows = [
        [html.escape(key), *(html.escape(value_text(g.settings.get(key, DASH))) for g in task.groups)]
        for key in keys
    ]
    head = ["setting", *(_named(g.name, palette) for g in task.groups)]
    return _table([head], rows, texts=1, caption="What the groups differ in")


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
