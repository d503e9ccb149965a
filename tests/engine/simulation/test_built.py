"""What a robot is like where it may differ from the published one, in both simulators."""

from __future__ import annotations

import dataclasses
import random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine.body import module as t
from engine.body import servo
from engine.body.morphology import Morphology
from engine.config import physics_from_json
from engine.control.genome import Controller
from engine.control.operators import Neat
from engine.errors import InvalidData
from engine.simulation.built import Built, Spread, drawn
from engine.simulation.model import build_robot
from engine.simulation.physics import (
    MOST_FRICTION,
    Physics,
    as_built,
    largest_timestep,
    one_of,
    physics_to_json,
)
from engine.simulation.senses import Messages, ServoAngles, blur_of
from engine.simulation.trials import TrialConfig, start_trials, trials_of
from engine.tasks import GOAL_REACHING, SQUEEZING

BODY = Morphology(3, (1, 8))
SHORT = TrialConfig(repeats=1, settle_time=0.4, open_loop_time=0.4, trial_time=1.0)
DIFFERENT = Built(
    plain_rod_mass=0.0019,
    servo_rod_mass=0.016,
    tether_mass=0.001,
    centre_of_mass=(-0.001, -0.014, -0.008),
    stiffness=(1.4,) * 10,
    module_stiffness=(0.9, 1.1),
    rest_length=0.0212,
    line_stiffness=70.0,
    line_limit=0.0,
    line_errors=(0.002, 0.0, -0.001, 0.0, 0.001),
    winding="even",
    travel=176.0,
    servo_rate=150.0,
    dead_band=4.0,
    sensing_delay=0.1,
)


def controller() -> Controller:
    rng, neat = random.Random(3), Neat(n_inputs=2)
    found = neat.random(rng)
    for _ in range(20):
        found = neat.mutate(found, rng)
    return found


