"""Feet that grip one way: rods slide as worked out by hand, robots that hold still stay where they are."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.simulation.kernel.guard import read_robot
from engine.simulation.kernel.lanes.simd import by_lane
from engine.simulation.kernel.loop.trials import Start
from engine.simulation.kernel.loop.trials import Trials as KernelTrials
from engine.simulation.kernel.physics.state import forget, new_state
from engine.simulation.kernel.robots.model import may_share, model_of
from engine.simulation.kernel.step import run
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics
from engine.simulation.rollout import Head
from engine.tasks import GOAL_REACHING, target_offsets
from tests.support.kernel_driven import EVERYTHING, all_bytes, driven, drop, trials, trials_of
from tests.support.made_up import evolved_controller

PHYSICS = Physics(feet_forward=0.3, feet_backward=0.8)
WIDTH = 8
ROOT = np.sqrt(0.5)
ALONG_X = {0: (1, 0, 0, 0), 1: (ROOT, 0, 0, -ROOT), 2: (ROOT, 0, ROOT, 0)}
"""Quaternions that lay a rod along x, by the axis of its own frame that it lies along."""
STEP = PHYSICS.timestep
GRAVITY = 9.81 / PHYSICS.inertia_scale


def robot(feet, faces=(5, 6), level=5):
    return build_robot(Morphology(level, faces, (), feet), PHYSICS)


def loose(feet):
    """Return the numbers of a robot without cables and links: 12 rods that pass through each other."""
    numbers = read_robot(robot(feet))
    nothing = dict.fromkeys(
        ("cable_damping", "servo_gain", "servo_offset", "servo_limit", "servo_damping"), 0.0
    )
    return numbers._replace(
        **nothing,
        stiffness=np.zeros(2),
        links=np.empty((0, 2), np.int64),
        link_arms=np.empty((0, 2)),
        link_weight=np.empty(0),
        apart=np.ones((12, 12), bool),
    )


def laid(feet, height):
    """Return loose rods along x, those of the second module ahead of the first's; a lane for each of feet.

    Returns:
        The model, its state, and a view (rods, 13, lanes) of the rods.
    """
    numbers = [loose(f) for f in feet]
    model = model_of(numbers)
    state = new_state(model)
    rods = by_lane(state.rods).reshape(12, 13, WIDTH)
    for k in range(12):
        rods[k, :3] = np.array([(-0.2, 0.2)[k // 6], 0.02 * (k % 6), height])[:, None]
        rods[k, 3:7] = np.array(ALONG_X[int(numbers[0].axis[k % 6])])[:, None]
    return model, state, rods


WAYS = [("end", 1), ("end", -1), ("start", 1), ("start", -1), ("none", 1), ("none", -1)]
COEFFICIENTS = [0.3, 0.8, 0.8, 0.3, 0.5, 0.5]


def test_rods_pushed_both_ways_slide_as_far_as_coulomb_says():
    """A rod at speed v stops after v^2 / (2 mu g), less half a step's way, and stays."""
    feet, ways = zip(*WAYS, ("end", 1), ("end", 1), strict=True)
    model, state, rods = laid(feet, read_robot(robot("none")).radius)
    run(model, state, 200)
    speed, plain = 0.1, [1, 2, 3, 4, 5, 7, 8, 9, 10, 11]  # the other two have a servo, off their axis
    start = rods[plain, 0].copy()
    rods[:, 7] += speed * np.array(ways)
    forget(state)
    run(model, state, 200)
    slid = (rods[plain, 0] - start) * np.array(ways)
    expected = speed**2 / (2 * np.array([*COEFFICIENTS, 0.3, 0.3]) * GRAVITY) - speed * STEP / 2
    np.testing.assert_allclose(slid, np.broadcast_to(expected, slid.shape), rtol=0.01)
    assert np.abs(rods[plain, 7:]).max() < 1e-5


def by_hand(rod, friction, angle, v, numbers, depth):
    """Return speed along x and angular velocity about y after one step of a rod whose front touches ground.

    One contact in the plane of x and z: its force f minimises f'Bf / 2 + b'f within friction.
    """
    mass, inertia = 1 / numbers.inverse_mass[rod], 1 / numbers.inverse_inertia[rod]
    rx = numbers.half_length * np.cos(angle)
    rz = -numbers.half_length * np.sin(angle) - numbers.radius - depth / 2
    # MuJoCo's contact: time constant 20 ms, critically damped, impedance 0.995, 100 times softer along z
    soft = 0.005 / 0.995 / mass
    response = np.array(
        [
            [1 / mass + rz * rz / inertia + soft / 100, -rx * rz / inertia],
            [-rx * rz / inertia, 1 / mass + rx * rx / inertia + soft],
        ]
    )
    sought = np.array([-v * 2 / (0.995 * 0.02), -0.995 * depth / (0.995 * 0.02) ** 2])
    unforced = np.array([0.0, -GRAVITY]) - sought
    force = -np.linalg.solve(response, unforced)
    sticks = abs(force[0]) <= friction * force[1]
    if not sticks:
        edge = np.array([friction * np.sign(force[0]), 1.0])
        force = edge * max(0.0, -edge @ unforced / (edge @ response @ edge))
    turning = (rz * force[0] - rx * force[1]) / inertia
    return v + STEP * force[0] / mass, STEP * turning, sticks


