"""A robot at any moment: between the frames that a simulation has recorded."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from engine.replay.replay import Frame, Playable

NEAR: Final = 1e-4
"""Part of a period within which a moment is that of a recorded frame."""


def frame_at(replay: Playable, moment: float) -> Frame:
    """Return the frame of a moment; never one beyond what has been simulated.

    Args:
        replay: of which there is a frame.
        moment: of its clock, in s.

    Returns:
        The recorded frame itself where there is one, and before the first and after the last.
    """
    frames = replay.frames
    first, part = place_of(replay, moment)
    return between(frames[first], frames[first + 1], part) if part else frames[first]


def place_of(replay: Playable, moment: float) -> tuple[int, float]:
    """Return which recorded frame a moment follows, and what part of the way to the next one it is.

    Args:
        replay: of which there is a frame.
        moment: of its clock, in s.

    Returns:
        The index of the frame and a part from 0 to below 1; 0 where there is no next frame, and 0 for the
        first frame before it.
    """
    last = len(replay.frames) - 1
    place = (moment - replay.start_time) / replay.frame_period - 1.0
    nearest = min(max(round(place), 0), last)
    if not 0.0 < place < last or abs(place - nearest) < NEAR:
        return nearest, 0.0
    first = math.floor(place)
    return first, place - first


def nearest_index(replay: Playable, moment: float) -> int:
    """Return the index of the recorded frame that is nearest to a moment; arguments as of ``place_of``."""
    return round(sum(place_of(replay, moment)))


def between(one: Frame, other: Frame, part: float) -> Frame:
    """Return what lies a part of the way, from 0 to 1, from a frame to one soon after it.

    Positions, lengths and the head move along straight lines, rods turn as ``mix_turns`` has it. Contacts
    and what is sensed are the nearer frame's.
    """
    nearer = one if part < 0.5 else other
    pose = mix(one.pose, other.pose, part)
    pose[..., 3:] = mix_turns(one.pose[..., 3:], other.pose[..., 3:], part)
    return Frame(
        time=one.time + part * (other.time - one.time),
        pose=pose,
        lengths=mix(one.lengths, other.lengths, part),
        head=mix(one.head, other.head, part),
        contacts=nearer.contacts,
        sensed=nearer.sensed,
    )


def mix_turns(one: np.ndarray, other: np.ndarray, part: float) -> np.ndarray:
    """Return what lies a part of the way, from 0 to 1, from quaternions (..., 4) to others, as float32.

    They move along straight lines, the shorter way, and are scaled to unit length: within a frame's time a
    rod turns little, so that this is close to the great circle.
    """
    # q and -q are the same turn
    sign = np.where((one * other).sum(axis=-1, keepdims=True) < 0.0, np.float32(-1.0), np.float32(1.0))
    turn = mix(one, sign * other, part)
    return turn / np.sqrt((turn * turn).sum(axis=-1, keepdims=True))


def mix(one: np.ndarray, other: np.ndarray, part: float) -> np.ndarray:
    """Return what lies a part of the way, from 0 to 1, from an array to another, as float32."""
    return ((1.0 - part) * one + part * other).astype(np.float32, copy=False)
