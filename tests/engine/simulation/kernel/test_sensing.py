"""The kernel's sensors and scores are those of the built-in tasks."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.loop import sensing
from engine.simulation.kernel.physics.state import ROD, WALL
from engine.tasks import (
    GOAL_REACHING,
    SQUEEZING,
    SQUEEZING_BY_DISTANCE,
    GroundFrame,
    View,
    remaining_distance,
    sensed,
    target_offsets,
)
from engine.tasks.squeezing import DEPTH, SENSOR_RANGE
from engine.tasks.walls import BURIED, Obstacles, Wall
from tests.support.made_up import examples

WIDTH = 8
N_RODS = 12
HEADS = [(7, 9, 10, 6, 8, 11), (2, 0, 5, 1, 4, 3)] * 4
"""Per lane the rods of the front and the rear face: of two robots with heads of their own."""
TASKS = (GOAL_REACHING, SQUEEZING)
IN_ALL_UNITS = [task.sensing(units) for task in TASKS for units in ("centimetres", "relative")]
IN_ALL_UNITS.append(SQUEEZING_BY_DISTANCE)


@njit
def _begin(rods, failed, scene, walls):
    sensing.look(rods, failed, scene)
    sensing.place(scene, walls)


@njit
def _sense(rods, failed, scene, inputs, scores):
    sensing.look(rods, failed, scene)
    sensing.sense(scene, inputs)
    sensing.score(scene, scores)


@njit
def _position(scene, out):
    x, y = sensing.position(scene)
    simd.store(out, 0, x)
    simd.store(out, 1, y)


def rods_at(centres):
    """Return vectors of rods whose (lanes, rods, 3) centres are given."""
    rods = simd.reals(ROD * N_RODS, width=len(centres))
    simd.by_lane(rods).reshape(N_RODS, ROD, -1)[:, :3] = centres.transpose(1, 2, 0)
    return rods


def faces(centres, heads):
    """Return the horizontal (lanes, 2) middles of the front and the rear face."""
    rods = np.take_along_axis(centres, np.array(heads)[..., None], axis=1)
    return rods[:, :3, :2].mean(axis=1), rods[:, 3:, :2].mean(axis=1)


class Trial:
    """One trial per lane, in the kernel and as a task's View has it."""

    def __init__(self, task, settled, walls, targets, heads=HEADS):
        width = len(heads)
        self.task, self.walls, self.targets, self.heads = task, walls, targets, heads
        kind = sensing.kind_of(task)
        self.scene = sensing.make_scene(
            kind,
            units=task.units,
            by_distance=task.score is SQUEEZING_BY_DISTANCE.score,
            heads=heads,
            targets=targets,
            walls=walls,
        )
        self.failed = simd.integers(1, width=width)
        self.placed = simd.reals(WALL * len(walls[0]), width=width)
        _begin(rods_at(settled), self.failed, self.scene, self.placed)
        front, rear = faces(settled, heads)
        self.frame = GroundFrame.of(front[:, None], rear[:, None])
        self.width = width

    def felt(self, centres):
        """Return (lanes, inputs) what the kernel senses, and (lanes,) how it scores."""
        inputs, scores = simd.reals(self.task.n_inputs, width=self.width), simd.reals(1, width=self.width)
        _sense(rods_at(centres), self.failed, self.scene, inputs, scores)
        return simd.by_lane(inputs).T.copy(), simd.by_lane(scores)[0].copy()

    def view(self, centres):
        """Return what the task sees: every lane is a robot of one copy."""
        front, rear = faces(centres, self.heads)
        return View(
            front=front[:, None],
            rear=rear[:, None],
            target=self.frame.to_world(self.targets[:, None]),
            frame=self.frame,
            # a world each: clearance takes (..., worlds), so the lanes are worlds of one robot there
            obstacles=_OneRobot(self.walls),
            time=0.0,
            rods=lambda: None,
            height=lambda: None,
        )


class _OneRobot:
    def __init__(self, walls):
        self._obstacles = Obstacles(walls)

    def clearance(self, position, direction):
        return self._obstacles.clearance(position[None, :, 0], direction[None, :, 0])[0, :, None]


