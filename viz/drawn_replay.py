"""The drawings of a replay at any moment: made for many of its frames at once, mixed in between."""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.interpolation import place_of
from engine.replay import Playable
from viz.robot_geometry import Drawing, RobotGeometry

AT_ONCE: Final = 25
"""Frames that are drawn at once: a second's worth."""


class DrawnReplay:
    """Draws the robot of a replay.

    Args:
        geometry: of the robot.
        replay: of it.
    """

    def __init__(self, geometry: RobotGeometry, replay: Playable) -> None:
        self._geometry, self._replay = geometry, replay
        self._first = 0
        self._tension = True
        self._drawings: list[Drawing] = []
        self._flat = np.empty((0, 0), dtype=np.float32)
        """(frames, numbers) all that moves along straight lines, the turns last."""

    def at(self, moment: float, *, tension: bool) -> Drawing:
        """Return the drawing of a moment; never one beyond what has been simulated.

        Everything moves along straight lines from frame to frame, and turns are scaled to unit length. A
        rod's ends are then where the turned rod has them to 0.1 mm in the median, and to 3 mm in the tenth
        of a second in which a dropped module folds. Colours are the nearer frame's.

        Args:
            moment: of the replay's clock, in s; there must be a frame.
            tension: whether the colours of the cables show it.
        """
        index, part = place_of(self._replay, moment)
        last = index + (part > 0.0)
        if tension != self._tension or not self._first <= index <= last < self._first + len(self._drawings):
            self._draw(index, tension)
        k = index - self._first
        if not part:
            return self._drawings[k]
        mixed = (1.0 - part) * self._flat[k] + part * self._flat[k + 1]
        nearer = self._drawings[k + (part >= 0.5)]
        shapes = nearer.rod_positions, nearer.nodes, nearer.cables, nearer.rod_turns
        rods, nodes, cables, turns = (
            a.reshape(like.shape) for a, like in zip(np.split(mixed, self._cuts), shapes, strict=True)
        )
        turns /= np.sqrt(np.einsum("ij,ij->i", turns, turns))[:, None]
        return Drawing(
            rod_positions=rods,
            rod_turns=turns,
            nodes=nodes,
            cables=cables,
            cable_colors=nearer.cable_colors,
            tension=nearer.tension,
        )

    def _draw(self, first: int, tension: bool) -> None:
        frames = self._replay.frames[first : first + AT_ONCE]
        poses = np.array([f.pose for f in frames])
        drawings = self._geometry.draw_all(poses, np.array([f.lengths for f in frames]), tension=tension)
        moving = [
            np.array([d.rod_positions for d in drawings]),
            np.array([d.nodes for d in drawings]),
            np.array([d.cables for d in drawings]),
            _steady(np.array([d.rod_turns for d in drawings])),
        ]
        self._cuts = np.cumsum([a[0].size for a in moving])[:-1]
        self._flat = np.concatenate([a.reshape(len(frames), -1) for a in moving], axis=1)
        self._first, self._tension, self._drawings = first, tension, drawings


def _steady(turns: np.ndarray) -> np.ndarray:
    """Return (frames, rods, 4) quaternions of the same turns, each on its predecessor's side: q is -q."""
    apart = np.einsum("fri,fri->fr", turns[1:], turns[:-1]) < 0.0
    sides = np.where(np.cumsum(apart, axis=0) % 2, -1.0, 1.0).astype(turns.dtype)
    return np.concatenate([turns[:1], turns[1:] * sides[..., None]])
