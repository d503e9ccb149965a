"""Drawings between the frames of a replay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.replay.recording import frame_at
from engine.replay.replay import Replay
from engine.storage.reader import RunReader
from viz.robot.geometry import AT_ONCE, DrawnReplay, RobotGeometry


def begun(run: Path, until: float) -> Replay:
    """Return a replay that is simulated to a time of its clock."""
    with RunReader(run) as reader:
        replay = Replay(reader.config, reader.evaluation(0))
    replay.advance(until)
    return replay


@pytest.fixture(scope="module")
def replay(small_run: Path) -> Replay:
    replay = begun(small_run, 2.0)
    assert len(replay.frames) > 2 * AT_ONCE
    return replay


@pytest.fixture(scope="module")
def geometry(replay: Replay) -> RobotGeometry:
    return RobotGeometry(replay.morphology, replay.head.module)


@pytest.fixture(scope="module")
def drawn(replay: Replay, geometry: RobotGeometry) -> DrawnReplay:
    return DrawnReplay(geometry, replay)


@given(part=st.floats(-0.1, 1.1), tension=st.booleans())
def test_a_moment_is_drawn_as_the_robot_between_its_frames(
    replay: Replay, geometry: RobotGeometry, drawn: DrawnReplay, part: float, tension: bool
) -> None:
    first, last = replay.frames[0].time, replay.frames[-1].time
    frame = frame_at(replay, first + part * (last - first))
    ours = drawn.at(frame.time, tension=tension)
    exact = geometry.draw(frame.pose, frame.lengths, tension=tension)
    np.testing.assert_allclose(ours.rod_positions, exact.rod_positions, atol=1e-6)
    for name in ("nodes", "cables"):  # a dropped module folds fast
        np.testing.assert_allclose(getattr(ours, name), getattr(exact, name), atol=3e-3)
    same = np.abs((ours.rod_turns * exact.rod_turns).sum(axis=-1))
    np.testing.assert_allclose(same, 1.0, atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(ours.rod_turns, axis=-1), 1.0, atol=1e-5)
    assert ours.cable_colors.shape == exact.cable_colors.shape
    assert ours.rod_positions.dtype == ours.rod_turns.dtype == ours.nodes.dtype == np.float32


def test_it_is_drawn_there_to_a_tenth_of_a_millimetre(
    replay: Replay, geometry: RobotGeometry, drawn: DrawnReplay
) -> None:
    gaps = []
    for moment in np.linspace(replay.frames[0].time, replay.frames[-1].time, 99):
        frame = frame_at(replay, moment)
        exact = geometry.draw(frame.pose, frame.lengths)
        gaps.append(np.abs(drawn.at(frame.time, tension=True).nodes - exact.nodes).max())
    assert np.median(gaps) < 1e-4


def test_a_recorded_frame_is_drawn_exactly(
    replay: Replay, geometry: RobotGeometry, drawn: DrawnReplay
) -> None:
    for k in (0, AT_ONCE, 7, len(replay.frames) - 1):
        frame = replay.frames[k]
        ours, exact = drawn.at(frame.time, tension=True), geometry.draw(frame.pose, frame.lengths)
        for name in ("rod_positions", "rod_turns", "nodes", "cables", "cable_colors"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(exact, name))


def test_turns_that_change_their_sign_go_the_shorter_way(
    replay: Replay, geometry: RobotGeometry, monkeypatch: pytest.MonkeyPatch
) -> None:
    straight = DrawnReplay(geometry, replay)
    moments = [replay.frames[k].time + 0.4 * replay.frame_period for k in range(20)]
    expected = [straight.at(m, tension=True).rod_turns for m in moments]
    made = geometry.draw_all

    def flipped(*args, **kwargs):
        drawings = made(*args, **kwargs)
        for drawing in drawings[::3]:
            drawing.rod_turns[::2] *= -1.0
        return drawings

    monkeypatch.setattr(geometry, "draw_all", flipped)
    drawn = DrawnReplay(geometry, replay)
    for moment, turns in zip(moments, expected, strict=True):
        same = np.abs((drawn.at(moment, tension=True).rod_turns * turns).sum(axis=-1))
        np.testing.assert_allclose(same, 1.0, atol=1e-5)


def test_many_frames_are_drawn_as_each_alone(replay: Replay, geometry: RobotGeometry) -> None:
    frames = replay.frames[:10]
    at_once = geometry.draw_all(np.array([f.pose for f in frames]), np.array([f.lengths for f in frames]))
    for frame, ours in zip(frames, at_once, strict=True):
        alone = geometry.draw(frame.pose, frame.lengths)
        for name in ("rod_positions", "rod_turns", "nodes", "cables", "cable_colors", "tension"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(alone, name))


def test_what_is_simulated_meanwhile_is_drawn(small_run: Path) -> None:
    replay = begun(small_run, 0.0)
    drawn = DrawnReplay(RobotGeometry(replay.morphology, replay.head.module), replay)
    end = drawn.at(1e3, tension=True)
    replay.advance(1.0)
    later = drawn.at(1e3, tension=True)
    assert np.abs(later.nodes - end.nodes).max() > 0.0
    placed = replay.frames[-1].pose[..., :3].reshape(-1, 3)
    np.testing.assert_array_equal(later.rod_positions, placed)
