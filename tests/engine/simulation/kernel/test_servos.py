"""Commands on lanes are those of engine.body.servo."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from engine.body import servo
from engine.simulation.built import Built
from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.loop import network, servos
from tests.support.made_up import examples

PERIOD = 0.02


@njit
def _command(model, networks, values, time, commanded):
    servos.choose(model, networks, values)
    servos.turn(model, time)
    servos.command(model, commanded)


def commanded(outputs, time, pairs, width):
    """Return (samples, modules, 5) lengths for (samples, 2 x modules) outputs."""
    n = len(pairs)
    model = servos.make_servos([pairs], Built(), PERIOD, n_modules=n, width=width)
    networks = driving(np.full((1, width), True), 2 * n)
    values, lengths = simd.reals(2 * n, width=width), simd.reals(5 * n, width=width)
    found = []
    for k in range(0, len(outputs), width):
        simd.by_lane(values)[:] = outputs[k : k + width].T
        _command(model, networks, values, time, lengths)
        found.append(simd.by_lane(lengths).T.reshape(width, n, 5).copy())
    return np.concatenate(found)


def driving(lanes, n_outputs):
    """Return networks of outputs alone, and which (networks, lanes) they drive."""
    networks = network.no_networks(lanes.shape[1])
    driven = simd.integers(len(lanes), width=lanes.shape[1])
    simd.by_lane(driven)[:] = lanes
    return networks._replace(end=n_outputs * np.arange(1, len(lanes) + 1), lanes=driven)


def expected(outputs, time, pairs):
    frequency = servo.pick(servo.FREQUENCIES, outputs[:, 0::2])
    phase = servo.pick(servo.PHASES, outputs[:, 1::2])
    return servo.target_lengths(servo.command_angle(frequency, phase, time)[:, pairs])


@examples(200)
@given(
    st.integers(0, 150_000),
    st.lists(st.floats(0.0, 1.0), min_size=48, max_size=48),
    st.permutations(range(3)),
)
def test_commands_are_engine_servos(update, outputs, pairs):
    outputs = np.array(outputs).reshape(8, 6)
    time = 0.02 * update
    found = commanded(outputs, time, pairs, 8)
    np.testing.assert_allclose(found, expected(outputs, time, pairs), rtol=0.0, atol=1e-14)
    for width in (4, 2, 1):
        assert commanded(outputs, time, pairs, width).tobytes() == found.tobytes()


def test_every_lane_is_driven_by_its_own_network():
    outputs = np.random.default_rng(1).uniform(size=(8, 2, 6))
    pairs, first = [(0, 1, 2), (2, 1, 0)], np.arange(8) % 3 == 0
    model = servos.make_servos(pairs, Built(), PERIOD, n_modules=3, width=8)
    values, lengths = simd.reals(12, width=8), simd.reals(15, width=8)
    simd.by_lane(values)[:] = outputs.reshape(8, 12).T
    _command(model, driving(np.array([first, ~first]), 6), values, 0.4, lengths)
    alone = [commanded(outputs[:, k], 0.4, pairs[k], 8) for k in range(2)]
    found = simd.by_lane(lengths).T.reshape(8, 3, 5)
    np.testing.assert_array_equal(found, np.where(first[:, None, None], *alone))


def test_every_frequency_and_phase_can_be_chosen():
    steps = np.array([0.0, 0.125, 0.25, 0.374, 0.5, 0.749, 0.75, 1.0])
    for other in (0.0, 0.49, 0.5, 1.0):
        outputs = np.column_stack([np.full(8, other), steps, steps, np.full(8, other)])
        for time in (0.0, 0.3, 1.7, 40.0):
            found = commanded(outputs, time, [0, 1], 8)
            np.testing.assert_allclose(found, expected(outputs, time, [0, 1]), atol=1e-14)


def test_what_is_no_number_chooses_the_first():
    outputs = np.full((8, 2), math.nan)
    found = commanded(outputs, 0.4, [0], 8)
    assert found.tobytes() == commanded(np.zeros((8, 2)), 0.4, [0], 8).tobytes()


@pytest.mark.parametrize("time", [0.5, 1.5, 2.5, 1.0, 3.0])
def test_commands_at_the_ends_of_the_table(time):
    """Contracted and released: the sine is 1, -1, or just beside."""
    outputs = np.tile([1.0, 0.0], (8, 1))
    found = commanded(outputs, time, [0], 8)
    assert found.min() >= servo.TARGET_LENGTHS.min()
    np.testing.assert_allclose(found, expected(outputs, time, [0]), atol=1e-14)
