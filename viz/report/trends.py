"""Figures of what runs reach: over their evaluations, and at their ends beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from engine.analysis.comparison import Group, TaskComparison, published
from engine.analysis.elite_maps import MORPHOLOGY
from engine.analysis.profile import aperture, counts_above
from engine.tasks import get_task
from viz.report.style import WIDTH, ReportLook, colors, dress, on_lines, translucent

HEIGHT: Final = 400
AXIS_TITLES: Final = {
    "best": "best f<sub>s</sub> (cm)",
    "qd_score": "QD score (cm)",
    "coverage": "coverage (%)",
    "above": "cells above {threshold:.2f} cm",
}
MOST_SINGLE_LINES: Final = 12
"""Runs of one group up to which each is also drawn on its own."""
_LINE: Final = 72
"""Height of a group's line among the ends, in px."""
_LEGEND: Final = 3
"""Groups that a line of the legend holds, about."""
_CURVE_POINTS: Final = 200
"""Limits at which the curve of cells above a limit is drawn."""


def trend_figure(task: TaskComparison, measures: tuple[str, ...], look: ReportLook) -> go.Figure:
    """Return measures of the morphology map over evaluations, side by side: mean and spread.

    Args:
        task: whose runs.
        measures: of ``AXIS_TITLES``, one for each panel.
        look: the colours.
    """
    figure = make_subplots(cols=len(measures), rows=1, horizontal_spacing=0.09)
    palette = colors([g.name for g in task.groups])
    for column, measure in enumerate(measures, start=1):
        for group in task.groups:
            _add_group(figure, group, measure, palette[group.name], column)
        figure.update_yaxes(title_text=_axis_title(measure, task), col=column)
        gate = aperture(get_task(task.task))
        if measure == "best" and gate is not None:
            figure.add_hline(
                y=100.0 * gate,
                line={"color": look.reference, "dash": "dash", "width": 1.4},
                annotation={
                    "text": f"the aperture, {100.0 * gate:.2f} cm",
                    "font": {"size": 12, "color": look.muted},
                },
                annotation_position="top left",
                row=1,
                col=column,
            )
    figure.update_xaxes(title_text="evaluations", rangemode="tozero", showgrid=False, tickformat="~s")
    return _dressed(figure, task, look, hovermode="x unified")


def profile_figure(task: TaskComparison, look: ReportLook) -> go.Figure:
    """Return how many cells are above the threshold over the evaluations, and how many above any limit.

    The second is of the ends of the runs, their mean; dotted, by the elites' means under fresh noise.

    Args:
        task: whose runs.
        look: the colours.
    """
    figure = make_subplots(cols=2, rows=1, horizontal_spacing=0.09)
    palette = colors([g.name for g in task.groups])
    values: dict[Path, Sequence[float]] = {
        r.path: list(r.maps[MORPHOLOGY].values(r.initial_distance).values()) for r in task.runs
    }
    fresh: dict[Path, Sequence[float]] = {r.path: r.robust.means for r in task.runs if r.robust is not None}
    every = [100.0 * v for found in (*values.values(), *fresh.values()) for v in found] or [0.0]
    limits = np.linspace(min(0.0, float(np.quantile(every, 0.02))), 1.02 * max(every), _CURVE_POINTS)
    for group in task.groups:
        _add_group(figure, group, "above", palette[group.name], 1)
        curves = {
            dash: [known[r.path] for r in group.runs if r.path in known]
            for dash, known in (("solid", values), ("dot", fresh))
        }
        for dash, maps in curves.items():
            if not maps:
                continue
            counts = [counts_above(found, limits / 100.0) for found in maps]
            figure.add_scatter(
                x=limits,
                y=np.mean(counts, axis=0),
                mode="lines",
                line={"color": palette[group.name], "width": 2.2, "dash": dash},
                legendgroup=group.name,
                showlegend=False,
                hovertemplate="%{y:.1f} cells above %{x:.1f} cm"
                f"{', fresh noise' if dash == 'dot' else ''}<extra>{group.name}</extra>",
                row=1,
                col=2,
            )
    figure.add_vline(
        x=100.0 * task.threshold, line={"color": look.reference, "dash": "dash", "width": 1.4}, row=1, col=2
    )
    figure.update_yaxes(title_text=_axis_title("above", task), rangemode="tozero", col=1)
    figure.update_yaxes(title_text="cells above it", rangemode="tozero", col=2)
    figure.update_xaxes(showgrid=False)
    figure.update_xaxes(title_text="evaluations", rangemode="tozero", tickformat="~s", col=1)
    figure.update_xaxes(title_text="f<sub>s</sub> (cm)", col=2)
    return _dressed(figure, task, look)


def _axis_title(measure: str, task: TaskComparison) -> str:
    return AXIS_TITLES[measure].format(threshold=100.0 * task.threshold)


