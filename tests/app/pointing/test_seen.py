"""Robots that are pointed at where they lie in the scene: alone, or turned and moved into a lane."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from app.pointing.picking import RobotPart, module_at, part_at
from app.pointing.seen import SeenRobot, module_under, part_under
from app.replay.scene_camera import Ray
from engine.body import module as t
from engine.replay.recording import ReplayFrame
from tests.app.pointing.test_picking import BODY, DRAWING, POSE, towards

FRAME = ReplayFrame(0.0, POSE, np.full((3, 5), 1.0), np.zeros(2), lambda: np.zeros((0, 3)))
ALONE = SeenRobot(BODY, DRAWING, FRAME)
PLACES = st.tuples(*[st.floats(-2.0, 2.0)] * 2)


def in_lane(yaw, x, y):
    return SeenRobot(BODY, DRAWING, FRAME, Rotation.from_euler("z", yaw), np.array([x, y, 0.0]))


def along_with(robot, ray):
    """Return a ray of the robot's own world as it goes through the scene."""
    origin = robot.turn.apply(ray.origin) + robot.position
    return Ray(origin, robot.turn.apply(ray.direction), ray.pixel)


@given(st.floats(-3.0, 3.0), PLACES, st.integers(0, 2), st.integers(0, 28))
def test_a_robot_in_a_lane_is_met_as_in_its_own_world(yaw, place, module, cable):
    robot = in_lane(yaw, *place)
    centre = DRAWING.centres[module].astype(float)
    assert module_at(towards(centre), DRAWING) == module
    assert module_under(along_with(robot, towards(centre)), [robot]) == (0, module)
    middle = RobotPart("cable", module, cable).ends(DRAWING).astype(float).mean(axis=0)
    own = part_at(towards(middle), DRAWING)
    assert own is not None
    assert part_under(along_with(robot, towards(middle)), [robot]) == (0, own)


def test_of_robots_behind_each_other_the_nearest_is_meant():
    behind = in_lane(0.0, 0.0, 1.5)
    low = Ray(DRAWING.centres[1] - [0.0, 1.0, 0.0], np.array([0.0, 1.0, 0.0]), 0.001)
    assert module_under(low, [behind, ALONE]) == (1, 1)
    assert module_under(low, [behind]) == (0, 1)
    assert part_under(low, [behind, ALONE])[0] == 1
    assert module_under(low, []) is None
    assert part_under(low, []) is None


def test_what_is_lit_lies_on_the_robot_in_its_lane():
    robot = in_lane(0.7, 0.4, -0.2)
    half = np.array([0.0, 0.0, t.ROD_LENGTH / 2])

    def tips(turns, positions):
        return Rotation.from_quat(turns, scalar_first=True).apply(half) + positions

    seen = tips(robot.turns(DRAWING.rod_turns), robot.places(DRAWING.rod_positions))
    assert seen == pytest.approx(robot.places(tips(DRAWING.rod_turns, DRAWING.rod_positions)), abs=1e-6)
    assert robot.places(DRAWING.rod_positions).dtype == np.float32
    assert (ALONE.places(DRAWING.rod_positions) == DRAWING.rod_positions).all()
    assert (ALONE.turns(DRAWING.rod_turns) == DRAWING.rod_turns.astype(np.float32)).all()
