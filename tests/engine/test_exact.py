"""Numbers that are the same on every machine: right to the bit, or within the bound that they promise."""

from __future__ import annotations

import decimal
import hashlib
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

from engine.body.morphology import Morphology
from engine.exact import bearing, cosine_and_sine, exponential, length, logarithm
from engine.simulation.kernel.guard import read_robot
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics
from engine.tasks import GOAL_REACHING, SQUEEZING, target_offsets, worlds
from tests.support.made_up import examples

angles = st.floats(-1e9, 1e9)


@examples(200)
@given(st.floats(-700.0, 700.0))
def test_exponentials_are_the_nearest_doubles(x):
    with decimal.localcontext(prec=60):
        assert exponential(x) == float(decimal.Decimal(x).exp())


@examples(200)
@given(angles)
def test_cosine_and_sine_are_the_nearest_doubles(angle):
    """Of a library's, which is off by less than one place, in both places."""
    for found, expected in zip(cosine_and_sine(angle), (math.cos(angle), math.sin(angle)), strict=True):
        assert abs(found - expected) <= math.ulp(expected)


@pytest.mark.parametrize(
    ("angle", "cosine", "sine"),
    [
        (0.0, 1.0, 0.0),
        (1e-300, 1.0, 1e-300),
        # pi as a double lies below pi by what its sine is
        (math.pi, -1.0, 1.2246467991473532e-16),
        (math.pi / 2.0, 6.123233995736766e-17, 1.0),
        # the double that is closest to a multiple of half of pi (Kahan)
        (6381956970095103.0 * 2.0**797, -4.687165924254628e-19, 1.0),
        (1e22, 0.523214785395139, -0.8522008497671888),
    ],
)
def test_cosines_and_sines_that_are_hard(angle, cosine, sine):
    assert cosine_and_sine(angle) == (cosine, sine)


@examples(200)
@given(st.floats(min_value=0.0, exclude_min=True, allow_infinity=False))
def test_logarithms_are_the_nearest_doubles(x):
    assert abs(logarithm(x) - math.log(x)) <= math.ulp(math.log(x))


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        (1.0, 0.0),
        (2.0, 0.6931471805599453),
        (math.e, 1.0),
        (1.0 + 2.0**-52, 2.0**-52 - 2.0**-105),
        (1.0 - 2.0**-53, -(2.0**-53)),
    ],
)
def test_logarithms_that_are_hard(x, expected):
    assert logarithm(x) == expected


def test_lengths_are_roots_of_sums_of_squares():
    assert length(np.array([3.0, 4.0])) == 5.0
    vectors = np.random.default_rng(1).normal(size=(4, 5, 3))
    np.testing.assert_allclose(length(vectors), np.linalg.norm(vectors, axis=-1), rtol=1e-15)


def test_bearings_are_within_two_places():
    left, ahead = np.random.default_rng(2).normal(size=(2, 100_000))
    exact = np.arctan2(left.astype(np.longdouble), ahead.astype(np.longdouble))
    assert (np.abs(bearing(left, ahead) - exact) <= 2.0 * np.spacing(np.abs(exact).astype(float))).all()


def test_bearings_along_the_axes():
    left, ahead = np.array([0.0, -0.0, 0.0, -0.0, 2.0, -2.0, 0.0]), np.array([1.0, 1.0, -1.0, -1.0, 0, 0, 0])
    expected = [0.0, 0.0, np.pi, np.pi, np.pi / 2, -np.pi / 2, 0.0]
    np.testing.assert_array_equal(bearing(left, ahead), expected)


def test_no_instruction_set_changes_a_robots_numbers():
    """NumPy and its libraries choose their code by the processor; what they do differently does not count."""
    code = "from tests.engine.test_exact import digest; print(digest())"
    plain = {"NPY_DISABLE_CPU_FEATURES": _dispatched(), "OPENBLAS_CORETYPE": "Prescott"}
    there = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | plain, capture_output=True, text=True, check=True
    )
    assert there.stdout.split() == [digest()]


def _dispatched() -> str:
    """Return the instruction sets that NumPy chooses by, as it wants them named."""
    return " ".join(name for name in __cpu_dispatch__ if __cpu_features__[name])


def digest() -> str:
    """Return a digest of all that the kernel is given of a robot and of the built-in tasks' worlds."""
    found = hashlib.sha256()
    for faces in ((1, 2, 3, 4, 5, 6, 7, 8), (8, 8, 3, 1, 6, 2, 5, 7)):
        robot = build_robot(Morphology(3, faces), Physics())
        for value in (*read_robot(robot), robot.model.qpos0):
            found.update(np.asarray(value).tobytes())
    for task in (GOAL_REACHING, SQUEEZING):
        found.update(target_offsets(task).tobytes())
        found.update(target_offsets(task, np.linspace(-3.0, 3.0, 300)).tobytes())
        found.update(repr(worlds(task, 5)).encode())
    left, ahead = np.random.default_rng(3).normal(size=(2, 1000))
    found.update(bearing(left, ahead).tobytes())
    return found.hexdigest()
