"""Walls: where they stand, what rays and robots meet."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.simulation.model import build_robot, build_spec, with_walls
from engine.simulation.physics import Physics
from engine.tasks import SQUEEZING, GroundFrame, worlds
from engine.tasks.walls import BURIED, Obstacles, Wall, add_walls
from tests.support.made_up import examples

BOX = Wall(centre=(0.5, 0.2, 0.05), half_size=(0.1, 0.3, 0.05))

boxes = st.builds(
    lambda x, y, a, b, yaw: Wall(centre=(x, y, 0.05), half_size=(a, b, 0.05), yaw=yaw),
    *[st.floats(-1.0, 1.0)] * 2,
    *[st.floats(0.01, 0.5)] * 2,
    st.floats(-4.0, 4.0),
)


def look(walls, position, degrees):
    turn = math.radians(degrees)
    at = np.array(position, float)[None, None]
    way = np.array([math.cos(turn), math.sin(turn)])[None, None]
    return float(Obstacles([walls]).clearance(at, way)[0, 0])


@pytest.mark.parametrize(
    ("position", "degrees", "distance"),
    [
        ((0.0, 0.0), 0, 0.4),  # the face at x = 0.4
        ((0.0, 0.49), 0, 0.4),
        ((0.0, 0.51), 0, math.inf),  # past its edge at y = 0.5
        ((0.0, 0.0), 180, math.inf),  # it lies behind
        ((1.0, 0.0), 180, 0.4),
        ((0.5, 1.0), -90, 0.5),
        ((0.1, 0.0), 45, 0.3 * math.sqrt(2)),
        ((0.5, 0.2), 77, 0.0),  # inside
        ((0.4, -1.0), 90, 0.9),  # along a face
        ((0.39, -1.0), 90, math.inf),
    ],
)
def test_distances_straight_ahead_by_hand(position, degrees, distance):
    assert look([BOX], position, degrees) == pytest.approx(distance, abs=1e-9)


def test_a_turned_box_shows_its_edge():
    square = Wall(centre=(1.0, 0.0, 0.05), half_size=(0.1, 0.1, 0.05), yaw=math.pi / 4)
    assert look([square], (0.0, 0.0), 0) == pytest.approx(1.0 - 0.1 * math.sqrt(2))
    assert look([square, BOX], (0.0, 0.0), 0) == pytest.approx(0.4)


def test_what_is_buried_is_not_seen():
    under = Wall(centre=(0.5, 0.0, -0.05), half_size=(0.1, 0.1, 0.05))
    assert BURIED.is_buried
    assert look([under, BURIED], (0.0, 0.0), 0) == math.inf
    assert look([], (0.0, 0.0), 0) == math.inf


@examples(60)
@given(st.lists(boxes, min_size=1, max_size=4), *[st.floats(-1.0, 1.0)] * 2, st.floats(-180.0, 180.0))
def test_mujoco_sees_the_same_walls(walls, x, y, degrees):
    spec = mujoco.MjSpec()
    add_walls(spec, walls)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    turn, hit = math.radians(degrees), np.zeros(1, np.int32)
    found = mujoco.mj_ray(
        model, data, np.array([x, y, 0.05]), np.array([math.cos(turn), math.sin(turn), 0.0]), None, 1, -1, hit
    )
    got = look(walls, (x, y), degrees)
    assume(got > 0.0)  # from inside a box MuJoCo sees its other side
    if (found < 0.0) != (got == math.inf):
        # only a ray that grazes an edge may be judged either way: beside it there are both
        beside = {look(walls, (x, y), degrees + turned) == math.inf for turned in (-1e-3, 1e-3)}
        assert beside == {True, False}
    elif found >= 0.0:
        assert got == pytest.approx(found, abs=1e-6)


def test_placing_walls_turns_them_with_the_head():
    # a head at (1, 2) that looks along the world's y
    frame = GroundFrame.of(np.array([[[1.0, 2.0]]]), np.array([[[1.0, 1.5]]]))
    (placed,) = frame.place(0, [BOX])
    np.testing.assert_allclose(placed.centre, (1.0 - 0.2, 2.0 + 0.5, 0.05))
    assert placed.half_size == BOX.half_size
    assert placed.yaw == pytest.approx(math.pi / 2)


def test_numbers_that_are_no_box_are_refused():
    with pytest.raises(InvalidData, match="half_size"):
        Wall(centre=(0, 0, 0), half_size=(0, 1, 1))
    with pytest.raises(InvalidData, match="centre"):
        Wall(centre=(0, math.nan, 0), half_size=(1, 1, 1))
    with pytest.raises(InvalidData, match="centre"):
        Wall(centre=(0, 0), half_size=(1, 1, 1))
    with pytest.raises(InvalidData, match="yaw"):
        Wall(centre=(0, 0, 0), half_size=(1, 1, 1), yaw=math.inf)
    assert Wall.from_json(BOX.to_json()) == BOX


def test_a_robot_compiled_again_with_walls_is_the_robot_described_with_them():
    body, physics, walls = Morphology(4, (1, 2, 3)), Physics(), worlds(SQUEEZING, 3)[0]
    spec = build_spec(body, physics=physics)
    add_walls(spec, walls)
    expected, got = spec.compile(), with_walls(build_robot(body, physics), walls)
    compared = 0
    for name in dir(expected):
        value = getattr(expected, name)
        if isinstance(value, np.ndarray):
            np.testing.assert_array_equal(getattr(got, name), value, err_msg=name)
            compared += 1
    assert compared > 300
    assert build_robot(body, physics).model.ngeom == got.ngeom - 5


def depth_of(model, data, walls):
    """How deep the axes of the rods' capsules reach into walls, in m; negative outside."""
    capsules = model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE
    axis = data.geom_xmat[capsules].reshape(-1, 3, 3)[..., 2] * model.geom_size[capsules, 1:2]
    points = np.concatenate([data.geom_xpos[capsules] + part * axis for part in np.linspace(-1, 1, 21)])
    deepest = -math.inf
    for w in walls:
        c, s = math.cos(w.yaw), math.sin(w.yaw)
        local = (points - w.centre) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        deepest = max(deepest, float((np.array(w.half_size) - np.abs(local)).min(axis=1).max()))
    return deepest


