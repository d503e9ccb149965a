"""Commands on lanes are those of engine.body.servo."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from engine.body import servo
from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.loop import servos
from tests.support.made_up import examples


@njit
def _command(model, values, time, commanded):
    servos.choose(model, values, 0)
    servos.turn(model, time)
    servos.command(model, commanded)


def commanded(outputs, time, pairs, width):
    """Return (samples, modules, 5) lengths for (samples, 2 x modules) outputs."""
    model = servos.make_servos(pairs, width=width)
    values = simd.reals(outputs.shape[1], width=width)
    lengths = simd.reals(5 * len(pairs), width=width)
    found = []
    for k in range(0, len(outputs), width):
        simd.by_lane(values)[:] = outputs[k : k + width].T
        _command(model, values, time, lengths)
        found.append(simd.by_lane(lengths).T.reshape(width, len(pairs), 5).copy())
    return np.concatenate(found)


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
