from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from engine.config import preset
from engine.storage.reader import RunReader
from engine.tasks.walls import Wall
from viz.robot import head_paths
from viz.robot.head_paths import Ground, wall_corners

points = arrays(float, st.tuples(st.integers(1, 6), st.just(2)), elements=st.floats(-60, 60))
sides = st.floats(20, 400)


@given(points, st.floats(0.2, 8), sides, sides)
def test_the_ground_shows_all_points_and_fills_its_room(shown, border, width, height) -> None:
    ground = Ground.fitting(shown, border, (30, 24), (width, height))
    for p in shown:
        x, y = ground.at(p)
        assert 30 <= x <= 30 + width
        assert 24 <= y <= 24 + height
    assert ground.at(ground.low) == pytest.approx((30, 24))
    assert ground.at(ground.high) == pytest.approx((30 + width, 24 + height))


@given(points, st.floats(10, 30))
def test_lines_are_far_enough_apart_and_within_the_ground(shown, least) -> None:
    ground = Ground.fitting(shown, 1.0, (0, 0), (100, 100))
    step = ground.step(least)
    assert step * ground.scale >= least
    assert f"{step:.0e}"[0] in "125"
    for axis in (0, 1):
        assert all(ground.low[axis] - 1e-9 <= v <= ground.high[axis] + 1e-9 for v in ground.lines(axis, step))


def test_every_target_has_its_path_in_both_pictures(small_reader: RunReader) -> None:
    evaluation = small_reader.evaluation(0)
    drawn = head_paths.render(small_reader.config, evaluation)
    svg = ElementTree.fromstring(re.match(r"<svg.*</svg>", drawn)[0])
    for k in range(4):
        lines = [p for p in svg.iter("path") if p.get("stroke") == head_paths.COLORS[k]]
        assert len(lines) == 3  # both paths and a cross
    assert "squares of" in drawn
    # a file that was made smaller has no paths
    none = evaluation.trajectory[:, :0]
    object.__setattr__(evaluation, "trajectory", none)
    assert head_paths.render(small_reader.config, evaluation) == ""


def test_walls_are_turned() -> None:
    wall = Wall(centre=(1.0, 0.0, 0.1), half_size=(0.2, 0.1, 0.1), yaw=np.pi / 2)
    assert np.ptp(wall_corners(wall), axis=0) == pytest.approx((0.2, 0.4))
    assert preset("smoke").task == "goal-reaching"
