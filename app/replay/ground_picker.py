"""Asks a browser's user for a point of the ground."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import viser

from app.gui.actions import Actions
from engine.errors import InvalidData


class GroundPicker:
    """Waits for one click on the ground at a time.

    Args:
        scene: that is clicked.
        actions: of the browser.
    """

    def __init__(self, scene: viser.SceneApi, actions: Actions) -> None:
        self._scene, self._actions = scene, actions
        self._then: Callable[[np.ndarray], None] | None = None

    def ask(self, then: Callable[[np.ndarray], None]) -> None:
        """Call ``then`` with the (2,) point of the ground, in m, that is clicked next."""
        waits, self._then = self._then is not None, then
        if not waits:
            self._scene.on_click()(self._clicked)

    def cancel(self) -> None:
        """Wait for no click any more."""
        if self._then is not None:
            self._then = None
            self._scene.remove_click_callback("all")

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        self._actions.guarded(self._answer)(event.ray_origin, event.ray_direction)

    def _answer(self, origin: Sequence[float], direction: Sequence[float]) -> None:
        if self._then is not None:
            point, then = ground_point(origin, direction), self._then
            self.cancel()
            then(point)


def ground_point(origin: Sequence[float], direction: Sequence[float]) -> np.ndarray:
    """Return the (2,) point, in m, where a ray meets the ground.

    Args:
        origin: (3,) where the ray begins, in m.
        direction: (3,) where it goes.

    Raises:
        InvalidData: it does not meet the ground, or is no ray.
    """
    try:
        start, way = np.array([origin, direction], dtype=float).reshape(2, 3)
    except (TypeError, ValueError):
        raise InvalidData("That is no point of the scene.") from None
    # level with the ground or away from it, a ray does not come to it
    away = -start[2] / way[2] if way[2] else math.nan
    if not (math.isfinite(away) and away > 0.0 and np.isfinite(point := start[:2] + away * way[:2]).all()):
        raise InvalidData("That is not the ground; click below the horizon.")
    return point
