from __future__ import annotations

import dataclasses
import itertools
import math
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.replay import side_by_side_scene
from app.replay.overlays import Overlays
from app.replay.player import Player
from app.replay.side_by_side import LaneStart, SideBySideReplay
from app.replay.side_by_side_scene import SideBySideScene, lay_out
from app.robot.pins_panel import side_by_side_replay
from engine.analysis.robustness import Robustness
from engine.replay.trial import TrialChoice
from engine.simulation.evaluation import Evaluation
from engine.storage.reader import RunReader
from viz.robot.robot_differences import Entry, render, render_distances, render_pins, rows

finite = st.floats(-2.0, 2.0)


def entry(reader: RunReader, number: int, **changes: object) -> Entry:
    evaluation = dataclasses.replace(reader.evaluation(number), **changes)
    return Entry(path=reader.path, config=reader.config, evaluation=evaluation, entered=0)


def wait(condition: Callable[[], object], seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


@given(finite, finite, st.floats(-math.pi, math.pi), st.floats(0.1, 1.0))
@settings(max_examples=60, deadline=None)
def test_seen_from_the_start_the_target_lies_ahead(x, y, yaw, distance):
    head = np.array([x, y])
    start = LaneStart(head, yaw, distance)
    target = head + distance * np.array([math.cos(yaw), math.sin(yaw)])
    assert start.from_world(target) == pytest.approx([distance, 0.0], abs=1e-9)
    assert start.from_world(head) == pytest.approx([0.0, 0.0], abs=1e-9)


def test_lanes_move_in_step_and_end_as_evaluated(small_reader: RunReader) -> None:
    replay = side_by_side_replay([entry(small_reader, n) for n in (2, 3, 4)], TrialChoice(target=1))
    assert len(replay.frames) == 0
    shown: list[tuple[float, int]] = []
    player = Player()
    player.show_with(lambda moment: shown.append((moment.time, moment.index)))
    player.speed = 4.0
    player.load(replay)
    wait(lambda: not player.playing)
    player.close()
    assert shown == sorted(shown)
    assert shown[-1][0] == pytest.approx(2.0)
    for k, lane in enumerate(replay.lanes):
        assert lane.score == lane.evaluation.distances[1, 0]
        for moment in (-0.2, 0.0, 1.0, 2.0):
            frame = lane.frames[replay.frame_index(k, moment)]
            assert frame.time == pytest.approx(moment, abs=lane.frame_period / 2 + 1e-6)
        assert replay.distance(k, -0.1) is None
        assert replay.distance(k, 2.0) == pytest.approx(lane.score, abs=0.003)
    starts = [s for k in range(3) if (s := replay.start(k))]
    lanes = lay_out(replay.lanes, starts)
    for lane, robot, start in zip(lanes, replay.lanes, starts, strict=True):
        target = lane.turn.apply([*robot.target, 0.0]) + lane.position
        assert target == pytest.approx([start.distance, lane.offset, 0.0], abs=1e-6)
        pose = robot.frames[replay.frame_index(0, 0.0)].pose[..., :3].reshape(-1, 3)
        sides = (lane.turn.apply(pose) + lane.position)[:, 1]
        assert lane.right < sides.min() < sides.max() < lane.left
    for first, second in itertools.pairwise(lanes):
        assert first.right >= second.left - 1e-9
    assert lanes[0].left == pytest.approx(-lanes[-1].right)


def test_trials_that_one_run_has_not_are_its_last(small_reader: RunReader) -> None:
    replay = side_by_side_replay([entry(small_reader, 2)], TrialChoice(target=99, repeat=5))
    assert (replay.lanes[0].target_index, replay.lanes[0].repeat) == (3, 0)


def test_what_differs_stands_out_and_the_best_is_bold(small_reader: RunReader) -> None:
    pins = [entry(small_reader, n) for n in (2, 3)]
    found = {what: values for what, values, _ in rows(pins)}
    bodies = [p.evaluation.solution.morphology for p in pins]
    assert found["modules"] == [str(b.n_modules) for b in bodies]
    assert found["faces"] == [" ".join(map(str, b.faces)) for b in bodies]
    assert len([w for w in found if "°" in w]) == 4
    table = render(pins)
    assert table.count("font-weight:650") >= 5 - 2
    same = render([pins[0], pins[0]])
    assert 'class="differs"' not in same
    assert "font-weight:650" not in same


def test_what_to_expect_of_a_robot_comes_before_what_was_recorded(small_reader: RunReader) -> None:
    robust = Robustness("", {}, {2: 0.5, 3: 0.5}, {2: {1: 0.35, 2: 0.37}, 3: {1: 0.40}})
    pins = [dataclasses.replace(entry(small_reader, n), robust=robust) for n in (2, 3, 4)]
    names = [what for what, _, _ in rows(pins)]
    assert names.index("f_s again") == names.index("f_s") - 1
    _, texts, order = rows(pins)[names.index("f_s again")]
    assert texts == ["9.0 ± 1.4", "5.0", "–"]
    assert order == [pytest.approx(9.0), pytest.approx(5.0), None]
    assert "f_s again" not in [what for what, _, _ in rows([entry(small_reader, 2)])]
    assert "f<sub>s</sub> again" in render(pins)


def test_text_from_a_file_is_escaped(small_reader: RunReader) -> None:
    evil = dataclasses.replace(entry(small_reader, 2), path=Path("<b>x.tsmr"))
    for markup in (render([evil, evil]), render_pins([evil], "")):
        assert "<b>x" not in markup


def test_a_failed_robot_has_no_figures(small_reader: RunReader) -> None:
    none = np.full_like(small_reader.evaluation(2).distances, np.nan)
    failed = entry(small_reader, 2, fitness=None, distances=none)
    found = {what: values for what, values, _ in rows([failed, entry(small_reader, 3)])}
    assert found["f_s"][0] == "–"
    assert isinstance(failed.evaluation, Evaluation)
    line = render_distances([("diverged", None), (None, 0.25), (None, None)])
    assert [w in line for w in ("failed", "25.0", "settles")] == [True] * 3


def test_a_robot_that_does_not_survive_settling_leaves_the_others_their_frames(
    small_reader: RunReader, monkeypatch: pytest.MonkeyPatch
) -> None:
    (alive,) = side_by_side_replay([entry(small_reader, 3)], TrialChoice(target=1)).lanes
    alive.advance(alive.end_time)
    dead = SimpleNamespace(
        frames=alive.frames[:1],
        target=None,
        failure="it flew apart",
        start_time=alive.start_time,
        end_time=alive.end_time,
        frame_period=alive.frame_period,
        walls=(),
        morphology=alive.morphology,
        head=alive.head,
    )
    drawn = mock.MagicMock()
    monkeypatch.setattr(side_by_side_scene, "RobotDrawing", drawn)
    scene = SideBySideScene(mock.MagicMock(), mock.MagicMock(facing=np.eye(3)[:2]))
    scene.show(SideBySideReplay([dead, alive], ["A", "B"]), 1.0, Overlays())  # type: ignore[list-item]
    (lane,) = scene.drawn
    assert (lane.number, lane.index) == (1, drawn.return_value.show.call_args[0][0])
    assert alive.frames[lane.index].time == pytest.approx(1.0, abs=alive.frame_period)
    # where it lies, its start is on the line of starts, and its target straight ahead
    head = alive.frames[next(k for k, f in enumerate(alive.frames) if f.time >= 0.0)].head
    start, target = lane.lane.turn.apply([[*head, 0.0], [*alive.target, 0.0]]) + lane.lane.position
    assert start[0] == pytest.approx(0.0, abs=1e-6)
    assert target[1] == pytest.approx(start[1], abs=1e-6)
    scene.clear()
    assert scene.drawn == []
