"""Several replays as one, in step: what a player plays when robots are compared side by side."""

from __future__ import annotations

import bisect
import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from engine.body.morphology import Morphology
from engine.replay.recording import ReplayFrame
from engine.replay.replay import Replay
from engine.simulation.rollout import Head
from engine.tasks.walls import Wall

MAX_LANES = 4


@dataclasses.dataclass(frozen=True, slots=True)
class LaneStart:
    """Where a trial begins, as seen from above.

    Attributes:
        head: (2,) position of the settled head, in m.
        yaw: direction from there to the target, in rad.
        distance: from there to the target, in m.
    """

    head: np.ndarray
    yaw: float
    distance: float

    def from_world(self, points: np.ndarray) -> np.ndarray:
        """Return (..., 2) points as seen from the start, x towards the target, in m."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return (points - self.head) @ np.array([[c, -s], [s, c]])


class SideBySideReplay:
    """Up to four replays behind one clock: a ``Playable`` whose frames are moments of all of them.

    There is nothing to see before all have settled: where a lane lies follows from where its target is.
    A robot whose simulation fails stays where it was, the others go on.

    Args:
        lanes: one to four replays, of trials that need not be equally long.
        names: of the lanes, for people.
    """

    def __init__(self, lanes: Sequence[Replay], names: Sequence[str]) -> None:
        assert 1 <= len(lanes) <= MAX_LANES
        self.lanes, self.names = tuple(lanes), tuple(names)
        self.target: np.ndarray | None = None
        self.walls: tuple[Wall, ...] = ()
        self._moments = _Moments(self)
        self._times: list[Sequence[float]] = [_Times(lane) for lane in self.lanes]

    @property
    def frames(self) -> Sequence[ReplayFrame]:
        """A frame, of the first lane that goes on, for every moment that all lanes have reached."""
        return self._moments

    @property
    def failure(self) -> str | None:
        """Why it ends, once every simulation has failed."""
        if all(lane.failure for lane in self.lanes):
            return self.lanes[0].failure
        return None

    @property
    def head(self) -> Head:
        """The first robot's."""
        return self.lanes[0].head

    @property
    def morphology(self) -> Morphology:
        """The first robot's."""
        return self.lanes[0].morphology

    @property
    def start_time(self) -> float:
        """When the first robot is dropped, in s of the common clock."""
        return min(lane.start_time for lane in self.lanes)

    @property
    def end_time(self) -> float:
        """When the longest trial ends, in s."""
        return max(lane.end_time for lane in self.lanes)

    @property
    def frame_period(self) -> float:
        """Seconds between two moments."""
        return min(lane.frame_period for lane in self.lanes)

    def cancel(self) -> None:
        """Make ``advance`` return soon, and at once from then on."""
        for lane in self.lanes:
            lane.cancel()

    def advance(self, until: float) -> None:
        """Simulate all lanes until a time of the clock, in s, a failure or ``cancel``."""
        for lane in self.lanes:
            lane.advance(until)

    def start(self, lane: int) -> LaneStart | None:
        """Return where a lane's trial begins, None as long as its robot settles."""
        replay = self.lanes[lane]
        if replay.target is None:
            return None
        frame = replay.frames[self.frame_index(lane, 0.0)]
        way = replay.target - frame.head
        return LaneStart(frame.head, math.atan2(way[1], way[0]), float(np.hypot(*way)))

    def frame_index(self, lane: int, moment: float) -> int:
        """Return the index of a lane's frame that is due at a time, at most its last."""
        replay = self.lanes[lane]
        index = bisect.bisect_right(self._times[lane], moment + replay.frame_period / 2) - 1
        return max(index, 0)

    def reached(self) -> float:
        """Return the time that all lanes have been simulated to whose simulation has not failed, in s."""
        if any(not lane.frames or (lane.target is None and not lane.failure) for lane in self.lanes):
            return -math.inf
        going = [lane for lane in self.lanes if not lane.failure]
        if going:
            return min(lane.frames[-1].time for lane in going)
        return max(lane.frames[-1].time for lane in self.lanes)

    def distance(self, lane: int, moment: float) -> float | None:
        """Return how far a lane's head is from its target, in m, None before it has settled."""
        replay = self.lanes[lane]
        if replay.target is None or moment < 0.0:
            return None
        head = replay.frames[self.frame_index(lane, moment)].head
        return float(np.linalg.norm(head - replay.target))


class _Times(Sequence[float]):
    """The times of a replay's frames, without a list of them."""

    def __init__(self, replay: Replay) -> None:
        self._replay = replay

    def __len__(self) -> int:
        return len(self._replay.frames)

    def __getitem__(self, index):  # type: ignore[no-untyped-def]
        return self._replay.frames[index].time


class _Moments(Sequence[ReplayFrame]):
    """The moments of a ``SideBySideReplay``; only ever more of them."""

    def __init__(self, replay: SideBySideReplay) -> None:
        self._replay = replay

    def __len__(self) -> int:
        reached = self._replay.reached()
        if reached == -math.inf:
            return 0
        return max(0, math.floor((reached - self._replay.start_time) / self._replay.frame_period + 1e-6))

    def __getitem__(self, index):  # type: ignore[no-untyped-def]
        replay, n = self._replay, len(self)
        if not -n <= index < n:
            raise IndexError(index)
        moment = replay.start_time + (index % n + 1) * replay.frame_period
        lane = next((k for k, r in enumerate(replay.lanes) if not r.failure), 0)
        frame = replay.lanes[lane].frames[replay.frame_index(lane, moment)]
        return dataclasses.replace(frame, time=moment)