def random_trial(task, seed):
    """Return a trial with walls of the task, turned, and (4, lanes, rods, 3) states of it."""
    rng = np.random.default_rng(seed)
    index = rng.integers(0, task.n_targets, WIDTH)
    walls = []
    for k in index:
        boxes = task.walls(k, 2)
        turns = rng.uniform(-4.0, 4.0, len(boxes)) * rng.integers(0, 2, len(boxes))
        boxes = [dataclasses.replace(w, yaw=float(a)) for w, a in zip(boxes, turns, strict=True)]
        there = rng.integers(0, len(boxes) + 1)
        walls.append((*boxes[:there], *[BURIED] * (5 - there)))
    settled = rng.uniform(-1.0, 1.0, (WIDTH, N_RODS, 3))
    targets = target_offsets(task)[index]
    trial = Trial(task, settled, walls, targets)
    return trial, settled + rng.normal(size=(4, WIDTH, N_RODS, 3)) * rng.choice([0.01, 0.3, 1.0])


@pytest.mark.parametrize("task", IN_ALL_UNITS, ids=lambda t: f"{t.name}-{t.units[0]:.1f}-{t.score.__name__}")
@examples(75)
@given(st.integers(0, 2**32 - 1))
def test_sensors_and_scores_are_the_tasks(task, seed):
    trial, states = random_trial(task, seed)
    for centres in states:
        inputs, scores = trial.felt(centres)
        view = trial.view(centres)
        expected = sensed(task, view, np.ones(view.shape, bool))[:, 0]
        # a bearing may be a whole turn off where it is behind to rounding
        off = inputs - expected
        turn = 2.0 * math.pi * task.units[1]
        off[:, 1::2] -= turn * np.round(off[:, 1::2] / turn)
        if task.sense is SQUEEZING.sense:
            unclear = np.abs(view.clearance[:, 0] - SENSOR_RANGE) < 1e-12
            off[unclear, 4] = 0.0
        np.testing.assert_allclose(off, 0.0, atol=1e-11)
        np.testing.assert_allclose(off[:, [0, 2][: task.n_inputs // 2]] / 100.0, 0.0, atol=1e-12)
        np.testing.assert_allclose(scores, task.score(view)[:, 0], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("task", TASKS, ids=lambda t: t.name)
def test_states_are_on_both_sides_of_every_case(task):
    """So that the test before this one has tried what it should have."""
    inputs = []
    for seed in range(60):
        trial, states = random_trial(task, seed)
        inputs += [trial.felt(centres)[0] for centres in states]
    found = np.concatenate(inputs)
    assert (np.abs(found[:, 1]) > math.pi / 2).any()
    if task is SQUEEZING:
        assert 0.02 < found[:, 4].mean() < 0.98
        assert (found[:, 2] > 0.0).any()
        assert (found[:, 2] < 0.0).any()


def test_walls_stand_where_the_frame_places_them():
    trial, _ = random_trial(SQUEEZING, 2)
    placed = simd.by_lane(trial.placed).reshape(5, WALL, WIDTH)
    for lane in range(WIDTH):
        for k, wall in enumerate(trial.frame.place(lane, trial.walls[lane])):
            expected = *wall.centre, *wall.half_size, math.cos(wall.yaw), math.sin(wall.yaw)
            np.testing.assert_allclose(placed[k, :, lane], expected, rtol=0.0, atol=1e-14)


def head_at(x, y, turn=0.0):
    """Return the (1, rods, 3) centres of a robot whose head is somewhere and points somewhere."""
    centres = np.zeros((1, N_RODS, 3))
    centres[0, HEADS[0][:3], :2] = x, y
    centres[0, HEADS[0][3:], :2] = x - 0.1 * math.cos(turn), y - 0.1 * math.sin(turn)
    return centres


def one_trial(task, walls=(), target=0):
    offsets = target_offsets(task)[target : target + 1]
    return Trial(task, head_at(3.0, -2.0, 1.0), [walls], offsets, HEADS[:1])


def in_frame(x, y, turn=0.0):
    """Return a robot whose head is at a place of the frame of ``one_trial``."""
    c, s = math.cos(1.0), math.sin(1.0)
    return head_at(3.0 + c * x - s * y, -2.0 + s * x + c * y, 1.0 + turn)


def test_target_to_the_left_is_at_a_positive_bearing():
    inputs, scores = one_trial(GOAL_REACHING).felt(in_frame(0.0, 0.0))
    np.testing.assert_allclose(inputs, [[45.0, math.pi / 2]], rtol=1e-13)
    np.testing.assert_allclose(scores, [0.45], rtol=1e-13)


def test_distance_to_the_gate_is_negative_past_it():
    trial = one_trial(SQUEEZING)
    x, y = target_offsets(SQUEEZING)[0]
    before, _ = trial.felt(in_frame(x / 4.0 - 0.03, y))
    after, _ = trial.felt(in_frame(x / 4.0 + 0.03, y))
    np.testing.assert_allclose([before[0, 2], after[0, 2]], [3.0, -3.0], rtol=1e-12)


@pytest.mark.parametrize(("depth", "bonus"), [(DEPTH - 1e-9, 0.0), (DEPTH + 1e-9, 0.04)])
def test_bonus_is_for_heads_well_past_the_gate(depth, bonus):
    x, y = target_offsets(SQUEEZING)[0]
    _, scores = one_trial(SQUEEZING).felt(in_frame(x / 4.0 + depth, y))
    np.testing.assert_allclose(scores, 0.75 * x - depth - bonus, rtol=1e-12)


@pytest.mark.parametrize(
    ("gap", "turn", "felt"),
    [(0.099, 0.0, 1.0), (0.101, 0.0, 0.0), (0.05, math.pi, 0.0), (0.05, 0.3, 1.0), (-0.01, 0.0, 1.0)],
    ids=["near", "far", "behind", "askew", "inside"],
)
def test_wall_ahead(gap, turn, felt):
    wall = Wall(centre=(gap + 0.05, 0.02, 0.1), half_size=(0.05, 0.3, 0.1))
    inputs, _ = one_trial(SQUEEZING, (wall,)).felt(in_frame(0.0, 0.0, turn))
    assert inputs[0, 4] == felt


def test_a_failed_lane_keeps_its_last_faces():
    trial, (one, other, *_) = random_trial(SQUEEZING, 1)
    before, score = trial.felt(one)
    simd.by_lane(trial.failed)[0, 3] = 2
    broken = other.copy()
    broken[3] = np.nan
    inputs, scores = trial.felt(broken)
    assert inputs[3].tobytes() == before[3].tobytes()
    assert scores[3] == score[3]
    simd.by_lane(trial.failed)[0, 3] = 0
    healthy = np.arange(WIDTH) != 3
    assert inputs[healthy].tobytes() == trial.felt(other)[0][healthy].tobytes()


def test_the_settled_head_is_the_frames_origin():
    trial, _ = random_trial(GOAL_REACHING, 4)
    out = simd.reals(2, width=WIDTH)
    _position(trial.scene, out)
    assert not simd.by_lane(out).any()


def test_lanes_have_the_same_bits_alone():
    trial, states = random_trial(SQUEEZING, 9)
    rng = np.random.default_rng(1)
    settled = rng.uniform(-1.0, 1.0, (WIDTH, N_RODS, 3))
    wide = Trial(SQUEEZING, settled, trial.walls, trial.targets)
    together = [np.column_stack(wide.felt(centres)) for centres in states]
    for lane in range(WIDTH):
        part = slice(lane, lane + 1)
        alone = Trial(SQUEEZING, settled[part], trial.walls[part], trial.targets[part], HEADS[part])
        for centres, expected in zip(states, together, strict=True):
            assert np.column_stack(alone.felt(centres[part])).tobytes() == expected[part].tobytes()


def test_only_tasks_with_both_functions_are_in_the_kernel():
    assert sensing.kind_of(GOAL_REACHING) == sensing.GOAL
    assert sensing.kind_of(dataclasses.replace(SQUEEZING, target_distance=0.7)) == sensing.APERTURE
    assert sensing.kind_of(dataclasses.replace(GOAL_REACHING, sense=remaining_distance)) == sensing.PYTHON
    assert sensing.kind_of(dataclasses.replace(SQUEEZING, score=remaining_distance)) == sensing.PYTHON