@pytest.mark.parametrize("yaw", [0.0, 2.1])
def test_a_robot_pushed_hard_against_the_walls_does_not_enter_them(yaw):
    """Gravity at 45 degrees throws two modules against the front wall, beside its aperture.

    They meet it at 0.4 m/s, three times as fast as any that crawls, and then lean on it.
    """
    robot, ahead = build_robot(Morphology(8, (1, 1)), Physics()), np.array([math.cos(yaw), math.sin(yaw)])
    frame = GroundFrame.of(np.zeros((1, 1, 2)), -ahead[None, None])
    # the aperture is to the left, so what is 25 cm to the right meets the wall
    walls = frame.place(0, worlds(SQUEEZING, 2)[0])
    start = -0.25 * np.array([-ahead[1], ahead[0]]) - 0.1 * ahead
    gone = {}
    for name, model in (("open", robot.model), ("walled", with_walls(robot, walls))):
        data = mujoco.MjData(model)
        data.qpos.reshape(-1, 7)[:, :2] += start
        data.ctrl[:] = 1.0
        mujoco.mj_step(model, data, 400)
        model.opt.gravity[:2] = ahead * abs(model.opt.gravity[2])
        depths = []
        for _ in range(200):
            mujoco.mj_step(model, data, 4)
            depths.append(depth_of(model, data, walls))
        model.opt.gravity[:2] = 0.0
        gone[name] = (float((data.qpos.reshape(-1, 7)[:, :2] @ ahead).max()), max(depths), depths[-1])
    assert gone["open"][0] > 0.4  # without walls it goes where they would be
    assert gone["open"][1] > 0.01
    reach, deepest, last = gone["walled"]
    assert reach < 0.16  # the wall's face is 14.9 cm ahead
    assert 0.0 < deepest + t.ROD_RADIUS < 0.005
    assert abs(last + t.ROD_RADIUS) < 0.0005  # it leans on the wall: the rods' surfaces touch it
