"""A comparison's numbers as tables for other programs."""

from __future__ import annotations

from typing import Final

from engine.analysis import published
from engine.analysis.comparison import Comparison
from engine.files import csv_text

MEASURES: Final = {
    "best": "best_f_s_cm",
    "qd_score": "qd_score_cm",
    "coverage": "coverage_percent",
    "evaluations": "evaluations",
    "hours": "hours",
}
"""Names of the measures' columns, with their units."""
_STATISTICS: Final = ("mean", "std", "min", "max", "median")


def csv_files(comparison: Comparison) -> dict[str, str]:
    """Return a comparison's tables by file name: every run, the statistics, the tests, the trends."""
    return {
        "runs.csv": csv_text([["task", "algorithm", "run", "seed", *MEASURES.values()], *_runs(comparison)]),
        "statistics.csv": csv_text(
            [
                [
                    "task",
                    "algorithm",
                    "measure",
                    "runs",
                    *_STATISTICS,
                    *(f"published_{s}" for s in _STATISTICS),
                ],
                *_statistics(comparison),
            ]
        ),
        "tests.csv": csv_text(
            [
                [
                    "task",
                    "measure",
                    "first",
                    "second",
                    "n_first",
                    "n_second",
                    "p",
                    "smallest_p",
                    "published_p",
                    "says",
                ],
                *_tests(comparison),
            ]
        ),
        "trends.csv": csv_text(
            [["task", "algorithm", "measure", "evaluations", "runs", "mean", "std"], *_trends(comparison)]
        ),
    }


def _runs(comparison: Comparison) -> list[list[object]]:
    return [
        [t.task, g.name, str(r.path), r.config.seed, *(r.measure(m) for m in MEASURES)]
        for t in comparison.tasks
        for g in t.groups
        for r in g.runs
    ]


def _statistics(comparison: Comparison) -> list[list[object]]:
    rows: list[list[object]] = []
    for t in comparison.tasks:
        for g in t.groups:
            for measure, name in MEASURES.items():
                ours = g.statistics(measure)
                paper = published.statistics(measure, t.task, g.algorithm) or {}
                rows.append(
                    [
                        t.task,
                        g.name,
                        name,
                        0 if ours is None else ours.n,
                        *(None if ours is None else getattr(ours, s) for s in _STATISTICS),
                        *(paper.get(s) for s in _STATISTICS),
                    ]
                )
    return rows


def _tests(comparison: Comparison) -> list[list[object]]:
    return [
        [
            t.task,
            MEASURES[test.measure],
            test.first.name,
            test.second.name,
            *test.result.n,
            test.result.p,
            test.result.smallest_p,
            published.rank_sum_p(test.measure, t.task, test.first.algorithm, test.second.algorithm),
            test.result.sentence(test.first.name, test.second.name),
        ]
        for t in comparison.tasks
        for test in t.tests()
    ]


def _trends(comparison: Comparison) -> list[list[object]]:
    rows: list[list[object]] = []
    for t in comparison.tasks:
        for g in t.groups:
            for measure in ("best", "qd_score", "coverage"):
                trend = g.trend(measure)
                rows += [
                    [t.task, g.name, MEASURES[measure], int(n), trend.n, float(mean), float(std)]
                    for n, mean, std in zip(trend.evaluations, trend.mean, trend.std, strict=True)
                ]
    return rows
