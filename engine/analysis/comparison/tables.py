"""A comparison's numbers as tables: CSV for other programs, Markdown for a page."""

from __future__ import annotations

from typing import Final

from engine.analysis.comparison import published
from engine.analysis.comparison.compare import Comparison
from engine.analysis.comparison.groups import differing
from engine.analysis.comparison.measures import DASH, MEASURES, TRENDS
from engine.analysis.comparison.significance import CONFIDENCE, EffectSize
from engine.analysis.comparison.task_comparison import Group, TaskComparison
from engine.errors import printable
from engine.files import csv_text

_STATISTICS: Final = ("mean", "std", "min", "max", "median")


def csv_files(comparison: Comparison) -> dict[str, str]:
    """Return a comparison's tables by file name: every run, the groups, statistics, tests, trends."""
    columns = [m.column for m in MEASURES.values()]
    published_columns = [f"published_{s}" for s in _STATISTICS]
    tests = ["measure", "first", "second", "test", "n_first", "n_second", "a12", "a12_low", "a12_high"]
    tests += ["p", "p_holm", "smallest_p", "published_p", "says"]
    statistics = ["measure", "runs", *_STATISTICS, "lower_quartile", "upper_quartile", *published_columns]
    tables: dict[str, list[list[object]]] = {
        "runs.csv": [["task", "group", "run", "seed", "cells_above_cm", *columns], *_runs(comparison)],
        "groups.csv": [["task", "group", "setting", "value"], *_groups(comparison)],
        "statistics.csv": [["task", "group", *statistics], *_statistics(comparison)],
        "tests.csv": [["task", *tests], *_tests(comparison)],
        "trends.csv": [
            ["task", "group", "measure", "evaluations", "runs", "mean", "std"],
            *_trends(comparison),
        ],
    }
    return {name: csv_text(rows) for name, rows in tables.items()}


def _runs(comparison: Comparison) -> list[list[object]]:
    return [
        [
            t.task,
            g.name,
            printable(str(r.path)),
            r.config.seed,
            100.0 * r.threshold,
            *(r.measure(m) for m in MEASURES),
        ]
        for t in comparison.tasks
        for g in t.groups
        for r in g.runs
    ]


def _groups(comparison: Comparison) -> list[list[object]]:
    return [
        [t.task, g.name, key, str(g.settings[key])]
        for t in comparison.tasks
        for g in t.groups
        for key in differing(g.settings for g in t.groups)
        if key in g.settings
    ]


def _statistics(comparison: Comparison) -> list[list[object]]:
    rows: list[list[object]] = []
    for t in comparison.tasks:
        for g in t.groups:
            for name in t.measures:
                ours = g.statistics(name)
                paper = published.statistics(name, t.task, g.algorithm) or {}
                rows.append(
                    [
                        t.task,
                        g.name,
                        MEASURES[name].column,
                        0 if ours is None else ours.n,
                        *(None if ours is None else getattr(ours, s) for s in _STATISTICS),
                        *((None, None) if ours is None else ours.quartiles),
                        *(paper.get(s) for s in _STATISTICS),
                    ]
                )
    return rows


def _tests(comparison: Comparison) -> list[list[object]]:
    return [
        [
            t.task,
            MEASURES[test.measure].column,
            test.first.name,
            test.second.name,
            test.result.kind,
            *test.result.n,
            test.effect.value,
            test.effect.low,
            test.effect.high,
            test.result.p,
            test.corrected_p,
            test.result.smallest_p,
            published.rank_sum_p(test.measure, t.task, test.first.algorithm, test.second.algorithm),
            test.sentence(),
        ]
        for t in comparison.tasks
        for test in t.tests
    ]


def _trends(comparison: Comparison) -> list[list[object]]:
    rows: list[list[object]] = []
    for t in comparison.tasks:
        for g in t.groups:
            for measure in TRENDS:
                trend = g.trend(measure)
                rows += [
                    [t.task, g.name, MEASURES[measure].column, int(n), trend.n, float(mean), float(std)]
                    for n, mean, std in zip(trend.evaluations, trend.mean, trend.std, strict=True)
                ]
    return rows


def markdown(comparison: Comparison) -> str:
    """Return the groups' medians and quartiles, and how they differ from the baseline, as Markdown tables."""
    parts = []
    for task in comparison.tasks:
        for name in task.measures:
            if name == "hours":
                continue
            measure = MEASURES[name]
            unit = f" ({measure.unit})" if measure.unit else ""
            lines = [f"**{measure.named(task.threshold)}**{unit}, {task.task}", ""]
            parts.append("\n".join([*lines, *_markdown_table(task, name)]))
        parts.append(_markdown_remarks(task))
    return "\n\n".join(p for p in parts if p) + "\n"


def _markdown_table(task: TaskComparison, name: str) -> list[str]:
    text = MEASURES[name].text
    against = task.baseline is not None and MEASURES[name].tested
    head = ["group", "n", "median", "quartiles"]
    if against and task.baseline:
        head += [f"A12 against {task.baseline.name}", "interval", "p", "p (Holm)"]
    rows = [head, ["---", *["---:"] * (len(head) - 1)]]
    for group in task.groups:
        s = group.statistics(name)
        row = [group.name, "0" if s is None else str(s.n)]
        row.append(text(None if s is None else s.median))
        # quartiles of two values would be made up
        row.append(DASH if s is None or s.n < 3 else " to ".join(text(q) for q in s.quartiles))
        rows.append(row + (_against(task, name, group) if against else []))
    return ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]


def _against(task: TaskComparison, name: str, group: Group) -> list[str]:
    test = task.test(name, group)
    if test is None:
        return [DASH] * 4
    p = [f"{test.result.p:.3g}", f"{test.corrected_p:.3g}"] if test.result.enough else [DASH] * 2
    return [f"{test.effect.value:.2f}", interval(test.effect), *p]


def _markdown_remarks(task: TaskComparison) -> str:
    remarks = ["Quartiles are of three runs and more."]
    if task.baseline:
        kinds = {t.result.kind for t in task.tests}
        named = {
            "rank-sum": "rank-sum test (Mann-Whitney)",
            "signed-rank": "signed-rank test of pairs (Wilcoxon)",
        }
        used = " and ".join(text for kind, text in named.items() if kind in kinds)
        remarks.append(
            "A12 is the share of pairs of runs in which the group is higher, with its"
            f" {CONFIDENCE:.0%} bootstrap interval; p by the exact {used}, corrected by Holm's method within"
            " a table."
        )
        if any(not t.result.enough for t in task.tests):
            remarks.append(f"{DASH} for p: so few runs could not reach 0.05 whatever they did.")
    return " ".join([*remarks, task.remark]).strip()


def interval(effect: EffectSize) -> str:
    """Return the interval of an effect size for people, a dash where a single value has none."""
    return DASH if effect.low is None or effect.high is None else f"{effect.low:.2f} to {effect.high:.2f}"
