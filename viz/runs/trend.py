"""Best and mean f_s, QD scores, coverage and good cells over evaluations as small diagrams in one SVG."""

from __future__ import annotations

import dataclasses
import html
import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from engine.analysis.profile import Profile, ProfileHistory
from engine.storage.rows import ArchiveFigures, Generation
from viz import words

WIDTH: Final = 396
COLUMN, ROW = 206, 72
PLOT_WIDTH, PLOT_HEIGHT = 158, 40
LEFT, TOP, BOTTOM = 30, 20, 14
COLORS: Final = ("var(--ta-first,#2fa592)", "var(--ta-second,#d08b34)")
"""Colours of the first and of the second archive: legible on dark and on light ground."""
MAX_POINTS: Final = 160
"""Generations that are drawn; more would lie on the same pixels."""


@dataclasses.dataclass(frozen=True, slots=True)
class Measure:
    """One of the diagrams.

    Attributes:
        name: its title.
        unit: of its values.
        of: the value of an archive's figures and profile, None if there is none.
        digits: after the point, of values for people.
    """

    name: str
    unit: str
    of: Callable[[ArchiveFigures, Profile], float | None]
    digits: int

    def text(self, value: float | None) -> str:
        """Return a value for people."""
        return "–" if value is None else f"{value:.{self.digits}f}"


MEASURES: Final = (
    Measure("best f_s", "cm", lambda f, _: _times_100(f.best), 2),
    Measure("mean f_s", "cm", lambda f, _: _times_100(f.mean), 2),
    Measure("QD score", "cm", lambda f, _: _times_100(f.qd_score), 0),
    Measure("coverage", "%", lambda f, _: _times_100(f.coverage), 0),
    Measure("cells above {threshold}", "", lambda _, p: float(p.above), 0),
    Measure("QD with offset", "cm", lambda _, p: _times_100(p.offset_qd_score), 0),
)

EXPLAINED: Final = {
    "best f_s": words.F_S,
    "mean f_s": words.F_S,
    "QD score": words.QD_SCORE,
    "coverage": words.COVERAGE,
}
"""What there is to say about some of them."""
ROWS: Final = len(MEASURES) // 2


def render(generations: Sequence[Generation], history: ProfileHistory, shown: int | None = None) -> str:
    """Return the trends of all archives of a run as SVG.

    Args:
        generations: all of them, in order.
        history: the profiles of these generations.
        shown: number of the generation that the maps show: it is marked, and titles give its values.
    """
    archives = sorted(
        {name for g in generations for name, f in g.archives.items() if f.best is not None},
        key=lambda name: (name != "morphology", name),
    )[: len(COLORS)]
    points = [g for g in generations if any(_known(g, name) for name in archives)]
    if not points:
        return (
            f'<svg class="ta-trend" viewBox="0 0 {WIDTH} 60" width="100%" style="display:block;font:10px'
            f' system-ui,sans-serif"><text x="{WIDTH / 2}" y="34" text-anchor="middle" fill="currentColor"'
            ' fill-opacity="0.75">the trends begin with the first generation</text></svg>'
        )
    now = next((g for g in points if g.number == shown), points[-1])
    points = _thinned(points)
    x = _across(points)
    measures = [dataclasses.replace(m, name=m.name.format(threshold=_limit(history))) for m in MEASURES]
    series = [{name: [_value(p, name, m, history) for p in points] for name in archives} for m in measures]
    current = [{name: _value(now, name, m, history) for name in archives} for m in measures]
    plots = [_plot(k, m, points, series[k], (now, current[k]), x) for k, m in enumerate(measures)]
    marks = "".join(
        f"M{_corner(k)[0]} {_corner(k)[1]}v{PLOT_HEIGHT}" for k in range(len(MEASURES))
    )  # of all diagrams together, to be moved along by the pointer
    parts = [
        f'<svg class="ta-trend" viewBox="0 0 {WIDTH} {ROWS * ROW + 30}" width="100%" style="display:block;'
        'font:10px system-ui,sans-serif;font-variant-numeric:tabular-nums"'
        f' data-plots="{";".join("{},{}".format(*_corner(k)) for k in range(len(MEASURES)))}"'
        f' data-plot="{PLOT_WIDTH},{PLOT_HEIGHT}" data-points="{_table(points, measures, series, x)}">',
        _legend(archives),
        *plots,
        f'<path class="ta-at" d="{marks}" stroke="currentColor" stroke-opacity="0.8" fill="none"'
        ' visibility="hidden" pointer-events="none"/>',
        "</svg>",
    ]
    return "".join(parts)


