import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import reference
from engine.body import servo
from tests.support.made_up import examples


def test_choices_of_the_published_configuration():
    assert servo.FREQUENCIES.tolist() == [0.25, 0.5]
    assert servo.PHASES.tolist() == [0.0, 1.57, 3.14, 4.71]


@pytest.mark.parametrize(
    ("output", "expected"),
    [(0.0, 0), (0.2499, 0), (0.25, 1), (0.5, 2), (0.7499, 2), (0.75, 3), (0.999, 3), (1.0, 3)],
)
def test_an_output_picks_from_four(output, expected):
    assert servo.pick(servo.PHASES, np.array(output)) == servo.PHASES[expected]


@examples(100)
@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=10), st.integers(1, 7))
def test_pick_is_the_published_formula(outputs, n):
    options = np.arange(n) * 10.0
    got = servo.pick(options, np.array(outputs))
    assert got.tolist() == [10.0 * min(math.floor(x * n), n - 1) for x in outputs]


@pytest.mark.parametrize(
    ("frequency", "phase", "time", "degrees"),
    [
        (0.25, 0.0, 0.0, 90.0),
        (0.25, 0.0, 1.0, 180.0),
        (0.25, 0.0, 3.0, 0.0),
        (0.5, 0.0, 0.5, 180.0),
        (0.5, 0.0, 1.0, 90.0),
        (0.5, math.pi / 2, 0.0, 180.0),
        (0.25, math.pi, 1.0, 0.0),
        (0.5, 0.0, 1 / 6, 135.0),
    ],
)
def test_hand_computed_commands(frequency, phase, time, degrees):
    got = servo.command_angle(np.array([frequency]), np.array([phase]), time)
    assert got[0] == pytest.approx(degrees, abs=1e-9)


@examples(100)
@given(st.sampled_from([0.25, 0.5]), st.floats(0, 7), st.floats(0, 43))
def test_commands_stay_in_range_and_repeat(frequency, phase, time):
    f, p = np.array([frequency]), np.array([phase])
    got = servo.command_angle(f, p, time)[0]
    assert 0.0 <= got <= 180.0
    assert servo.command_angle(f, p, time + 1 / frequency)[0] == pytest.approx(got, abs=1e-9)


def test_target_lengths_are_the_published_actuators():
    for command, lengths in reference.load(reference.STATIC)["servo_target_lengths_cm"].items():
        got = 100 * servo.target_lengths(np.array(float(command)))
        np.testing.assert_allclose(got, lengths, atol=1e-4)


def test_the_table_has_a_row_for_every_degree():
    assert servo.TARGET_LENGTHS.shape == (181, 5)
    for command in range(181):
        got = servo.target_lengths(np.array(float(command)))
        np.testing.assert_allclose(got, servo.TARGET_LENGTHS[command], rtol=1e-15)


@examples(100)
@given(st.integers(0, 179), st.floats(0.0, 1.0))
def test_lengths_between_two_degrees_are_interpolated(below, part):
    a, b = servo.TARGET_LENGTHS[below], servo.TARGET_LENGTHS[below + 1]
    got = servo.target_lengths(np.array(below + part))
    np.testing.assert_allclose(got, a + part * (b - a), atol=1e-12)


def test_commands_beyond_the_ends_are_the_ends():
    got = servo.target_lengths(np.array([-20.0, 200.0]))
    assert got.tolist() == servo.TARGET_LENGTHS[[0, 180]].tolist()


def test_any_shape_of_commands():
    commands = np.linspace(0.0, 180.0, 24).reshape(2, 3, 4)
    got = servo.target_lengths(commands)
    assert got.shape == (2, 3, 4, 5)
    assert got[1, 2, 0].tolist() == servo.target_lengths(commands[1, 2, 0]).tolist()
