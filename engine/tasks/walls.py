"""Fixed boxes that stand in a task's world, and how far it is to them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np

from engine.errors import InvalidData
from engine.exact import cosine_and_sine

MAX_WALLS: Final = 64
"""Largest number of walls in a world."""
LARGEST: Final = 100.0
"""Largest coordinate or half size of a wall, in m."""


SMALLEST: Final = 1e-4
"""Smallest half size of a wall, in m."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Wall:
    """A fixed box: centre (3,), half sizes (3,), in metres, and its turn about the vertical, in rad.

    Raises:
        InvalidData: a number is not finite or out of range.
    """

    centre: tuple[float, float, float]
    half_size: tuple[float, float, float]
    yaw: float = 0.0

    def __post_init__(self) -> None:
        for name in ("centre", "half_size"):
            values = getattr(self, name)
            try:
                numbers = tuple(float(v) for v in values)
            except (TypeError, ValueError, OverflowError):
                numbers = ()
            if len(numbers) != 3 or not all(abs(v) <= LARGEST for v in numbers):
                raise InvalidData(f"a wall's {name} must be three numbers of metres, not {values!r}")
            object.__setattr__(self, name, numbers)
        if not min(self.half_size) >= SMALLEST:
            raise InvalidData(f"a wall's half_size must be at least {SMALLEST} m, not {self.half_size!r}")
        if not isinstance(self.yaw, int | float) or not math.isfinite(self.yaw):
            raise InvalidData(f"a wall's yaw must be a number, not {self.yaw!r}")
        object.__setattr__(self, "yaw", float(self.yaw))

    @property
    def is_buried(self) -> bool:
        """Whether all of it lies under the ground, where nothing touches or senses it."""
        return self.centre[2] + self.half_size[2] <= 0.0

    def to_json(self) -> list[float]:
        """Return centre, half sizes and yaw as seven numbers."""
        return [*self.centre, *self.half_size, self.yaw]

    @classmethod
    def from_json(cls, data: object) -> Wall:
        """Read a wall back from ``to_json``'s form.

        Raises:
            InvalidData: the data is not a wall.
        """
        if not isinstance(data, list) or len(data) != 7 or any(type(v) not in (int, float) for v in data):
            raise InvalidData("a wall is written as seven numbers")
        return cls(centre=tuple(data[:3]), half_size=tuple(data[3:6]), yaw=data[6])


BURIED: Final = Wall(centre=(0.0, 0.0, -5.0), half_size=(0.01, 0.01, 0.01))
"""Pads the walls of a world: all simulations of a batch need equally many."""


def add_walls(spec: mujoco.MjSpec, walls: Sequence[Wall]) -> None:
    """Put walls into the world of a robot, as geoms ``wall0``, ``wall1``, ..."""
    for k, wall in enumerate(walls):
        cosine, sine = cosine_and_sine(wall.yaw / 2.0)
        spec.worldbody.add_geom(
            name=f"wall{k}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=wall.centre,
            size=wall.half_size,
            quat=[cosine, 0.0, 0.0, sine],
            rgba=[0.55, 0.58, 0.62, 0.6],
        )


class Obstacles:
    """The outlines of the walls of some worlds on the ground plane, to look at along rays.

    Args:
        worlds: per world its walls; those under the ground do not count.
    """

    def __init__(self, worlds: Sequence[Sequence[Wall]]) -> None:
        above = [[w for w in walls if not w.is_buried] for walls in worlds]
        shape = (len(above), max(map(len, above), default=0))
        self._there = np.zeros(shape, dtype=bool)
        self._centre, self._half = np.zeros((*shape, 2)), np.ones((*shape, 2))
        self._axes = np.zeros((*shape, 2, 2))
        for i, walls in enumerate(above):
            for k, w in enumerate(walls):
                c, s = cosine_and_sine(w.yaw)
                self._there[i, k] = True
                self._centre[i, k], self._half[i, k] = w.centre[:2], w.half_size[:2]
                self._axes[i, k] = [[c, s], [-s, c]]

    def clearance(self, position: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Return how far a wall is straight ahead; 0 inside a wall, infinite where there is none.

        Slab method for rays and boxes (Kay and Kajiya 1986).

        Args:
            position: (..., worlds, 2) of the eye, in m.
            direction: (..., worlds, 2) of unit length.

        Returns:
            (..., worlds) distances in m.
        """
        if not self._there.size:
            return np.full(position.shape[:-1], np.inf)
        start = _turned(self._axes, position[..., None, :] - self._centre)
        along = _turned(self._axes, direction[..., None, :])
        # a ray along a face misses the slab (infinite both ways) or never leaves it
        along = np.where(np.abs(along) < 1e-12, 1e-12, along)
        one, other = (-self._half - start) / along, (self._half - start) / along
        enter = np.minimum(one, other).max(axis=-1)
        leave = np.maximum(one, other).min(axis=-1)
        met = self._there & (leave >= enter) & (leave >= 0.0)
        return np.where(met, np.maximum(enter, 0.0), np.inf).min(axis=-1)


def _turned(axes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return (axes * vectors[..., None, :]).sum(axis=-1)
