"""What each module is told and what it does over time: one row per module, ten seconds at a time."""

from __future__ import annotations

import math

import numpy as np

from engine.body import module as t
from viz import theme

WIDTH = 300
LEFT, RIGHT = 24.0, 296.0
TOP = 4.0
PAGE = 10.0
"""Seconds that a picture shows."""
COMMANDED, REACHED = "#8b93a1", "#f08a3c"
_ROW, _ROW_OF_FEW = 19.0, 30.0
_SCALE = 0.8
"""Part of a row's height between released and contracted."""


def page_of(time: float, start: float, end: float) -> tuple[float, float]:
    """Return the span of the picture that shows a time of a replay; all in s.

    Args:
        time: to be shown.
        start: of the replay.
        end: of its evaluated part, where a picture ends; beyond it another series of pictures begins.
    """
    if time > end + 1e-9:
        start = end
    first = start + PAGE * math.floor((time - start) / PAGE + 1e-9)
    if time <= end + 1e-9:
        first = min(first, max(end - PAGE, start))
    return first, first + PAGE


def samples(page: tuple[float, float], start: float, period: float, n_frames: int, *, step: int = 1) -> slice:
    """Return which of a replay's frames a picture shows, from the one where it begins.

    Args:
        page: the span of the picture, in s.
        start: of the replay, one ``period`` before its first frame, in s.
        period: between two frames, in s.
        n_frames: simulated so far.
        step: frames between two samples.
    """
    first, last = (round((t - start) / period) - 1 for t in page)
    return slice(max(min(first, n_frames - 1), 0), last + 1, step)


def render(
    times: np.ndarray,
    commanded: np.ndarray,
    reached: np.ndarray,
    *,
    page: tuple[float, float],
    head: int,
    on_pointer: str = "",
) -> str:
    """Return the picture.

    Args:
        times: (T,) of the samples, in s.
        commanded: (T, modules) contraction that the servos were told, 0 released to 1; NaN while off.
        reached: (T, modules) contraction of the modules.
        page: the span of the picture, in s.
        head: index of the head module.
        on_pointer: JavaScript, already escaped for an attribute, for a pointer that is pressed on the
            picture; ``data-span`` has where the page begins and ends.
    """
    n = commanded.shape[1]
    row = _ROW if n > 4 else _ROW_OF_FEW
    bottom = TOP + n * row
    parts = [
        f'<svg class="ta-servos" viewBox="0 0 {WIDTH} {bottom + 16:.0f}" width="100%"'
        f' data-span="{LEFT:g},{RIGHT:g}" onpointerdown="{on_pointer}" onpointermove="{on_pointer}"'
        ' style="display:block;font:9px system-ui,sans-serif;font-variant-numeric:tabular-nums;'
        'cursor:ew-resize;touch-action:none">'
    ]
    for second in range(math.ceil(page[0] - 1e-9), math.floor(page[1] + 1e-9) + 1):
        if second % 2 == 0:
            tick = position(second, page)
            parts.append(
                f'<path d="M{tick:.1f} {TOP}V{bottom:.0f}" stroke="currentColor"'
                f' stroke-opacity="{0.35 if second == 0 else 0.12}"/>'
                f'<text x="{tick:.1f}" y="{bottom + 11:.0f}" text-anchor="middle" fill="currentColor"'
                f' fill-opacity="0.65">{second}{" s" if second == 0 else ""}</text>'
            )
    shown = (times >= page[0] - 1e-9) & (times <= page[1] + 1e-9)
    x = LEFT + (times[shown] - page[0]) / PAGE * (RIGHT - LEFT)
    for m in range(n):
        base = TOP + (m + 1) * row - row * (1.0 - _SCALE) / 2
        weight = ' style="font-weight:700"' if m == head else ""
        parts.append(
            f'<g data-m="{m}"><rect class="ta-back" x="2" y="{TOP + m * row:.1f}" width="{WIDTH - 4}"'
            f' height="{row:g}" rx="3" fill-opacity="0"/>'
            f'<text x="{LEFT - 7}" y="{base - row * _SCALE / 2 + 3:.1f}" text-anchor="end"'
            f' fill="currentColor"{weight}>{t.module_number(m)}'
            f"<title>module {t.module_number(m)}{', the head' if m == head else ''}</title></text>"
            f'<path d="M{LEFT} {base:.1f}H{RIGHT}" stroke="currentColor" stroke-opacity="0.18"/>'
        )
        for values, color, width in ((commanded, COMMANDED, 1.0), (reached, REACHED, 1.4)):
            y = base - row * _SCALE * np.clip(values[shown, m], -0.1, 1.1)
            parts.append(
                f'<path d="{_path(x, y)}" fill="none" stroke="{color}" stroke-width="{width}"'
                ' stroke-linejoin="round"/>'
            )
        parts.append("</g>")
    parts.append(
        f'<path class="ta-cursor" d="M0 {TOP}V{bottom:.0f}" stroke="{theme.SELECTED}"'
        ' stroke-width="1.4"/></svg>'
    )
    return "".join(parts)


def cursor_style(time: float, page: tuple[float, float]) -> str:
    """Return the rule that puts the cursor at a time."""
    return f".ta-servos .ta-cursor{{transform:translateX({position(time, page):.1f}px)}}"


def position(time: float, page: tuple[float, float]) -> float:
    """Return where a time is in the picture."""
    return LEFT + (min(max(time, page[0]), page[1]) - page[0]) / PAGE * (RIGHT - LEFT)


def legend() -> str:
    """Return what the lines mean."""

    def line(color: str) -> str:
        return (
            f'<svg width="16" height="8" style="vertical-align:middle"><path d="M1 4h14" stroke="{color}"'
            ' stroke-width="1.8"/></svg>'
        )

    return (
        '<div class="ta-servos-legend" style="font-size:11px;opacity:.75;padding:2px 10px 4px"'
        ' title="The mean length of the five internal cables: at the bottom of a row that of a released'
        ' servo, 42.6 mm, at the top that of one turned by 180°, 21.9 mm">'
        f"contraction by module: {line(COMMANDED)} commanded {line(REACHED)} reached</div>"
    )


def _path(x: np.ndarray, y: np.ndarray) -> str:
    """Return the path through points, interrupted where one is not a number."""
    parts, down = [], False
    for a, b in zip(x.tolist(), y.tolist(), strict=True):
        if math.isnan(b):
            down = False
            continue
        parts.append(f"{'L' if down else 'M'}{a:.1f} {b:.1f}")
        down = True
    return "".join(parts)
