"""Own elementary functions: within the stated bound of the exact value, and the same bits in every lane."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.lanes import transcendental as tr
from tests.support.made_up import examples

EXACT = np.longdouble
"""Numbers with at least 11 bits more than a double's."""
pytestmark = pytest.mark.skipif(
    np.finfo(np.longdouble).nmant < 63, reason="nothing here is more precise than a double"
)
RNG = np.random.default_rng(16)
N = 400_000


@njit(error_model="numpy")
def _exponentials(x, out):
    for i in range(len(x)):
        simd.store(out, i, tr.exponential(simd.load(x, i)))


@njit(error_model="numpy")
def _logarithms(x, out):
    for i in range(len(x)):
        simd.store(out, i, tr.logarithm(simd.load(x, i)))


@njit(error_model="numpy")
def _sines_and_cosines(x, sines, cosines):
    for i in range(len(x)):
        sine, cosine = tr.sine_and_cosine(simd.load(x, i))
        simd.store(sines, i, sine)
        simd.store(cosines, i, cosine)


@njit(error_model="numpy")
def _angles(y, x, out):
    for i in range(len(x)):
        simd.store(out, i, tr.angle(simd.load(y, i), simd.load(x, i)))


def lanes(values, width=8):
    values = np.asarray(values, dtype=float)
    vectors = simd.reals(-(-values.size // width), width=width)
    flat = simd.by_lane(vectors).ravel()
    flat[:] = values[-1]
    flat[: values.size] = values
    return vectors


def evaluated(function, *arguments, width=8, n_results=1):
    n = len(arguments[0])
    inputs = [lanes(a, width) for a in arguments]
    results = [simd.reals(len(inputs[0]), width=width) for _ in range(n_results)]
    function(*inputs, *results)
    numbers = [simd.by_lane(r).ravel()[:n].copy() for r in results]
    return numbers if n_results > 1 else numbers[0]


def ulps(got, exact):
    """Return the largest distance from exact values, in ulp of each."""
    unit = np.spacing(np.abs(exact.astype(float)))
    return float(np.max(np.abs((got.astype(EXACT) - exact) / unit)))


def grid(low, high):
    """Return numbers that are even and ones that are random, ends included."""
    return np.concatenate([np.linspace(low, high, N // 2), RNG.uniform(low, high, N // 2)])


@pytest.mark.parametrize("limit", [1e-9, 0.36, 2.0, 61.0, tr.EXPONENTIAL_LIMIT])
def test_exponential(limit):
    x = grid(-limit, limit)
    assert ulps(evaluated(_exponentials, x), np.exp(x.astype(EXACT))) < 1.0


def test_exponential_of_round_numbers():
    x = np.array([0.0, -0.0, 1.0, -1.0, 60.0, -60.0])
    assert evaluated(_exponentials, x)[:2].tolist() == [1.0, 1.0]
    np.testing.assert_allclose(evaluated(_exponentials, x), [math.exp(v) for v in x], rtol=2.3e-16)


def fractions():
    """Return what the noise takes the logarithm of: 1 - k / 2^52."""
    k = np.concatenate([np.arange(1000), 2**52 - 1 - np.arange(1000), RNG.integers(0, 2**52, N)])
    return (2**52 - k) / 2.0**52


@pytest.mark.parametrize(
    "x",
    [
        fractions(),
        grid(0.7, 1.42),
        1.0 + np.ldexp(RNG.uniform(-1.0, 1.0, N), -RNG.integers(1, 52, N)),
        np.exp(grid(-700.0, 700.0)),
        np.ldexp(math.sqrt(0.5) + np.arange(-40, 41) * 2.0**-53, 7),
        np.array([np.finfo(float).tiny, np.finfo(float).max]),
    ],
    ids=["noise", "one-octave", "near-one", "all-sizes", "octaves-end", "extremes"],
)
def test_logarithm(x):
    exact = np.log(x.astype(EXACT))
    x, exact = x[exact != 0.0], exact[exact != 0.0]
    assert ulps(evaluated(_logarithms, x), exact) < 1.0


def test_logarithm_of_one_is_zero():
    assert evaluated(_logarithms, np.ones(1)).tolist() == [0.0]


@pytest.mark.parametrize("limit", [1e-8, 0.79, 7.0, 1e4, tr.SINE_LIMIT])
def test_sine_and_cosine(limit):
    x = grid(-limit, limit)
    sine, cosine = evaluated(_sines_and_cosines, x, n_results=2)
    assert ulps(sine[x != 0.0], np.sin(x[x != 0.0].astype(EXACT))) < 1.0
    assert ulps(cosine, np.cos(x.astype(EXACT))) < 1.0


def test_sine_and_cosine_where_they_vanish():
    """The doubles nearest to multiples of half a turn: what is left of them is their distance from those."""
    k = np.arange(1, 41722)
    half_pi = EXACT(math.pi) / 2 + EXACT(6.123233995736766e-17)
    x = (k * half_pi).astype(float)
    sine, cosine = evaluated(_sines_and_cosines, x, n_results=2)
    # half of pi to 160 bits: the long double's sine is not trusted here
    pi_half_scaled = 0x1921FB54442D18469898CC51701B839A252049C11
    scaled = [round(v * 2**60) * 2**100 - int(m) * pi_half_scaled for v, m in zip(x, k, strict=True)]
    left = np.array([float(v) / 2.0**160 for v in scaled])
    small = np.where(k % 2 == 0, sine, cosine)
    sign = np.where((k % 4 == 0) | (k % 4 == 3), 1.0, -1.0)
    assert np.max(np.abs(small - sign * left) / np.spacing(np.abs(left))) <= 1.0
    assert np.abs(left).min() < 1e-16


@pytest.mark.parametrize("spread", [0.0, 2.0, 30.0])
def test_angle(spread):
    turn = grid(-math.pi, math.pi)
    size = np.exp(RNG.uniform(-spread, spread, N))
    x, y = size * np.cos(turn), np.exp(RNG.uniform(-spread, spread, N)) * np.sin(turn)
    assert ulps(evaluated(_angles, y, x), np.arctan2(y.astype(EXACT), x.astype(EXACT))) < 2.0


@pytest.mark.parametrize("middle", [0.0, 0.25, 0.5, 0.72, 1.0])
def test_angle_where_its_formula_changes(middle):
    across = middle + RNG.uniform(-1e-3, 1e-3, 50_000)
    for y, x in ((across, 1.0), (across, -1.0), (1.0, across), (-1.0, across), (-across, 1.0)):
        y, x = np.broadcast_arrays(y, x)
        assert ulps(evaluated(_angles, y, x), np.arctan2(y.astype(EXACT), x.astype(EXACT))) < 2.0


def test_angle_along_the_axes():
    y = np.array([0.0, 0.0, -0.0, 0.0, -0.0, 1.0, -1.0, 1e-150, 1e150])
    x = np.array([0.0, 1.0, 1.0, -1.0, -1.0, 0.0, 0.0, 1e150, 1e-150])
    half = math.pi / 2
    assert evaluated(_angles, y, x).tolist() == [0.0, 0.0, 0.0, math.pi, math.pi, half, -half, 1e-300, half]


@examples(100)
@given(st.lists(st.floats(-700.0, 700.0), min_size=8, max_size=8), st.sampled_from([1, 2, 4]))
def test_bits_depend_on_neither_width_nor_neighbours(values, width):
    values = np.array(values)
    for function, arguments, n in (
        (_exponentials, [values], 1),
        (_logarithms, [np.abs(values) + 1e-300], 1),
        (_sines_and_cosines, [values], 2),
        (_angles, [values, np.roll(values, 1)], 1),
    ):
        wide = evaluated(function, *arguments, n_results=n)
        narrow = evaluated(function, *arguments, n_results=n, width=width)
        assert np.array(wide).tobytes() == np.array(narrow).tobytes()


@examples(200)
@given(st.floats(-tr.SINE_LIMIT, tr.SINE_LIMIT), st.floats(-60.0, 60.0), st.floats(1e-300, 1e300))
def test_any_number(x, z, w):
    sine, cosine = evaluated(_sines_and_cosines, [x], n_results=2)
    assert sine[0] == pytest.approx(math.sin(x), rel=4.5e-16, abs=5e-324)
    assert cosine[0] == pytest.approx(math.cos(x), rel=4.5e-16)
    assert evaluated(_exponentials, [z])[0] == pytest.approx(math.exp(z), rel=4.5e-16)
    assert evaluated(_logarithms, [w])[0] == pytest.approx(math.log(w), rel=4.5e-16, abs=0.0)
