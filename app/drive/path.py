"""The measured path of a drive, as a trial of the simulation has it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from app.drive.eyes import HeadPose
from app.drive.log import Record
from engine.errors import InvalidData
from engine.replay.trial import Aim
from engine.tasks import GroundFrame

SMOOTHED: Final = 0.4
"""Seconds whose places are averaged: a camera's noise would hide the path."""


@dataclasses.dataclass(frozen=True, slots=True)
class MeasuredPath:
    """Where a head was, seen from where it began.

    Attributes:
        times: (n,) in s of a trial's clock, 0 when the controller begins; they only grow.
        places: (n, 2) x ahead and y to the left of the head as it began, in m, averaged over ``SMOOTHED``.
        aim: where the target was then, as a replay takes it.
        before, after: how far the head was from the target at the beginning and at the end, in m.
    """

    times: np.ndarray
    places: np.ndarray
    aim: Aim
    before: float
    after: float

    @classmethod
    def of(cls, records: Sequence[Record], settle_time: float) -> MeasuredPath:
        """Return the path of a log.

        Args:
            records: of the log.
            settle_time: seconds at rest before a controller begins.

        Raises:
            InvalidData: head and target are never seen at once, the target is too near or too far, or times
                go backwards.
        """
        times = np.array([r.time for r in records if r.head is not None]) - settle_time
        if (np.diff(times) < 0.0).any():
            raise InvalidData("the log's times go backwards")
        both = [(r.time, r.head, r.target) for r in records if r.head is not None and r.target is not None]
        if not both:
            raise InvalidData("the log has no picture in which both tags are seen")
        # the robot lies still until its controller begins
        resting = [(head, target) for time, head, target in both if time <= settle_time] or [both[0][1:]]
        start = _mean([head for head, _ in resting])
        target = np.mean([target for _, target in resting], axis=0)
        front = start.position[None, None]
        frame = GroundFrame.of(front, front - start.facing)
        heads = frame.from_world(np.array([[r.head.position for r in records if r.head is not None]]))[0]
        return cls(
            times,
            _smoothed(times, heads),
            Aim.at(frame.from_world(target[None, None])[0, 0]),
            before=float(np.linalg.norm(start.position - target)),
            after=float(np.linalg.norm(both[-1][1].position - both[-1][2])),
        )

    def turn(self, start: np.ndarray, target: np.ndarray) -> float:
        """Return by which angle in rad the path is to be turned to lie in a world.

        Args:
            start: (2,) where the head begins there.
            target: (2,) where the target is there.
        """
        (x, y), (ahead, left) = target - start, self.aim.offset
        return math.atan2(y, x) - math.atan2(left, ahead)

    def at(self, moment: float) -> np.ndarray:
        """Return (2,) where the head was at a time of the trial's clock, in s, or last before it."""
        return np.asarray(self.places[max(int(np.searchsorted(self.times, moment, side="right")) - 1, 0)])


def _mean(heads: Sequence[HeadPose]) -> HeadPose:
    x, y = np.mean([head.position for head in heads], axis=0)
    ahead = np.mean([head.facing for head in heads], axis=0)
    return HeadPose(float(x), float(y), float(np.arctan2(ahead[1], ahead[0])))


def _smoothed(times: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the means of (n, 2) places that are at most half of ``SMOOTHED`` earlier or later."""
    first = np.searchsorted(times, times - SMOOTHED / 2)
    last = np.searchsorted(times, times + SMOOTHED / 2, side="right")
    sums = np.concatenate([np.zeros((1, 2)), places.cumsum(axis=0)])
    return np.asarray((sums[last] - sums[first]) / (last - first)[:, None])