def driven(physics: Physics, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return commands, poses and what was told of the first control updates of a trial."""
    loop = start_trials(
        [BODY],
        [controller()],
        trials_of(GOAL_REACHING, BODY.n_modules, 1)[:1],
        numbers=[5],
        run_seed=1,
        task=GOAL_REACHING,
        physics=physics,
        times=SHORT,
    ).loop
    span = loop.advance(n)
    assert span.sensed is not None
    return span.commanded[:, 0, 0], span.qpos[:, 0, 0], span.sensed[:, 0, 0]


def test_a_robot_that_differs_in_nothing_is_the_published_one() -> None:
    assert drawn(Built(), Spread(), (7,)) == (Built(), 1.0, (1.0, 1.0))
    assert Built().target_lengths() is servo.TARGET_LENGTHS
    assert as_built(Physics(), Built()) == Physics()


@pytest.mark.parametrize(
    "built",
    [
        DIFFERENT,
        dataclasses.replace(DIFFERENT, servo_rate=0.0, dead_band=0.0, sensing_delay=0.0, winding="published"),
    ],
)
def test_both_simulators_simulate_the_same_robot(built: Built) -> None:
    physics = dataclasses.replace(as_built(Physics(), built), servo_noise=0.0)
    commands, poses, told = driven(physics, 8)
    other = driven(dataclasses.replace(physics, simulator="mujoco"), 8)
    np.testing.assert_allclose(commands, other[0], atol=2e-5)
    np.testing.assert_allclose(told, other[2], atol=2e-3)
    np.testing.assert_allclose(poses, other[1], atol=2e-3)
    published = driven(dataclasses.replace(physics, built=Built()), 8)
    assert np.abs(commands - published[0]).max() > 1e-3


def test_a_model_has_the_figures() -> None:
    model = build_robot(BODY, as_built(Physics(), DIFFERENT)).model
    assert model.body("m0_rod0").mass == pytest.approx(0.17)  # with its tether
    assert model.body("m0_rod1").mass == pytest.approx(0.019)
    assert model.body("m1_rod0").ipos == pytest.approx((-0.001, -0.014, -0.008))
    k = t.stiffness_n_per_m(0.3) * 1.4
    cables = [model.tendon(f"m{m}_cable_0_4").id for m in range(2)]
    assert model.tendon_stiffness[cables] == pytest.approx([0.9 * k, 1.1 * k])
    assert model.tendon_lengthspring[cables, 1] == pytest.approx([0.0212, 0.0212])
    assert model.actuator("m0_servo_10").gainprm[0] == 70.0
    assert model.actuator("m0_servo_10").forcerange[0] < -100.0


def test_a_servo_turns_no_faster_than_it_can_and_rests_in_its_dead_band() -> None:
    physics = as_built(Physics(), Built(servo_rate=200.0, dead_band=2.0))
    angles = ServoAngles(physics, (1,))
    assert [float(angles.after(np.array([c]))[0]) for c in (1.0, 10.0, 10.0, 10.0, 11.0, 200.0)] == [
        0.0,
        4.0,
        8.0,
        8.0,
        12.0 - 1.0,
        15.0,
    ]


def test_the_kernels_servos_turn_as_fast() -> None:
    built = Built(servo_rate=100.0)
    physics = dataclasses.replace(as_built(Physics(), built), servo_noise=0.0)
    commands, _, _ = driven(physics, 40)
    angle = np.array([[_angle(lengths) for lengths in update] for update in commands])
    assert np.abs(np.diff(angle, axis=0)).max() == pytest.approx(2.0, abs=0.02)


def _angle(lengths: np.ndarray) -> float:
    """Return the angle at which a servo's cables have these lengths."""
    table = servo.target_lengths(np.linspace(0.0, 180.0, 18_001))
    return float(np.abs(table - lengths).sum(axis=1).argmin()) / 100.0


def test_messages_come_late() -> None:
    physics = as_built(Physics(), Built(sensing_delay=0.04))
    messages = Messages(GOAL_REACHING, physics, [[(1, 2, 3, 4)]])
    told = [float(messages.told(np.full((1, 1, 2), v))[0, 0, 0]) for v in (1.0, 2.0, 3.0, 4.0)]
    assert told == [1.0, 1.0, 1.0, 2.0]


def test_the_kernel_tells_as_late() -> None:
    physics = dataclasses.replace(Physics(), servo_noise=0.0)
    _, _, prompt = driven(physics, 1)
    _, _, late = driven(as_built(physics, Built(sensing_delay=0.2)), 12)
    assert (late[:11] == prompt[0]).all()
    assert (late[11] != prompt[0]).any()


def test_noise_of_the_senses_has_its_size_and_leaves_that_of_the_cables() -> None:
    built = Built(position_noise=0.01, heading_noise=5.0)
    blur = blur_of(GOAL_REACHING, built)
    assert blur == pytest.approx((1.0, np.radians(5.0)))  # in cm and rad
    assert blur_of(SQUEEZING, built)[4] == 0.0
    commands, _, told = driven(as_built(Physics(), built), 1)
    plain, _, sensed = driven(Physics(), 1)
    assert (told != sensed).all()
    n = commands.shape[-1]
    _, _, many = driven(as_built(Physics(), built), 300)
    _, _, few = driven(Physics(), 300)
    scatter = np.diff(many, axis=0).std(axis=0) / np.sqrt(2.0)
    assert np.diff(few, axis=0).std(axis=0)[0] < 0.3
    assert scatter == pytest.approx(blur, rel=0.2)
    assert n == plain.shape[-1]


figures = st.fixed_dictionaries(
    {f.name: st.floats(0.0, 0.3) for f in dataclasses.fields(Spread) if f.name not in ("travel",)}
)


@settings(max_examples=30)
@given(figures, st.integers(0, 2**32 - 1))
def test_robots_of_a_design_are_possible_and_their_time_step_is_stable(spread: Any, seed: int) -> None:
    spread["centre_of_mass"] /= 100.0
    spread["rest_length"] /= 100.0
    physics = as_built(Physics(), dataclasses.replace(DIFFERENT, line_errors=()), Spread(**spread))
    robot = one_of(physics, (seed,))
    assert robot.timestep <= largest_timestep(robot) * (1 + 1e-9)
    assert not robot.spread
    assert robot == one_of(physics, (seed,))


def test_deviations_have_their_size_and_do_not_depend_on_each_other() -> None:
    spread = Spread(stiffness=0.1, line_errors=0.001, friction=0.2)
    robots = [drawn(Built(), spread, (k,)) for k in range(400)]
    friction = np.array([f for _, f, _ in robots])
    stiffness = np.array([b.module_stiffness[0] for b, _, _ in robots])
    lines = np.array([b.line_errors for b, _, _ in robots])
    assert friction.std() == pytest.approx(0.2, rel=0.15)
    assert stiffness.mean() == pytest.approx(1.0, abs=0.02)
    assert stiffness.std() == pytest.approx(0.1, rel=0.15)
    assert lines.std() == pytest.approx(0.001, rel=0.05)
    assert abs(np.corrcoef(friction, stiffness)[0, 1]) < 0.15
    without = [drawn(Built(), dataclasses.replace(spread, stiffness=0.0), (k,)) for k in range(5)]
    assert [b.line_errors for b, _, _ in without] == [b.line_errors for b, _, _ in robots[:5]]


def test_feet_of_robots_as_built_grip_backward_and_differ() -> None:
    published = Physics(feet_forward=0.4, feet_backward=0.45)
    assert published.feet_friction == (0.4, 0.45)
    known = as_built(published, Built(feet_forward=0.2, feet_backward=0.6))
    assert known.feet_friction == (0.2, 0.6)
    with pytest.raises(InvalidData, match=r"backward at least as large as forward.*0.5.*0.45"):
        as_built(published, Built(feet_forward=0.5))
    varied = as_built(published, Built(), Spread(feet_forward=0.3, feet_backward=0.3))
    pairs = [one_of(varied, (k,)).feet_friction for k in range(50)]
    assert all(0.0 < forward <= backward <= MOST_FRICTION for forward, backward in pairs)
    assert len(set(pairs)) == 50
    assert 0.2 < np.std([forward for forward, _ in pairs]) / 0.4 < 0.4
    assert one_of(as_built(published, Built(), Spread(mass=0.1)), (1,)).feet_friction == (0.4, 0.45)


def test_files_tell_of_built_feet_only_where_they_are_known() -> None:
    old = physics_to_json(as_built(Physics(), Built(line_limit=0.0), Spread(mass=0.1)))
    assert not {"feet_forward", "feet_backward", "tether_mass"} & {*old["built"], *old["spread"]}
    new = as_built(
        Physics(), Built(feet_forward=0.2, feet_backward=0.6, tether_mass=0.001), Spread(feet_forward=0.1)
    )
    assert physics_from_json(physics_to_json(new)) == new
    assert physics_from_json(old).built == Built(line_limit=0.0)


@pytest.mark.parametrize(
    ("figures", "reason"),
    [
        ({"plain_rod_mass": 0.0}, "plain_rod_mass must be positive"),
        ({"line_limit": -1.0}, "line_limit must not be negative"),
        ({"feet_forward": -0.1}, "feet_forward must not be negative"),
        ({"tether_mass": -0.03}, "tether_mass must not lift the robot"),
        ({"sensing_delay": 9.0}, "sensing_delay must be from 0 to 5 s"),
        ({"stiffness": (1.0,)}, "stiffness must not have 1 numbers"),
        ({"stiffness": (-1.0,) * 10}, "must be positive"),
        ({"line_errors": (0.001,)}, "line_errors must not have 1 numbers"),
        ({"centre_of_mass": (1.0, 0.0, 0.0)}, "outside the module"),
        ({"travel": float("nan")}, "travel must be finite"),
    ],
)
def test_a_robot_that_cannot_be_is_refused(figures: dict[str, Any], reason: str) -> None:
    with pytest.raises(InvalidData, match=reason):
        Built(**figures)