@pytest.mark.parametrize("rod", [4, 5, 10])
def test_one_step_of_a_touching_rod_is_that_worked_out_by_hand(rod):
    """Fast, and just below and above the speed up to which a foot holds."""
    feet = ["end", "end", "start", "start", "end", "end", "start", "none"]
    speeds = [0.3, -0.3, 0.3, -0.3, 1e-6, 1e-5, 1e-5, 1e-5]
    expected = [0.3, 0.8, 0.8, 0.3, 0.8, 0.3, 0.8, 0.5]
    depth, angle = -0.002, 0.5
    model, state, rods = laid(feet, 0.5)
    numbers = loose("end")
    rods[rod, 2] = numbers.half_length * np.sin(angle) + numbers.radius + depth
    # its front end is down
    rods[rod, 3:7] = np.array([np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0])[:, None]
    rods[rod, 7] = speeds
    run(model, state, 1)
    own = [by_hand(rod % 6, f, angle, v, numbers, depth) for f, v in zip(expected, speeds, strict=True)]
    np.testing.assert_allclose(rods[rod, 7], [x for x, _, _ in own], rtol=0, atol=1e-9)
    np.testing.assert_allclose(rods[rod, 11], [w for _, w, _ in own], rtol=0, atol=1e-7)
    # the two speeds at which a foot begins to slide tell the coefficients apart
    assert [sticks for *_, sticks in own[4:]] == [True, False, True, True]


def test_robots_with_and_without_feet_share_a_vector():
    """And have the bytes that they have alone."""
    assert may_share(read_robot(robot("start")), read_robot(robot("none")))
    bodies = [Morphology((4, 8), (3, 6), (), feet) for feet in ("none", "end", "start")]
    alone = [driven(morphology=body) for body in bodies]
    together = trials_of([alone[k % 3] for k in range(6)], range(6), 8, PHYSICS, GOAL_REACHING)
    found = all_bytes(together, together.run(60, EVERYTHING))
    for k in range(3):
        single = trials(alone[k], [k, k + 3])
        assert all_bytes(single, single.run(60, EVERYTHING)) == [found[k], found[k + 3]]
    assert len({found[0], found[1], found[2]}) == 3


def test_equal_coefficients_are_plain_friction():
    """However the feet point: what they change is nothing but the coefficient."""
    same = Physics(feet_forward=0.5, feet_backward=0.5)
    found = []
    for feet in ("none", "start"):
        body = Morphology(3, (3, 7, 1), (), feet)
        model = model_of([read_robot(build_robot(body, same))] * WIDTH)
        state = new_state(model)
        rods = by_lane(state.rods).reshape(18, 13, WIDTH)
        rods[:, :7] = build_robot(body, same).model.qpos0.reshape(18, 7, 1)
        by_lane(state.commanded)[:] = 0.05
        run(model, state, 400)
        found.append(rods.tobytes())
    assert found[0] == found[1]


def test_noise_does_not_drive_robots_that_hold_still():
    """Held servos under their noise for 40 s, once they hold: no Brownian ratchet."""
    faces = [(1, 5), (8, 3), (2, 2), (7, 1), (4, 6), (3, 8), (5, 5), (6, 2)]
    bodies = [Morphology(2 + k, own, (), ("end", "start")[k % 2]) for k, own in enumerate(faces)]
    dropped = drop(*bodies)
    dropped.settle(150)
    controller = evolved_controller(6, 20, GOAL_REACHING.n_inputs)
    held = KernelTrials(
        [
            Start(read_robot(build_robot(body, PHYSICS)), dropped.state, k, Head.of(body, True), controller)
            for k, body in enumerate(bodies)
        ],
        n_updates=dropped.n_updates,
        targets=np.tile(target_offsets(GOAL_REACHING)[0], (8, 1)),
        noise=[(1, k, 0, 0) for k in range(8)],
        task=GOAL_REACHING,
        physics=PHYSICS,
        width=8,
    )
    for loop in held.loops:
        by_lane(loop.servos.frequency)[:] = 0.0
    held.run(250)
    before, commands = held.rods.mean(axis=(1, 2))[:, :2], held.run(1, EVERYTHING).commands
    held.run(2000)
    assert np.ptp(commands[0] - commands[0].mean(axis=1, keepdims=True)) > 0.0
    moved = np.linalg.norm(held.rods.mean(axis=(1, 2))[:, :2] - before, axis=1)
    assert moved.max() < 0.005
    assert not held.failures.any()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"feet_forward": 0.9}, "backward at least as large as forward"),
        ({"feet_backward": -0.1}, "feet_backward must be positive, not -0.1"),
        ({"feet_forward": 0.0}, "feet_forward must be positive, not 0.0"),
        ({"feet_backward": 5.1}, "at most 5; feet_forward is 0.3, feet_backward 5.1"),
        ({"feet_backward": float("nan")}, "feet_backward must be positive, not nan"),
    ],
)
def test_impossible_feet_are_refused_in_one_line(changes, message):
    with pytest.raises(InvalidData, match=message) as error:
        dataclasses.replace(Physics(), **changes)
    assert "\n" not in str(error.value)
