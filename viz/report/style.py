"""How the figures of a report look: colours, type, room; on paper and in the dark app."""

from __future__ import annotations

import dataclasses
import html
from typing import Any, Final

import plotly.graph_objects as go

from engine.analysis.comparison.groups import ALGORITHM_NAMES

FONT: Final = "Inter, 'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', sans-serif"
WIDTH: Final = 1080
"""Width of a figure across the whole page, in px."""
_ALGORITHM_COLORS: Final = {
    ALGORITHM_NAMES["vie-neat"]: "#d9731a",
    ALGORITHM_NAMES["map-elites"]: "#3d63b8",
    ALGORITHM_NAMES["dm-me"]: "#17a08d",
}
_OTHER_COLORS: Final = (
    *("#a1458f", "#7a6a3a", "#b03a48", "#6f9f2f", "#7d62d1", "#c9a227", "#3f9fd0", "#c76f95", "#5b6470"),
)


@dataclasses.dataclass(frozen=True, slots=True)
class ReportLook:
    """Colours that depend on the background.

    Attributes:
        background: of the page; transparent where the app shows through.
        ink, muted: of text.
        grid: of lines behind the data.
        empty: of a map's empty cells.
        reference: of published figures.
    """

    background: str
    ink: str
    muted: str
    grid: str
    empty: str
    reference: str


LIGHT: Final = ReportLook("#ffffff", "#1d2430", "#667080", "#e3e7ec", "#edf0f3", "#8a93a0")
DARK: Final = ReportLook("rgba(0,0,0,0)", "#e6e9ee", "#9aa4b2", "#39414d", "#2a313b", "#8a93a0")


def colors(names: list[str]) -> dict[str, str]:
    """Return a colour for each group; those of the paper keep theirs in every report."""
    others = iter(_OTHER_COLORS * (1 + len(names) // len(_OTHER_COLORS)))
    return {n: _ALGORITHM_COLORS.get(n) or next(others) for n in names}


def on_lines(name: str) -> str:
    """Return a group's name as HTML, each of the settings that it names on a line."""
    return html.escape(name).replace(", ", ",<br>")


def translucent(color: str, alpha: float) -> str:
    """Return ``#rrggbb`` with an opacity."""
    r, g, b = (int(color[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({r},{g},{b},{alpha:g})"


def dress(figure: go.Figure, look: ReportLook, *, width: int, height: int, **layout: Any) -> go.Figure:
    """Give a figure its size in px, its type and its quiet axes."""
    figure.update_layout(
        template="none",
        width=width,
        height=height,
        paper_bgcolor=look.background,
        plot_bgcolor="rgba(0,0,0,0)",
        font={"family": FONT, "size": 13, "color": look.ink},
        hoverlabel={"font": {"family": FONT, "size": 12}},
        **{"margin": {"l": 64, "r": 24, "t": 48, "b": 56}} | layout,
    )
    axis = {
        "tickfont": {"size": 12, "color": look.muted},
        "title_font": {"size": 13, "color": look.ink},
        "title_standoff": 8,
        "gridcolor": look.grid,
        "zeroline": False,
        "linecolor": look.grid,
        "ticks": "",
    }
    figure.update_xaxes(**axis)
    figure.update_yaxes(**axis)
    return figure
