import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.errors import InvalidData
from engine.tasks import (
    BUILT_IN,
    GOAL_REACHING,
    SETTLE_TIME,
    TRIAL_TIME,
    distance_and_bearing,
    fitness,
    get_task,
    sensed,
    target_offsets,
    worlds,
)
from tests.support.made_up import a_view, examples

lengths = st.floats(0.0, 2.0)
coordinates = st.floats(-1.0, 1.0)
distances = st.integers(1, 5).flatmap(
    lambda repeats: st.lists(st.lists(lengths, min_size=repeats, max_size=repeats), min_size=1, max_size=5)
)


def test_goal_reaching_is_the_published_task():
    assert GOAL_REACHING.n_inputs == 2
    assert GOAL_REACHING.target_distance == 0.45
    assert np.degrees(GOAL_REACHING.target_bearings).tolist() == [90, 45, -45, -90]
    assert GOAL_REACHING.n_targets == 4
    assert worlds(GOAL_REACHING, 5) == [()] * 4
    assert GOAL_REACHING.target_names == ("90° left", "45° left", "45° right", "90° right")
    assert (SETTLE_TIME, TRIAL_TIME) == (3.0, 40.0)


def test_tasks_are_found_by_name():
    assert all(get_task(name) is task and task.name == name for name, task in BUILT_IN.items())
    with pytest.raises(InvalidData, match="goal-reaching"):
        get_task("flying")


def test_a_hand_computed_fitness():
    # means per target 0.45, 0.30, 0.30, 0.70: their mean is 0.4375, the largest 0.70
    got = fitness(np.array([[0.4, 0.5], [0.3, 0.3], [0.2, 0.4], [0.6, 0.8]]))
    assert got == pytest.approx(0.4375 + 0.5 * (0.70 - 0.4375))
    assert got == pytest.approx(0.56875)


def test_fitness_of_equal_targets_is_their_distance():
    assert fitness(np.full((4, 2), 0.45)) == pytest.approx(0.45)


@examples(100)
@given(distances)
def test_fitness_is_between_the_mean_and_the_worst_target(values):
    per_target = [sum(row) / len(row) for row in values]
    mean = sum(per_target) / len(per_target)
    expected = mean + 0.5 * (max(per_target) - mean)
    got = fitness(np.array(values))
    assert got == pytest.approx(expected, abs=1e-12)
    assert mean - 1e-12 <= got <= max(per_target) + 1e-12


@pytest.mark.parametrize(
    ("position", "direction", "point", "distance", "degrees"),
    [
        ((0, 0), (1, 0), (2, 0), 2.0, 0),
        ((0, 0), (1, 0), (0, 3), 3.0, 90),  # left
        ((0, 0), (1, 0), (0, -3), 3.0, -90),  # right
        ((0, 0), (0, 1), (-1, 0), 1.0, 90),
        ((0, 0), (0, 1), (1, 0), 1.0, -90),
        ((1, 1), (1, 0), (2, 2), math.sqrt(2), 45),
        ((1, 1), (-1, 0), (2, 2), math.sqrt(2), -135),
        ((1, 2), (0.1, 0.1), (1, 5), 3.0, 45),
        ((0, 0), (1, 0), (-1, 0), 1.0, 180),
    ],
)
def test_distance_and_bearing_by_hand(position, direction, point, distance, degrees):
    got = distance_and_bearing(*(np.array(v, float) for v in (position, direction, point)))
    assert got[0] == pytest.approx(distance)
    assert np.degrees(got[1]) == pytest.approx(degrees)


@examples(100)
@given(
    st.tuples(coordinates, coordinates),
    st.floats(-math.pi, math.pi),
    st.floats(0.01, 5.0),
    st.floats(0.01, 2.0),
    st.floats(-3.1, 3.1),
)
def test_walking_distance_and_bearing_leads_to_the_point(position, heading, speed, far, bearing):
    position = np.array(position)
    direction = speed * np.array([math.cos(heading), math.sin(heading)])
    way = np.array([math.cos(heading + bearing), math.sin(heading + bearing)])
    got = distance_and_bearing(position, direction, position + far * way)
    assert got[0] == pytest.approx(far)
    assert got[1] == pytest.approx(bearing, abs=1e-9)


def test_many_points_at_once():
    position = np.zeros((2, 3, 2))
    direction = np.broadcast_to([1.0, 0.0], (2, 3, 2))
    point = np.random.default_rng(0).normal(size=(2, 3, 2))
    distance, bearing = distance_and_bearing(position, direction, point)
    np.testing.assert_allclose(distance, np.linalg.norm(point, axis=-1))
    np.testing.assert_allclose(bearing, np.angle(point[..., 0] + 1j * point[..., 1]))


def test_targets_are_ahead_and_to_the_left_positive():
    half = 0.45 / math.sqrt(2)
    np.testing.assert_allclose(
        target_offsets(GOAL_REACHING),
        [(0.0, 0.45), (half, half), (half, -half), (0.0, -0.45)],
        atol=1e-12,
    )


def test_targets_at_chosen_bearings():
    np.testing.assert_allclose(
        target_offsets(GOAL_REACHING, [math.pi, 0.0]), [(-0.45, 0.0), (0.45, 0.0)], atol=1e-12
    )


@pytest.mark.parametrize(
    ("sensors", "expected"),
    [("centimetres", [30 * math.sqrt(2), math.pi / 4]), ("relative", [2 / 3 * math.sqrt(2), 1 / 4])],
)
def test_controllers_sense_in_the_units_asked_for(sensors, expected):
    view = a_view(position=(0.1, 0.0), direction=(0.0, 0.2), target=(-0.2, 0.3))
    found = sensed(get_task("goal-reaching", sensors), view, np.ones((1, 1), bool))
    assert found.shape == (1, 1, 2)
    np.testing.assert_allclose(found[0, 0], expected)


def test_units_are_factors_on_what_is_sensed():
    twice = dataclasses.replace(GOAL_REACHING, units=(2.0, 0.0), relative_units=())
    view = a_view(position=(0.0, 0.0), direction=(0.0, 0.2), target=(0.0, 0.3))
    np.testing.assert_allclose(sensed(twice, view, np.ones((1, 1), bool))[0, 0], [0.6, 0.0])
    # one set of units is for every run
    assert twice.sensing("relative") == twice
    plain = dataclasses.replace(GOAL_REACHING, units=(), relative_units=())
    assert plain.units == plain.relative_units == (1.0, 1.0)


@pytest.mark.parametrize(
    ("units", "reason"),
    [
        ((1.0,), "1 units for 2 inputs"),
        ((1.0, math.inf), "finite numbers, not inf"),
        (("1", 1.0), "finite numbers, not '1'"),
        ("cm", "must be a tuple, not 'cm'"),
        (3.0, "must be a tuple, not 3.0"),
    ],
)
def test_units_that_fit_no_input_are_refused(units, reason):
    with pytest.raises(InvalidData, match=reason):
        dataclasses.replace(GOAL_REACHING, units=units)


def test_fitness_is_never_a_negative_zero():
    assert math.copysign(1.0, fitness(np.array([[-0.0, -0.0], [-0.0, -0.0]]))) == 1.0
