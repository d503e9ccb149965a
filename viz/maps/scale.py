"""Colour scales: which value takes which colour, and how a bar says so."""

from __future__ import annotations

import dataclasses
import functools
import html
import math
from collections.abc import Collection

import numpy as np

from viz import theme

STEPS = 49
"""Colours of a scale; the middle one is 0's where 0 is the middle. More could not be told apart; fewer
colours make smaller pictures."""
_STOPS = 12
NO_VALUE = "#7d8590"
"""The colour of a filled cell whose value is not known."""


@dataclasses.dataclass(frozen=True, slots=True)
class Scale:
    """A colour scale.

    Attributes:
        title: quantity and unit; ``f_s`` is set with its subscript.
        low, high: values at its ends.
        below, above: whether values beyond an end are drawn in its colour.
        whole: whether values are whole numbers.
        colormap: one of ``theme.MAPS``.
        signed: whether 0 stands apart: if values lie on both sides of it, it is the middle of the scale,
            grey, and each side has half of the colours.
    """

    title: str
    low: float
    high: float
    below: bool = False
    above: bool = False
    whole: bool = False
    colormap: str = "viridis"
    signed: bool = False

    @property
    def about_zero(self) -> bool:
        """Whether 0 is its middle."""
        return self.signed and self.low < 0.0 < self.high

    def part(self, value: float) -> float:
        """Return where on the scale, 0 to 1, a value lies."""
        if self.about_zero:
            part = 0.5 + 0.5 * value / (self.high if value > 0.0 else -self.low)
        else:
            part = (value - self.low) / (self.high - self.low)
        return min(max(part, 0.0), 1.0)

    def value(self, part: float) -> float:
        """Return the value at a part, 0 to 1, of the scale."""
        if self.about_zero:
            return (2.0 * part - 1.0) * (self.high if part > 0.5 else -self.low)
        return self.low + part * (self.high - self.low)

    def step(self, value: float | None) -> int | None:
        """Return which of the ``STEPS`` colours a value takes, None for an unknown one."""
        if value is None:
            return None
        return round((STEPS - 1) * self.part(value))

    def color(self, value: float | None) -> str:
        """Return the ``#rrggbb`` colour of a value."""
        return self.step_color(self.step(value))

    def step_color(self, step: int | None) -> str:
        """Return the ``#rrggbb`` colour of a step."""
        return NO_VALUE if step is None else _color(step, self.colormap, self.about_zero)

    def ticks(self) -> dict[float, str]:
        """Return labels by their part, 0 to 1, of the scale."""
        values = [self.value(p) for p in (0.0, 0.25, 0.5, 0.75, 1.0)]
        if self.whole:
            values = sorted({float(round(v)) for v in values})
        labels = {self.part(v): (f"{v:.0f}" if self.whole else f"{v:.3g}") for v in values}
        if self.below:
            labels[0.0] = f"≤{labels[0.0]}"
        if self.above:
            labels[1.0] = f"≥{labels[1.0]}"
        return labels

    def title_markup(self) -> str:
        """Return the title as the content of an SVG text."""
        subscript = 'f<tspan dy="3" font-size="8">s</tspan><tspan dy="-3">'
        text = html.escape(self.title)
        return text.replace("f_s", subscript, 1) + "</tspan>" if "f_s" in text else text


@dataclasses.dataclass(frozen=True, slots=True)
class Palette:
    """How a user wants maps to be coloured, whatever the colours stand for.

    Attributes:
        colormap: one of ``theme.MAPS``.
        limits: ends of the scale of fitnesses in cm, the first one below the second; None to fit the maps.
    """

    colormap: str = "viridis"
    limits: tuple[float, float] | None = None

    def apply(self, scale: Scale, shown: Collection[float], *, lengths: bool) -> Scale:
        """Return a scale as the user wants it.

        Args:
            scale: that fits the maps.
            shown: the values to be coloured; the scale says if some lie beyond its ends.
            lengths: whether they are fitnesses in cm, which the limits are for.
        """
        low, high = self.limits if self.limits and lengths else (scale.low, scale.high)
        return dataclasses.replace(
            scale,
            low=low,
            high=high,
            below=min(shown, default=low) < low,
            above=max(shown, default=high) > high,
            colormap=self.colormap,
        )


def color_limits(values: Collection[float]) -> tuple[float, float]:
    """Return the ends of a scale for values in cm, rounded outwards to whole centimetres.

    It ends at the best value and begins at the 5th percentile: a few robots that run away from their
    targets would otherwise take the colours from all others.
    """
    if not values:
        return (0.0, 1.0)
    low, high = math.floor(np.percentile(list(values), 5)), math.ceil(max(values))
    return (float(low), float(max(high, low + 1)))


def fitness_scale(values: Collection[float], title: str = "f_s cm", *, signed: bool = False) -> Scale:
    """Return a scale for fitnesses in cm."""
    low, high = color_limits(values)
    return Scale(title, low, high, below=min(values, default=low) < low, signed=signed)


def count_scale(values: Collection[float], title: str) -> Scale:
    """Return a scale from 0 for counts; the largest twentieth of them share its last colour."""
    if not values:
        return Scale(title, 0.0, 1.0, whole=True)
    high = float(max(math.ceil(np.percentile(list(values), 95)), 1))
    return Scale(title, 0.0, high, above=max(values) > high, whole=True)


def bar(scale: Scale, x: float, y: float, width: float, height: float) -> str:
    """Return the colours of a bar as SVG: upwards if it is taller than wide, else to the right."""
    upright = height > width
    name = f"ta-{scale.colormap}{'-zero' if scale.about_zero else ''}-{'up' if upright else 'right'}"
    direction = 'x1="0" y1="1" x2="0" y2="0"' if upright else 'x1="0" y1="0" x2="1" y2="0"'
    return (
        f'<linearGradient id="{name}" {direction}>{_stops(scale.colormap, scale.about_zero)}</linearGradient>'
        f'<rect x="{x}" y="{y}" width="{width}" height="{height}" fill="url(#{name})"/>'
    )


@functools.cache  # of the few colour maps there are; asking Plotly for the colours takes 10 ms
def _stops(colormap: str, about_zero: bool) -> str:
    parts = [k / _STOPS for k in range(_STOPS + 1)]
    return "".join(
        f'<stop offset="{part:.4g}" stop-color="{theme.color_at(part, colormap, about_zero=about_zero)}"/>'
        for part in parts
    )


@functools.lru_cache(maxsize=1024)
def _color(step: int, colormap: str, about_zero: bool) -> str:
    return theme.color_at(step / (STEPS - 1), colormap, about_zero=about_zero)