def _plot(
    k: int,
    measure: Measure,
    points: Sequence[Generation],
    series: Mapping[str, Sequence[float | None]],
    shown: tuple[Generation, Mapping[str, float | None]],
    x: Callable[[int], float],
) -> str:
    left, top = _corner(k)
    now, current = shown
    y = _ValueAxis([v for values in series.values() for v in values if v is not None], measure)
    parts = []
    for part in (0.0, 1.0):
        line = top + PLOT_HEIGHT * (1 - part)
        parts.append(
            f'<line x1="{left}" x2="{left + PLOT_WIDTH}" y1="{line}" y2="{line}" stroke="currentColor"'
            f' stroke-opacity="0.2"/><text x="{left - 4}" y="{line + 3}" text-anchor="end"'
            f' fill="currentColor" fill-opacity="0.7" font-size="9">{y.label(part)}</text>'
        )
    at = left + x(now.n_evaluations)
    parts.append(
        f'<line x1="{at:.1f}" x2="{at:.1f}" y1="{top}" y2="{top + PLOT_HEIGHT}" stroke="currentColor"'
        ' stroke-opacity="0.45" stroke-dasharray="3 2"/>'
    )
    title = html.escape(measure.name).replace("f_s", 'f<tspan dy="2" font-size="8">s</tspan>')
    values = []
    for name, color in zip(series, COLORS, strict=False):
        drawn = [
            (left + x(p.n_evaluations), top + y(v))
            for p, v in zip(points, series[name], strict=True)
            if v is not None
        ]
        line_ = " ".join(f"{a:.1f},{b:.1f}" for a, b in drawn)
        parts.append(
            f'<polyline points="{line_}" fill="none" stroke="{color}" stroke-width="1.6"'
            ' stroke-linejoin="round"/>'
        )
        value = current[name]
        if value is not None:
            parts.append(f'<circle cx="{at:.1f}" cy="{top + y(value):.1f}" r="2.4" fill="{color}"/>')
        values.append(f'<tspan fill="{color}" font-weight="600"> {measure.text(value)}</tspan>')
    back = '<tspan dy="-2"> </tspan>' if "f_s" in measure.name else ""
    parts.append(
        f'<text x="{left}" y="{top - 6}" fill="currentColor">{_explanation(measure)}'
        f"{title}{back}{''.join(values)}"
        f'<tspan fill-opacity="0.75"> {measure.unit}</tspan></text>'
    )
    if k >= len(MEASURES) - 2:
        first, last = points[0].n_evaluations, points[-1].n_evaluations
        ends = [(x(last), "end", f"{last:,} evaluations")]
        if x(first) < PLOT_WIDTH / 4:
            ends.append((x(first), "start", f"{first:,}"))
        parts += [
            f'<text x="{left + place:.1f}" y="{top + PLOT_HEIGHT + 12}" text-anchor="{anchor}"'
            f' fill="currentColor" fill-opacity="0.7" font-size="9">{label}</text>'
            for place, anchor, label in ends
        ]
    return "".join(parts)


def _explanation(measure: Measure) -> str:
    """Return the sentence about a measure that a mouse brings up, as SVG; empty for none."""
    sentence = EXPLAINED.get(measure.name)
    return "" if sentence is None else f"<title>{html.escape(words.plain(sentence))}</title>"


def _legend(archives: Sequence[str]) -> str:
    if len(archives) < 2:
        return ""
    parts = [
        f'<tspan fill="{color}">●</tspan> {html.escape(name)}{"  " if k == 0 else ""}'
        for k, (name, color) in enumerate(zip(archives, COLORS, strict=True))
    ]
    return (
        f'<text x="{WIDTH - 4}" y="{ROWS * ROW + 26}" text-anchor="end" fill="currentColor"'
        f' fill-opacity="0.85" style="white-space:pre">{"".join(parts)}</text>'
    )


def _table(
    points: Sequence[Generation],
    measures: Sequence[Measure],
    series: Sequence[Mapping[str, Sequence[float | None]]],
    x: Callable[[int], float],
) -> str:
    """Return places and hover cards of the generations as JSON, escaped for an attribute."""
    rows = []
    for k, p in enumerate(points):
        lines = [f"generation {p.number}, {p.n_evaluations:,} evaluations"]
        for measure, of_archives in zip(measures, series, strict=True):
            values = " · ".join(measure.text(found[k]) for found in of_archives.values())
            lines.append(f"{measure.name} {values} {measure.unit}".rstrip())
        rows.append([round(x(p.n_evaluations), 1), "\n".join(lines)])
    return html.escape(json.dumps(rows, ensure_ascii=False, separators=(",", ":")))


def _corner(k: int) -> tuple[int, int]:
    """Return the upper left corner of a diagram."""
    row, column = divmod(k, 2)
    return LEFT + column * COLUMN, TOP + row * ROW


def _across(points: Sequence[Generation]) -> Callable[[int], float]:
    """Return where in a diagram a number of evaluations lies."""
    first = points[0].n_evaluations if len(points) > 1 else 0
    span = max(points[-1].n_evaluations - first, 1)
    return lambda n: PLOT_WIDTH * (n - first) / span


def _thinned(points: list[Generation]) -> list[Generation]:
    """Return some of them at even intervals, from the first to the last."""
    if len(points) <= MAX_POINTS:
        return points
    step = (len(points) - 1) / (MAX_POINTS - 1)
    return [points[round(k * step)] for k in range(MAX_POINTS)]


def _known(generation: Generation, archive: str) -> bool:
    return archive in generation.archives and generation.archives[archive].best is not None


def _value(generation: Generation, archive: str, measure: Measure, history: ProfileHistory) -> float | None:
    figures, profile = generation.archives.get(archive), history.get(generation.number, archive)
    return None if figures is None or profile is None else measure.of(figures, profile)


def _limit(history: ProfileHistory) -> str:
    return f"{100 * history.threshold:.2f} cm"


def _times_100(value: float | None) -> float | None:
    return None if value is None else 100 * value


class _ValueAxis:
    """A vertical axis that holds its values, of which there is at least one, with a little room."""

    def __init__(self, values: Sequence[float], measure: Measure) -> None:
        low, high = min(values), max(values)
        room = 0.06 * (high - low) or max(abs(high) * 0.1, 0.5)
        # no room below zero for what is never negative
        self.low, self.high = low - room if low < 0.0 else max(low - room, 0.0), high + room
        self._measure = measure

    def __call__(self, value: float) -> float:
        part = (value - self.low) / (self.high - self.low)
        return PLOT_HEIGHT * (1 - part)

    def label(self, part: float) -> str:
        value = self.low + part * (self.high - self.low)
        digits = max(0, 1 - math.floor(math.log10(max(abs(value), 0.1))))
        text = f"{value:.{min(digits, self._measure.digits)}f}"
        return text.lstrip("-") if float(text) == 0 else text
