from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.body.kinematics import points_on
from engine.body.morphology import Morphology
from engine.simulation.model import build_robot, module_placements
from engine.simulation.physics import Physics
from viz.robot.geometry import RobotGeometry, friction_arrows
from viz.robot.skeleton import Skeleton

BODY = Morphology(5, (3, 6, 1))


@pytest.fixture
def pose() -> np.ndarray:
    """The robot as built."""
    model = build_robot(BODY, Physics()).model
    return np.array(model.qpos0, dtype=np.float32).reshape(BODY.n_modules, 6, 7)


def test_everything_is_drawn_where_it_was_built(pose: np.ndarray) -> None:
    drawing = RobotGeometry(BODY, 2).draw(pose, np.ones((3, 5)))
    for m, (turn, centre) in enumerate(module_placements(BODY)):
        nodes = drawing.nodes.reshape(3, -1, 3)[m]
        np.testing.assert_allclose(nodes[:12], centre + turn.apply(t.NODES), atol=1e-6)
        np.testing.assert_allclose(nodes[12], centre + turn.apply(t.ACTUATOR_POINT), atol=1e-6)
        cables = drawing.cables.reshape(3, -1, 2, 3)[m]
        assert len(cables) == len(t.CABLES) + len(t.SERVO_NODES)
        for (a, b), ends in zip(t.CABLES, cables, strict=False):
            gap = np.linalg.norm(ends - (centre + turn.apply(t.NODES[[a, b]])), axis=1)
            np.testing.assert_allclose(gap, t.ANCHOR_OFFSET, atol=1e-6)


def test_a_skeleton_is_where_it_was_built(pose: np.ndarray) -> None:
    posed, placed = Skeleton.settled(pose), Skeleton.placed(module_placements(BODY))
    for name in ("nodes", "arms", "cables", "servo_cables", "rods", "centres"):
        np.testing.assert_allclose(getattr(posed, name), getattr(placed, name), atol=1e-6)
    lifted = placed.moved(lambda points: points + np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(lifted.servo_cables[..., 2], placed.servo_cables[..., 2] + 1.0)


def test_cables_are_as_long_as_mujocos() -> None:
    model = build_robot(BODY, Physics()).model
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 200)
    mujoco.mj_forward(model, data)
    drawing = RobotGeometry(BODY, 2).draw(data.qpos.reshape(3, 6, 7), np.ones((3, 5)))
    lengths = np.linalg.norm(drawing.cables[:, 1] - drawing.cables[:, 0], axis=1)
    np.testing.assert_allclose(lengths, data.ten_length[: len(lengths)], atol=1e-6)


def test_rods_point_along_their_nodes(pose: np.ndarray) -> None:
    drawing = RobotGeometry(BODY, 2).draw(pose, np.ones((3, 5)))
    directions = Rotation.from_quat(drawing.rod_turns, scalar_first=True).apply([0.0, 0.0, 1.0])
    nodes = drawing.nodes.reshape(3, -1, 3)[:, :12].reshape(-1, 2, 3)
    ends = (nodes[:, 1] - nodes[:, 0]) / t.ROD_LENGTH
    np.testing.assert_allclose(np.abs((directions * ends).sum(axis=1)), 1.0, atol=1e-5)


def test_a_pulling_servo_is_brighter_than_a_released_one(pose: np.ndarray) -> None:
    geometry = RobotGeometry(BODY, 2)
    released = geometry.draw(pose, np.ones((3, 5))).cable_colors.reshape(3, -1, 6)
    pulling = geometry.draw(pose, np.zeros((3, 5))).cable_colors.reshape(3, -1, 6)
    servo = slice(len(t.CABLES), None)
    assert (pulling[:, servo].sum(axis=-1) > released[:, servo].sum(axis=-1)).all()
    np.testing.assert_array_equal(pulling[:, : len(t.CABLES)], released[:, : len(t.CABLES)])


def test_the_head_and_the_servos_have_their_own_colours() -> None:
    geometry = RobotGeometry(BODY, 0)
    colors = geometry.rod_colors.reshape(3, 6, 3)
    assert (colors[0, 1] != colors[1, 1]).any()
    assert (colors[:, t.SERVO_ROD] == colors[0, t.SERVO_ROD]).all()
    assert len(geometry.node_radii) == len(geometry.node_colors) == 3 * 13


def test_friction_is_an_arrow_on_the_floor_as_long_as_it_is_strong() -> None:
    pose = build_robot(Morphology(5, (1, 2)), Physics()).model.qpos0.reshape(2, 6, 7)
    forces = np.zeros((2, 12, 3))
    forces[1, 5] = (0.03, -0.04, 0.2)
    forces[0, 2] = (0.001, 0.0, 0.3)  # too weak to be seen
    (arrow,) = friction_arrows(pose, forces.astype(np.float16))
    shaft = arrow[0, 1] - arrow[0, 0]
    np.testing.assert_allclose(shaft, [0.015, -0.02, 0.0], atol=2e-5)
    rod = t.rod_of(5)
    node = points_on(pose, np.array([rod]), t.NODES[[5]] - t.ROD_MIDDLES[rod])[1, 0]
    np.testing.assert_allclose(arrow[0, 0, :2], node[:2], atol=1e-6)
    # both strokes of the head begin at the tip and go back
    assert (arrow[1:, 0] == arrow[0, 1]).all()
    assert ((arrow[1:, 1] - arrow[1:, 0]) @ shaft < 0).all()
    assert friction_arrows(pose, np.zeros((2, 12, 3))).shape == (0, 3, 2, 3)
