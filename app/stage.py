"""What the 3D scene of one browser shows: one robot, or several side by side."""

from __future__ import annotations

from collections.abc import Sequence

import viser

from app.arena import Arena
from app.lane_arena import LaneArena
from app.lanes import LaneReplay
from engine.replay import Playable


class Stage:
    """Hands the frames of a replay to whatever draws its kind.

    Args:
        client: whose scene it is.
        arena: that draws one robot.
    """

    def __init__(self, client: viser.ClientHandle, arena: Arena) -> None:
        self._arena = arena
        self._lanes = LaneArena(client, arena.look_at, lambda: arena.marks)

    def prepare(self, names: Sequence[str]) -> None:
        """Say how the lanes of the next replay of several are labelled."""
        self._lanes.name(names)

    def show(self, replay: Playable | LaneReplay, index: int) -> None:
        """Draw a frame; what the last replay left goes, if it was of the other kind."""
        if isinstance(replay, LaneReplay):
            self._arena.clear()
            self._lanes.show(replay, index)
        else:
            self._lanes.clear()
            self._arena.show(replay, index)

    def clear(self) -> None:
        """Remove all robots."""
        self._arena.clear()
        self._lanes.clear()
