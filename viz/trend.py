"""Best fitness and QD score over evaluations, as SVG."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence

from engine.reader import Generation

WIDTH, HEIGHT = 376, 120
LEFT, RIGHT, TOP, BOTTOM = 34, 42, 14, 22
BEST_COLOR, QD_COLOR = "#36b3a0", "#e0a458"


def render(generations: Sequence[Generation], archive: str, shown: int | None = None) -> str:
    """Return the trend of an archive as SVG.

    Args:
        generations: all of them, in order.
        archive: whose figures.
        shown: number of the generation that the maps show, to be marked.
    """
    points = [
        (g.n_evaluations, 100 * f.best, 100 * f.qd_score, g.number)
        for g in generations
        if (f := g.archives.get(archive)) is not None and f.best is not None
    ]
    head = (
        f'<svg class="ta-trend" viewBox="0 0 {WIDTH} {HEIGHT}" width="100%"'
        ' style="display:block;font:10px system-ui,sans-serif">'
    )
    if not points:
        return head + (
            f'<text x="{WIDTH / 2}" y="{HEIGHT / 2}" text-anchor="middle" fill="currentColor"'
            ' fill-opacity="0.7">the trend begins with the first generation</text></svg>'
        )
    x_max = points[-1][0]
    x_min = 0 if len(points) == 1 else points[0][0]
    best = _Scale([p[1] for p in points])
    qd = _Scale([p[2] for p in points])

    def x(n: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * (n - x_min) / max(x_max - x_min, 1)

    parts = [head]
    for part in (0.0, 0.5, 1.0):
        y = TOP + (HEIGHT - TOP - BOTTOM) * (1 - part)
        parts.append(
            f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y}" y2="{y}" stroke="currentColor"'
            ' stroke-opacity="0.15"/>'
            f'<text x="{LEFT - 4}" y="{y + 3}" text-anchor="end" fill="{BEST_COLOR}">'
            f"{best.label(part)}</text>"
            f'<text x="{WIDTH - RIGHT + 4}" y="{y + 3}" fill="{QD_COLOR}">{qd.label(part)}</text>'
        )
    for n, anchor in ((x_min, "start"), (x_max, "end")):
        parts.append(
            f'<text x="{x(n)}" y="{HEIGHT - 8}" text-anchor="{anchor}" fill="currentColor"'
            f' fill-opacity="0.75">{n}</text>'
        )
    parts.append(
        f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 8}" text-anchor="middle"'
        f' fill="currentColor">evaluations · {html.escape(archive)} archive</text>'
    )
    for k, (scale, color) in enumerate(((best, BEST_COLOR), (qd, QD_COLOR))):
        line = " ".join(f"{x(p[0]):.1f},{scale.y(p[1 + k]):.1f}" for p in points)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{color}" stroke-width="1.8"/>')
        if len(points) == 1:
            parts.append(
                f'<circle cx="{x(points[0][0])}" cy="{scale.y(points[0][1 + k])}" r="2.5" fill="{color}"/>'
            )
    for p in points:
        if p[3] == shown:
            parts.append(
                f'<line x1="{x(p[0]):.1f}" x2="{x(p[0]):.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"'
                ' stroke="currentColor" stroke-opacity="0.5" stroke-dasharray="3 2"/>'
            )
    parts.append(
        f'<text x="{LEFT}" y="9" fill="{BEST_COLOR}">best f_s, cm</text>'
        f'<text x="{WIDTH - RIGHT}" y="9" text-anchor="end" fill="{QD_COLOR}">QD score, cm</text></svg>'
    )
    return "".join(parts)


class _Scale:
    """A vertical axis that holds its values with a little room."""

    def __init__(self, values: Sequence[float]) -> None:
        low, high = min(values), max(values)
        room = 0.06 * (high - low) or max(abs(high) * 0.1, 0.5)
        self.low, self.high = low - room, high + room

    def y(self, value: float) -> float:
        part = (value - self.low) / (self.high - self.low)
        return TOP + (HEIGHT - TOP - BOTTOM) * (1 - part)

    def label(self, part: float) -> str:
        value = self.low + part * (self.high - self.low)
        digits = max(0, 2 - math.floor(math.log10(max(abs(value), 0.1))) - 1)
        return f"{value:.{digits}f}"
