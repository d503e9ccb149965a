"""The paths of a robot's head towards all targets, seen from above, on build sheets and cards."""

from __future__ import annotations

import dataclasses
import html
import itertools
import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.config import RunConfig
from engine.simulation.evaluation import Evaluation
from engine.tasks import get_task, target_offsets, worlds
from engine.tasks.walls import Wall

COLORS: Final = ("#4c9be8", "#e8923a", "#36b37e", "#c678dd", "#e06c75", "#b8a038")
"""Of the targets, in their order, on light and on dark ground."""
WIDTH, HEIGHT = 300, 150
_TASK, _GAP = 132, 8
"""Widths of the whole task and of what is between it and the paths alone."""
_BORDER: Final = 6.0
"""Centimetres of ground that are shown around a whole task."""


@dataclasses.dataclass(frozen=True, slots=True)
class Ground:
    """A piece of the ground in a picture whose y goes up.

    Attributes:
        low, high: (2,) its corners, in cm.
        corner: (2,) where ``low`` is in the picture.
        scale: units of the picture in a centimetre.
    """

    low: np.ndarray
    high: np.ndarray
    corner: np.ndarray
    scale: float

    @classmethod
    def fitting(
        cls, points: np.ndarray, border: float, corner: Sequence[float], size: Sequence[float]
    ) -> Ground:
        """Return the piece that shows (n, 2) points in cm, with a border, and fills a rectangle."""
        low, high = points.min(axis=0) - border, points.max(axis=0) + border
        room = np.asarray(size, float)
        scale = float((room / (high - low)).min())
        middle, shown = (low + high) / 2, room / scale
        return cls(middle - shown / 2, middle + shown / 2, np.asarray(corner, float), scale)

    def at(self, point: Sequence[float] | np.ndarray) -> tuple[float, float]:
        """Return where a point in cm is in the picture."""
        x, y = self.corner + self.scale * (np.asarray(point) - self.low)
        return float(x), float(y)

    def step(self, least: float) -> float:
        """Return how many cm lie between two lines that are at least so far apart: 1, 2 or 5 times 10^n."""
        steps = (m * 10.0**k for k in itertools.count(-1) for m in (1, 2, 5))
        return next(s for s in steps if s * self.scale >= least)

    def lines(self, axis: int, step: float) -> list[float]:
        """Return where lines across an axis lie, in cm."""
        first, last = math.ceil(self.low[axis] / step), math.floor(self.high[axis] / step)
        return [k * step for k in range(first, last + 1)]


def reach(offsets: np.ndarray, paths: np.ndarray, *, targets_too: bool) -> tuple[np.ndarray, float]:
    """Return (n, 2) points that a picture has to show, in cm, and the border around them.

    Args:
        offsets: (targets, 2) of the targets, in cm.
        paths: (targets, seconds, 2) of the head, in cm.
        targets_too: whether the whole task is shown, or the paths alone, larger.
    """
    shown = np.concatenate([offsets if targets_too else offsets[:0], paths.reshape(-1, 2), np.zeros((1, 2))])
    return shown, _BORDER if targets_too else max(0.25, 0.08 * float(np.ptp(shown, axis=0).max()))


def wall_corners(wall: Wall) -> np.ndarray:
    """Return the (4, 2) corners of a wall seen from above, in m."""
    x, y = wall.half_size[:2]
    c, s = math.cos(wall.yaw), math.sin(wall.yaw)
    around = np.array([(x, y), (-x, y), (-x, -y), (x, -y)])
    return np.array(wall.centre[:2]) + around @ np.array([[c, s], [-s, c]])


def render(config: RunConfig, evaluation: Evaluation) -> str:
    """Return both pictures as SVG: the whole task, and the paths alone, larger; empty if no path is known."""
    task = get_task(config.task)
    paths = 100 * evaluation.trajectory.astype(float)
    if not paths.shape[1] or not np.isfinite(paths).all():
        return ""
    offsets = 100 * target_offsets(task)
    made = worlds(task, evaluation.solution.morphology.n_modules)
    walls = [w for w in dict.fromkeys(itertools.chain.from_iterable(made)) if not w.is_buried]
    whole = _picture(offsets, paths, walls, (0, _TASK), task.target_names, targets_too=True)
    alone = _picture(offsets, paths, (), (_TASK + _GAP, WIDTH), task.target_names, targets_too=False)
    repeats = config.trials.repeats
    return (
        f'<svg class="ta-paths" viewBox="0 0 {WIDTH} {HEIGHT}" width="100%" role="img"'
        f' aria-label="Paths of the head towards all targets, seen from above"'
        ' style="display:block;margin-top:6px;font:9px system-ui,sans-serif">'
        f"{whole}{alone}</svg>"
        '<div style="font-size:11px;opacity:.65">head from above'
        f"{f', mean of {repeats} trials' if repeats > 1 else ''}: the task, and larger the paths alone</div>"
    )


def _picture(
    offsets: np.ndarray,
    paths: np.ndarray,
    walls: Sequence[Wall],
    span: tuple[float, float],
    names: Sequence[str],
    *,
    targets_too: bool,
) -> str:
    left, width = span[0], span[1] - span[0]
    ground = Ground.fitting(*reach(offsets, paths, targets_too=targets_too), (left, 0), (width, HEIGHT))

    def at(point: Sequence[float] | np.ndarray) -> str:
        x, y = ground.at(point)
        return f"{x:.1f} {HEIGHT - y:.1f}"

    name = f"ta-ground-{left:g}"
    step = ground.step(22)
    lines = "".join(
        f"M{at((v, ground.low[1]))}L{at((v, ground.high[1]))}" for v in ground.lines(0, step)
    ) + "".join(f"M{at((ground.low[0], v))}L{at((ground.high[0], v))}" for v in ground.lines(1, step))
    parts = [
        f'<clipPath id="{name}"><rect x="{left}" width="{width}" height="{HEIGHT}" rx="4"/></clipPath>'
        f'<g clip-path="url(#{name})"><rect x="{left}" width="{width}" height="{HEIGHT}" fill="currentColor"'
        f' fill-opacity=".05"/><path d="{lines}" stroke="currentColor" stroke-opacity=".14"/>'
    ]
    for wall in walls:
        corners = "L".join(at(p) for p in 100 * wall_corners(wall))
        parts.append(f'<path d="M{corners}Z" fill="currentColor" fill-opacity=".22"/>')
    for k, (target, path) in enumerate(zip(offsets, paths, strict=True)):
        color = COLORS[k % len(COLORS)]
        way = "L".join(at(p) for p in np.concatenate([np.zeros((1, 2)), path]))
        x, y = ground.at(path[-1])
        parts.append(
            f'<path d="M{way}" fill="none" stroke="{color}" stroke-width="1.5" stroke-linejoin="round">'
            f"<title>{html.escape(names[k])}</title></path>"
            f'<circle cx="{x:.1f}" cy="{HEIGHT - y:.1f}" r="2.6" fill="none" stroke="{color}"/>'
        )
        if targets_too:
            x, y = ground.at(target)
            parts.append(
                f'<path d="M{x - 3:.1f} {HEIGHT - y - 3:.1f}l6 6m0 -6l-6 6" stroke="{color}"'
                f' stroke-width="1.6"><title>{html.escape(names[k])}</title></path>'
            )
    parts.append(
        f'<text x="{span[1] - 4}" y="{HEIGHT - 4}" text-anchor="end" fill="currentColor" fill-opacity=".65">'
        f"squares of {step:g} cm</text></g>"
    )
    return "".join(parts)
