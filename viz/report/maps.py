"""The maps of all runs in the paper's arrangement; all maps of a task share one colour scale."""

from __future__ import annotations

import dataclasses
import html
from collections.abc import Mapping
from typing import Any, Final

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from engine.analysis.comparison import TaskComparison
from engine.analysis.comparison.run_result import RunResult
from engine.analysis.elite_maps import CONTROLLER, MORPHOLOGY, EliteMap
from engine.search.archive import Cell
from engine.search.axes import Axis
from viz.maps import axis_labels
from viz.maps.scale import STEPS, Scale, fitness_scale
from viz.report.style import ReportLook, dress, on_lines

COLUMNS: Final = 5
"""Maps beside each other, as in the paper."""
MOST_RUNS: Final = 10
"""Runs of one group that are drawn; the paper has ten."""
_MAP_WIDTHS: Final = {1: 270, 2: 270, 3: 262, 4: 196, 5: 151}
"""Width of a map in px by how many lie beside each other."""
_LEFT: Final = 92
_RIGHT: Final = 96
_GAP_X, _GAP_Y = 34, 62
_TOP: Final = 46


@dataclasses.dataclass(frozen=True, slots=True)
class _Panel:
    title: str
    map: EliteMap
    run: RunResult


def task_scale(task: TaskComparison) -> Scale:
    """Return the colour scale that all maps of a task share, in cm."""
    return fitness_scale(
        [
            100.0 * v
            for run in task.runs
            for shown in run.maps.values()
            for v in shown.values(run.initial_distance).values()
        ],
        signed=True,
    )


def maps_figure(task: TaskComparison, labels: Mapping[Any, str], look: ReportLook) -> go.Figure:
    """Return the morphology maps, then the controller maps, a row of runs for each group.

    With a single run of each group the groups lie beside each other instead.

    Args:
        task: whose runs.
        labels: a short name of each run, by path.
        look: the colours.
    """
    rows = _rows(task, labels)
    n_columns = max(len(panels) for _, panels in rows)
    side = _MAP_WIDTHS[n_columns]
    width = _LEFT + _RIGHT + n_columns * side + (n_columns - 1) * _GAP_X
    height_of_map = side if n_columns > 3 else round(side * 0.86)
    height = _TOP + len(rows) * height_of_map + (len(rows) - 1) * _GAP_Y + 58
    plot_w, plot_h = width - _LEFT - _RIGHT, height - _TOP - 58
    figure = make_subplots(
        rows=len(rows),
        cols=n_columns,
        horizontal_spacing=_GAP_X / plot_w if n_columns > 1 else 0,
        vertical_spacing=_GAP_Y / plot_h if len(rows) > 1 else 0,
    )
    for r, (row_title, panels) in enumerate(rows, start=1):
        for c in range(1, n_columns + 1):
            panel = panels[c - 1] if c <= len(panels) else None
            if panel is None:
                figure.update_xaxes(visible=False, row=r, col=c)
                figure.update_yaxes(visible=False, row=r, col=c)
                continue
            left = next(filter(None, panels[: c - 1]), None)
            _add_map(figure, panel, left, (r, c), look)
            domain = figure.get_subplot(r, c)
            figure.add_annotation(
                text=panel.title,
                x=sum(domain.xaxis.domain) / 2,
                y=domain.yaxis.domain[1],
                xref="paper",
                yref="paper",
                xanchor="center",
                yanchor="bottom",
                yshift=3,
                showarrow=False,
                font={"size": 12},
            )
        figure.add_annotation(
            text=row_title,
            x=0,
            xshift=-_LEFT + 4,
            y=sum(figure.get_subplot(r, 1).yaxis.domain) / 2,
            xref="paper",
            yref="paper",
            textangle=-90,
            xanchor="left",
            yanchor="middle",
            showarrow=False,
            font={"size": 13},
        )
    dress(
        figure,
        look,
        width=width,
        height=height,
        margin={"l": _LEFT, "r": _RIGHT, "t": _TOP, "b": 58},
        coloraxis=color_axis(task, look, height_of_map),
    )
    figure.update_xaxes(tickfont_size=10, title_font_size=11, title_standoff=3, showgrid=False)
    figure.update_yaxes(tickfont_size=10, title_font_size=11, title_standoff=3, showgrid=False)
    return figure


