"""The drawings of a replay at any moment: made for many of its frames at once, mixed in between."""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.replay.recording import Playable, mix, mix_turns, place_of
from viz.robot.geometry import Drawing, RobotGeometry

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

    def at(self, moment: float, *, tension: bool) -> Drawing:
        """Return the drawing of a moment; never one beyond what has been simulated.

        Everything moves along straight lines from frame to frame, and rods turn as ``mix_turns`` has it. The
        ends are then where the turned rods have them to 0.1 mm in the median, and to 3 mm in the tenth of a
        second in which a dropped module folds. Colours are the nearer frame's.

        Args:
            moment: of the replay's clock, in s; there must be a frame.
            tension: whether the colours of the cables show it.
        """
        index, part = place_of(self._replay, moment)
        last = index + (part > 0.0)
        if tension != self._tension or not self._first <= index <= last < self._first + len(self._drawings):
            self._draw(index, tension)
        k = index - self._first
        one = self._drawings[k]
        if not part:
            return one
        other = self._drawings[k + 1]
        nearer = one if part < 0.5 else other
        return Drawing(
            points=mix(one.points, other.points, part),
            rod_turns=mix_turns(one.rod_turns, other.rod_turns, part),
            cable_colors=nearer.cable_colors,
            tension=nearer.tension,
        )

    def _draw(self, first: int, tension: bool) -> None:
        frames = self._replay.frames[first : first + AT_ONCE]
        poses, lengths = np.array([f.pose for f in frames]), np.array([f.lengths for f in frames])
        self._drawings = self._geometry.draw_all(poses, lengths, tension=tension)
        self._first, self._tension = first, tension
