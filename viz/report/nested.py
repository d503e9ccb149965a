"""4-D maps drawn nested: a block for every body, in it a cell for every movement."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from engine.analysis.comparison import TaskComparison
from engine.analysis.comparison.run_result import RunResult
from engine.analysis.elite_maps import GRID
from viz.maps import axis_labels
from viz.report.maps import MOST_RUNS, color_axis, hover_text
from viz.report.style import ReportLook, dress

_NESTED: Final = 421
"""Width and height of a nested map in px."""


def nested_figure(
    task: TaskComparison, runs: Sequence[RunResult], labels: Mapping[Any, str], look: ReportLook
) -> go.Figure:
    """Return 4-D maps, two beside each other: a block for every body, in it a cell for every movement.

    Args:
        task: whose colour scale to use.
        runs: that have a map ``grid``.
        labels: a short name of each run, by path.
        look: the colours.
    """
    runs = list(runs)[:MOST_RUNS]
    n_columns, n_rows = min(len(runs), 2), math.ceil(len(runs) / 2)
    gap_x, gap_y = 70, 96
    margin = {"l": 64, "r": 104, "t": 66, "b": 60}
    plot_w = n_columns * _NESTED + (n_columns - 1) * gap_x
    plot_h = n_rows * _NESTED + (n_rows - 1) * gap_y
    figure = make_subplots(
        rows=n_rows,
        cols=n_columns,
        horizontal_spacing=gap_x / plot_w if n_columns > 1 else 0,
        vertical_spacing=gap_y / plot_h if n_rows > 1 else 0,
    )
    for k, run in enumerate(runs):
        row, col = divmod(k, n_columns)
        _add_nested(figure, run, row + 1, col + 1, look)
        place = figure.get_subplot(row + 1, col + 1)
        grid = run.maps[GRID]
        across, up = grid.axes[2:]
        figure.add_annotation(
            text=f"<b>{html.escape(labels[run.path])}</b>   {len(grid.elites)} of"
            f" {grid.n_cells:,} cells filled"
            f"<br><span style='color:{look.muted}'>in each block: {across.name} →, {up.name} ↑</span>",
            x=place.xaxis.domain[0],
            y=place.yaxis.domain[1],
            xref="paper",
            yref="paper",
            xanchor="left",
            yanchor="bottom",
            yshift=4,
            align="left",
            showarrow=False,
            font={"size": 12},
        )
    if len(runs) < n_rows * n_columns:
        figure.update_xaxes(visible=False, row=n_rows, col=n_columns)
        figure.update_yaxes(visible=False, row=n_rows, col=n_columns)
    dress(
        figure,
        look,
        width=plot_w + margin["l"] + margin["r"],
        height=plot_h + margin["t"] + margin["b"],
        margin=margin,
        coloraxis=color_axis(task, look, _NESTED * 0.6),
    )
    figure.update_xaxes(showgrid=False, showline=False)
    figure.update_yaxes(showgrid=False, showline=False)
    return figure


def _add_nested(figure: go.Figure, run: RunResult, row: int, col: int, look: ReportLook) -> None:
    grid = run.maps[GRID]
    outer_x, outer_y, inner_x, inner_y = grid.axes
    step_x, step_y = inner_x.n + 1, inner_y.n + 1  # a strip between blocks
    wide, high = outer_x.n * step_x - 1, outer_y.n * step_y - 1
    z: list[list[float | None]] = [[None] * wide for _ in range(high)]
    under: list[list[int | None]] = [
        [0 if (x + 1) % step_x and (y + 1) % step_y else None for x in range(wide)] for y in range(high)
    ]
    text = [[""] * wide for _ in range(high)]
    for cell, value in grid.values(run.initial_distance).items():
        a, b, c, d = cell
        x, y = a * step_x + c, b * step_y + d
        z[y][x] = 100.0 * value
        text[y][x] = hover_text(grid, cell, run.initial_distance)
    place = {"row": row, "col": col}
    figure.add_heatmap(
        z=under,
        colorscale=[[0, look.empty], [1, look.empty]],
        showscale=False,
        hoverinfo="skip",
        **place,
    )
    figure.add_heatmap(
        z=z,
        text=text,
        hovertemplate="%{text}<extra></extra>",
        hoverongaps=False,
        coloraxis="coloraxis",
        **place,
    )
    for axis, step, n, update in (
        (outer_x, step_x, inner_x.n, figure.update_xaxes),
        (outer_y, step_y, inner_y.n, figure.update_yaxes),
    ):
        update(
            tickvals=[i * step + (n - 1) / 2 for i in range(axis.n)],
            ticktext=[axis_labels.value(axis, i) for i in range(axis.n)],
            title_text=axis_labels.title(axis),
            range=[-0.5, axis.n * step - 1.5],
            **place,
        )