def _rows(task: TaskComparison, labels: Mapping[Any, str]) -> list[tuple[str, list[_Panel | None]]]:
    """Return the titles of the rows and their maps, None for a gap."""
    kinds = [n for n in (MORPHOLOGY, CONTROLLER) if any(n in r.maps for r in task.runs)]
    if all(len(g.runs) == 1 for g in task.groups) and len(task.groups) <= COLUMNS:
        return [
            (
                f"<b>{name} maps</b>",
                [
                    _Panel(on_lines(g.name) + _how(g.runs[0], name), g.runs[0].maps[name], g.runs[0])
                    if name in g.runs[0].maps
                    else None
                    for g in task.groups
                ],
            )
            for name in kinds
        ]
    rows: list[tuple[str, list[_Panel | None]]] = []
    for name in kinds:
        for group in task.groups:
            runs = [r for r in group.runs[:MOST_RUNS] if name in r.maps]
            for k in range(0, len(runs), COLUMNS):
                title = f"<b>{on_lines(group.name)}</b><br>{name}{_how(runs[0], name)}"
                part = runs[k : k + COLUMNS]
                rows.append((title, [_Panel(html.escape(labels[r.path]), r.maps[name], r) for r in part]))
    return rows


def _how(run: RunResult, name: str) -> str:
    """Return how a map was made, if it is no archive that the algorithm worked with."""
    if run.config.algorithm == "vie-neat":
        return " (reconstructed)"
    return " (projected)" if run.maps[name].projected else ""


def _add_map(
    figure: go.Figure, panel: _Panel, left: _Panel | None, position: tuple[int, int], look: ReportLook
) -> None:
    """Draw a map at a (row, column), without the labels that it shares with the leftmost of its row."""
    shown = panel.map if len(panel.map.axes) == 2 else panel.map.project((0, 1))
    x_axis, y_axis = shown.axes
    values = {c: 100.0 * v for c, v in shown.values(panel.run.initial_distance).items()}
    z = [[values.get((i, j)) for i in range(x_axis.n)] for j in range(y_axis.n)]
    hover = [
        [hover_text(shown, (i, j), panel.run.initial_distance) for i in range(x_axis.n)]
        for j in range(y_axis.n)
    ]
    place = {"row": position[0], "col": position[1]}
    # what lies under the cells shows where one is empty
    figure.add_heatmap(
        z=[[0] * x_axis.n for _ in range(y_axis.n)],
        colorscale=[[0, look.empty], [1, look.empty]],
        showscale=False,
        hoverinfo="skip",
        xgap=1.5,
        ygap=1.5,
        **place,
    )
    figure.add_heatmap(
        z=z,
        text=hover,
        hovertemplate="%{text}<extra></extra>",
        coloraxis="coloraxis",
        xgap=1.5,
        ygap=1.5,
        **place,
    )
    for axis, update in ((x_axis, figure.update_xaxes), (y_axis, figure.update_yaxes)):
        at, text = _ticks(axis)
        beside_its_like = (
            left is not None and update == figure.update_yaxes and left.map.axes[1].name == axis.name
        )
        if beside_its_like and not axis.name.startswith("PCA"):
            text = [""] * len(at)  # the same as of the first map of the row
        update(
            tickvals=at,
            ticktext=text,
            title_text="" if beside_its_like else axis_labels.title(axis),
            showline=False,
            range=[-0.5, axis.n - 0.5],
            **place,
        )


def hover_text(shown: EliteMap, cell: Cell, initial_distance: float) -> str:
    """Return what a hover card says of a cell."""
    if cell not in shown.elites:
        return "empty cell"
    fitness, number = shown.elites[cell]
    where = axis_labels.describe(shown.axes, cell)
    return f"f<sub>s</sub> {100 * (initial_distance - fitness):.2f} cm<br>{where}<br>robot {number}"


def _ticks(axis: Axis) -> tuple[list[int], list[str]]:
    """Return some cells of an axis and their labels, few enough not to crowd a small map."""
    if axis.name == "modules":
        at = list(range(0, axis.n, 2))
    elif axis.name.startswith("PCA"):
        at = sorted({0, (axis.n - 1) // 2, axis.n - 1})
    else:
        at = list(range(1, axis.n, 3))
    return at, [axis_labels.value(axis, i) for i in at]


def color_axis(task: TaskComparison, look: ReportLook, length: float) -> dict[str, Any]:
    """Return the colour axis that all maps of a task share; its bar is at least 180 px long."""
    scale = task_scale(task)
    ticks = scale.ticks()
    return {
        "cmin": scale.low,
        "cmax": scale.high,
        "colorscale": _colors(scale),
        "colorbar": {
            "title": {"text": "f<sub>s</sub> (cm)", "font": {"size": 12}},
            "thickness": 12,
            "lenmode": "pixels",
            "len": max(length, 180),
            "y": 1,
            "yanchor": "top",
            "x": 1,
            "xpad": 18,
            "outlinewidth": 0,
            "tickvals": [scale.value(part) for part in ticks],
            "ticktext": list(ticks.values()),
            "tickfont": {"size": 11, "color": look.muted},
        },
    }


def _colors(scale: Scale) -> list[tuple[float, str]]:
    """Return the colours of a scale, as in the app, by how far on the way from its low to its high end."""
    parts = [k / (STEPS - 1) for k in range(STEPS)]
    whole = scale.high - scale.low
    return [((scale.value(p) - scale.low) / whole, scale.step_color(k)) for k, p in enumerate(parts)]
