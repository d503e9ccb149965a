"""Frames between two recorded ones."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from engine.replay.recording import ReplayFrame, between, frame_at
from engine.replay.replay import Replay
from engine.storage.reader import RunReader

parts = st.floats(0.0, 1.0)
seeds = st.integers(0, 2**32 - 1)


def frame_from(seed: int, time: float = 0.0) -> ReplayFrame:
    """Return a made-up frame of three modules."""
    rng = np.random.default_rng(seed)
    pose = rng.normal(size=(3, 6, 7)).astype(np.float32)
    pose[..., 3:] /= np.linalg.norm(pose[..., 3:], axis=-1, keepdims=True)
    lengths = rng.uniform(0.03, 0.1, (3, 5)).astype(np.float32)
    head = pose[0, [0, 1], :2].mean(axis=0)
    contacts = rng.normal(size=(int(rng.integers(0, 5)), 3)).astype(np.float32)
    return ReplayFrame(time, pose, lengths, head, lambda: contacts, rng.normal(size=2))


@dataclasses.dataclass
class Recorded:
    """What of a ``Playable`` says where its frames lie."""

    frames: Sequence[ReplayFrame]
    start_time: float
    frame_period: float


@given(seeds, seeds, parts)
def test_what_lies_between_is_a_pose_and_q_and_minus_q_are_the_same(
    one: int, other: int, part: float
) -> None:
    a, b = frame_from(one), frame_from(other, 0.04)
    middle = between(a, b, part)
    assert np.linalg.norm(middle.pose[..., 3:], axis=-1) == pytest.approx(1.0, abs=1e-6)
    for name in ("lengths", "head"):
        low, high = (
            np.minimum(getattr(a, name), getattr(b, name)),
            np.maximum(getattr(a, name), getattr(b, name)),
        )
        assert (low - 1e-6 <= getattr(middle, name)).all()
        assert (getattr(middle, name) <= high + 1e-6).all()
    assert middle.pose[..., :3] == pytest.approx(
        a.pose[..., :3] + part * (b.pose[..., :3] - a.pose[..., :3]), abs=1e-5
    )
    assert middle.time == pytest.approx(0.04 * part)
    nearer = a if part < 0.5 else b
    assert middle.contacts is nearer.contacts
    assert middle.sensed is nearer.sensed
    flipped = b.pose.copy()
    flipped[..., 3:] *= -1.0
    same = between(a, dataclasses.replace(b, pose=flipped), part)
    assert same.pose == pytest.approx(middle.pose, abs=1e-6)


@given(seeds, parts, st.floats(0.0, 0.3))
def test_small_turns_are_close_to_the_great_circle(seed: int, part: float, angle: float) -> None:
    a = frame_from(seed)
    axis = np.random.default_rng(seed).normal(size=3)
    first = Rotation.from_quat(a.pose[0, 0, 3:], scalar_first=True)
    second = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)) * first
    pose = a.pose.copy()
    pose[0, 0, 3:] = second.as_quat(scalar_first=True)
    found = between(a, dataclasses.replace(a, pose=pose), part).pose[0, 0, 3:]
    expected = Slerp([0.0, 1.0], Rotation.concatenate([first, second]))(part)
    away = (Rotation.from_quat(found, scalar_first=True) * expected.inv()).magnitude()
    assert away < 1e-3


@given(st.integers(1, 6), st.floats(-5.0, 5.0), st.floats(0.002, 0.1), st.floats(-1.0, 10.0))
def test_recorded_frames_are_given_as_they_are_and_nothing_beyond_them(
    n: int, start: float, period: float, at: float
) -> None:
    frames = [frame_from(k, start + (k + 1) * period) for k in range(n)]
    replay = Recorded(frames, start, period)
    for frame in frames:
        assert frame_at(replay, frame.time) is frame
    found = frame_at(replay, start + (at + 1.0) * period)
    if at <= 0.0:
        assert found is frames[0]
    elif at >= n - 1:
        assert found is frames[-1]
    else:
        low = math.floor(at)
        assert frames[low].time - 1e-6 <= found.time <= frames[min(low + 1, n - 1)].time + 1e-6
        assert found.time == pytest.approx(start + (at + 1.0) * period, abs=2e-4 * period + 1e-9)


def test_a_replay_is_drawn_between_its_frames(small_reader: RunReader) -> None:
    replay = Replay(small_reader.config, small_reader.evaluation(2))
    replay.advance(0.4)
    for frame in replay.frames:
        assert frame_at(replay, frame.time) is frame
    # where every second frame is left out, what lies between its neighbours is nearer to it than they are
    rough = Recorded(replay.frames[1::2], replay.start_time, 2 * replay.frame_period)
    left_out = range(2, len(replay.frames) - 1, 2)
    found = [
        np.abs(frame_at(rough, replay.frames[k].time).pose - replay.frames[k].pose).mean() for k in left_out
    ]
    before = [np.abs(replay.frames[k - 1].pose - replay.frames[k].pose).mean() for k in left_out]
    assert np.mean(found) < 0.9 * np.mean(before)