def _dressed(figure: go.Figure, task: TaskComparison, look: ReportLook, **layout: str) -> go.Figure:
    return dress(
        figure,
        look,
        width=WIDTH,
        height=HEIGHT + 24 * ((len(task.groups) - 1) // _LEGEND),
        legend={"orientation": "h", "x": 0, "y": 1.03, "yanchor": "bottom", "font": {"size": 13}},
        **layout,
    )


def _add_group(figure: go.Figure, group: Group, measure: str, color: str, column: int) -> None:
    trend = group.trend(measure)
    place = {"row": 1, "col": column}
    common = {"legendgroup": group.name, "hoverinfo": "skip", "showlegend": False}
    n = len(group.runs)
    if n > 1:
        upper, lower = trend.mean + trend.std, trend.mean - trend.std
        figure.add_scatter(
            x=np.concatenate([trend.evaluations, trend.evaluations[::-1]]),
            y=np.concatenate([upper, lower[::-1]]),
            fill="toself",
            fillcolor=translucent(color, 0.16),
            line={"width": 0},
            mode="lines",
            **common,
            **place,
        )
        if n <= MOST_SINGLE_LINES:
            for run in group.runs:
                points = [p for p in run.points if p.measure(measure) is not None]
                figure.add_scatter(
                    x=[p.n_evaluations for p in points],
                    y=[p.measure(measure) for p in points],
                    mode="lines",
                    line={"color": translucent(color, 0.35), "width": 1, "shape": "hv"},
                    **common,
                    **place,
                )
    ends = f"{n} runs, mean ± s.d." if n > 1 else "1 run"
    figure.add_scatter(
        x=trend.evaluations,
        y=trend.mean,
        customdata=trend.std,
        mode="lines" if len(trend.evaluations) > 1 else "markers",
        name=f"{group.name} ({ends})",
        legendgroup=group.name,
        showlegend=column == 1,
        line={"color": color, "width": 2.6, "shape": "hv" if n == 1 else "linear"},
        marker={"color": color, "size": 9},
        hovertemplate="%{y:.1f}" + (" ± %{customdata:.1f}" if n > 1 else "") + f"<extra>{group.name}</extra>",
        **place,
    )


def ends_figure(task: TaskComparison, look: ReportLook) -> go.Figure:
    """Return where each run ended, a line for each group, with its mean and the paper's mean ± s.d. below."""
    figure = make_subplots(cols=2, rows=1, horizontal_spacing=0.05, shared_yaxes=True)
    palette = colors([g.name for g in task.groups])
    first_reference = True
    for column, measure in enumerate(("best", "qd_score"), start=1):
        place = {"row": 1, "col": column}
        for k, group in enumerate(task.groups):
            values = group.values(measure)
            spread = np.linspace(-0.1, 0.1, len(values)) if len(values) > 1 else np.zeros(1)
            figure.add_scatter(
                x=values,
                y=k - 0.14 + spread[: len(values)],
                mode="markers",
                marker={
                    "color": translucent(palette[group.name], 0.75),
                    "size": 11,
                    "line": {"color": palette[group.name], "width": 1},
                },
                showlegend=False,
                hovertemplate=f"{group.name}: %{{x:.2f}} cm<extra></extra>",
                **place,
            )
            if len(values) > 1:
                mean = float(np.mean(values))
                figure.add_scatter(
                    x=[mean, mean],
                    y=[k - 0.32, k + 0.04],
                    mode="lines",
                    line={"color": look.ink, "width": 2.5},
                    name="our mean",
                    legendgroup="mean",
                    showlegend=column == 1 and k == 0,
                    hovertemplate=f"{group.name}, mean: %{{x:.2f}} cm<extra></extra>",
                    **place,
                )
            paper = published.statistics(measure, task.task, group.algorithm)
            if paper is not None:
                figure.add_scatter(
                    x=[paper["mean"]],
                    y=[k + 0.26],
                    error_x={"array": [paper["std"]], "color": look.reference, "thickness": 1.6, "width": 5},
                    mode="markers",
                    marker={"symbol": "diamond", "size": 10, "color": look.reference},
                    name=f"published mean ± s.d. ({published.n_runs()} runs of"
                    f" {published.n_evaluations():,} evaluations)",
                    legendgroup="published",
                    showlegend=first_reference,
                    hovertemplate=f"{group.name}, published: %{{x:.2f}} cm<extra></extra>",
                    **place,
                )
                first_reference = False
        figure.update_xaxes(title_text=AXIS_TITLES[measure], col=column)
    n = len(task.groups)
    names = [on_lines(g.name) for g in task.groups]
    figure.update_yaxes(tickvals=list(range(n)), ticktext=names, range=[n - 0.4, -0.6], showgrid=False)
    return dress(
        figure,
        look,
        width=WIDTH,
        height=140 + _LINE * n,
        legend={"orientation": "h", "x": 0, "y": 1.03, "yanchor": "bottom", "font": {"size": 13}},
        margin={"l": 190, "r": 24, "t": 48, "b": 56},
    )
