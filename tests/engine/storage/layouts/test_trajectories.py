"""Trajectories as bytes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from engine.errors import InvalidData
from engine.simulation.trials import rounded
from engine.storage.layouts.trajectories import decode, encode
from tests.support.made_up import examples

SHAPES = st.tuples(st.integers(1, 5), st.integers(0, 12), st.just(2))
ANY_FLOAT = st.floats(width=32)


def survives(trajectory):
    content = encode(trajectory)
    again = decode(content, len(trajectory))
    assert again.dtype == np.float32
    assert again.shape == trajectory.shape
    assert again.tobytes() == trajectory.tobytes()
    return content


def walks(n_targets=4, n_seconds=40, seed=0):
    """Return trajectories as robots have them: some mm a second, much alike for all targets."""
    rng = np.random.default_rng(seed)
    common = rng.normal(0.0, 0.005, (1, n_seconds, 2))
    steps = common + rng.normal(0.0, 0.001, (n_targets, n_seconds, 2))
    return np.cumsum(steps, axis=1)


@examples(60)
@given(SHAPES.flatmap(lambda shape: arrays(np.float32, shape, elements=ANY_FLOAT)))
def test_any_floats_survive_to_the_last_bit(trajectory):
    survives(trajectory)


@examples(40)
@given(st.integers(0, 30), st.integers(0, 99), st.integers(1, 6), st.integers(1, 60))
def test_rounded_positions_survive_whatever_the_step(bits, seed, n_targets, n_seconds):
    survives(rounded(walks(n_targets, n_seconds, seed), bits))


def test_the_sign_of_a_zero_survives():
    survives(np.array([[[0.0, -0.0], [0.5, 0.25]]], np.float32))


def test_rounding_makes_a_trajectory_a_quarter_as_large():
    sizes = {bits: len(survives(rounded(walks(), bits))) for bits in (0, 14, 12)}
    assert 900 < sizes[0] < 1280
    assert sizes[14] < 320
    # each binary digit costs one bit of each number
    assert sizes[14] - sizes[12] == pytest.approx(2 * 320 / 8, abs=12)


def test_a_robot_that_lies_still_costs_next_to_nothing():
    assert len(survives(np.zeros((4, 40, 2), np.float32))) < 60


@examples(200)
@given(st.data())
def test_bytes_that_are_no_trajectory_are_refused_or_are_one(data):
    content = bytearray(encode(rounded(walks(), data.draw(st.sampled_from([0, 14])))))
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    end = data.draw(st.integers(0, len(content)) | st.just(len(content)))
    try:
        found = decode(bytes(content[:end]), 4)
    except InvalidData:
        return
    assert found.shape[::2] == (4, 2)
    assert found.shape[1] <= 8 * len(content)
