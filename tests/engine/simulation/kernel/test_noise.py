"""Noise keyed by what it is for: the published generator, a Gaussian, and independent of everything else."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from scipy import stats

from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.loop import noise
from engine.simulation.trials import fresh_number
from tests.support.made_up import examples

whole = st.integers(0, 2**80)


@njit
def _philox(words, out):
    counter = simd.load(words, 0), simd.load(words, 1), simd.load(words, 2), simd.load(words, 3)
    a, b, c, d = noise.philox(*counter, simd.load(words, 4), simd.load(words, 5))
    simd.store(out, 0, a)
    simd.store(out, 1, b)
    simd.store(out, 2, c)
    simd.store(out, 3, d)


KNOWN = (
    ("00000000 00000000 00000000 00000000 00000000 00000000", "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ("ffffffff ffffffff ffffffff ffffffff ffffffff ffffffff", "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    ("243f6a88 85a308d3 13198a2e 03707344 a4093822 299f31d0", "d16cfe09 94fdcceb 5001e420 24126ea1"),
)
"""Counter and key, and the output that the authors of the generator publish (Random123, kat_vectors)."""


@pytest.mark.parametrize("width", simd.WIDTHS)
def test_philox_gives_the_published_words(width):
    for lane in range(width):
        words, out = simd.integers(6, width=width), simd.integers(4, width=width)
        simd.by_lane(words)[:] = np.arange(6 * width).reshape(6, width)
        for given_words, expected in KNOWN:
            simd.by_lane(words)[:, lane] = [int(w, 16) for w in given_words.split()]
            _philox(words, out)
            assert [f"{w:08x}" for w in simd.by_lane(out)[:, lane]] == expected.split()


@njit
def _gaussians(streams, update, draws):
    noise.gaussians(streams, update, draws)


def drawn(trials, update, n, width=None):
    """Return (n, trials) draws."""
    width = width or len(trials)
    draws = []
    for k in range(0, len(trials), width):
        numbers = simd.reals(n, width=width)
        _gaussians(noise.streams(trials[k : k + width], width=width), update, numbers)
        draws.append(simd.by_lane(numbers).copy())
    return np.concatenate(draws, axis=1)


TRIALS = [(7, number, target, repeat) for number in (0, 3) for target in (0, 1) for repeat in (0, 1)]


@pytest.mark.parametrize("width", [1, 2, 4])
def test_draws_depend_on_neither_width_nor_neighbours(width):
    assert drawn(TRIALS, 5, 50).tobytes() == drawn(TRIALS, 5, 50, width).tobytes()
    assert drawn(TRIALS[::-1], 5, 50)[:, ::-1].tobytes() == drawn(TRIALS, 5, 50).tobytes()


@pytest.mark.parametrize("n", [1, 10, 15, 49])
def test_a_draw_is_the_same_however_many_follow(n):
    assert drawn(TRIALS, 2, n).tobytes() == drawn(TRIALS, 2, 50)[:n].tobytes()


def test_draws_are_box_and_mullers():
    """Formulated again with NumPy from the published generator's words."""
    words, out = simd.integers(6, width=1), simd.integers(4, width=1)
    c2, c3 = noise.stream_words(7, 3, 1, 0)[2:]
    key = noise.stream_words(7, 3, 1, 0)[:2]
    found = drawn([(7, 3, 1, 0)], 123, 50)[:, 0]
    for pair in range(25):
        simd.by_lane(words)[:, 0] = [pair, 123, c2, c3, *key]
        _philox(words, out)
        w = [int(v) for v in simd.by_lane(out)[:, 0]]
        u, v = ((w[0] << 20) ^ (w[1] >> 12)) / 2.0**52, ((w[2] << 20) ^ (w[3] >> 12)) / 2.0**52
        radius = np.sqrt(-2.0 * np.log(1.0 - u))
        expected = radius * np.cos(2.0 * np.pi * v), radius * np.sin(2.0 * np.pi * v)
        np.testing.assert_allclose(found[2 * pair : 2 * pair + 2], expected, rtol=1e-14, atol=1e-14)


@examples(100)
@given(st.tuples(whole, whole, st.integers(0, 19), st.integers(0, 99)), st.data())
def test_what_a_draw_is_for_decides_it(trial, data):
    """Changing any part of it gives other draws."""
    part = data.draw(st.integers(0, 3))
    other = list(trial)
    other[part] = data.draw(whole.filter(lambda v: v != trial[part]))
    assert noise.stream_words(*trial) != noise.stream_words(*other)
    assert not np.any(drawn([trial], 0, 10) == drawn([tuple(other)], 0, 10))


def test_parts_do_not_run_into_each_other():
    """1, 23 is not 12, 3; and a fresh sample of one evaluation is no other evaluation."""
    trials = [(1, 23, 0, 0), (12, 3, 0, 0), (1, 2, 30, 0), (1, 230, 0, 0)]
    trials += [(1, fresh_number(number, sample), 0, 0) for number in range(5, 50) for sample in range(1, 50)]
    assert len({tuple(noise.stream_words(*t)) for t in trials}) == len(trials)


def test_words_stay_what_they_are():
    """Runs of before are repeated only as long as these do not change."""
    assert noise.stream_words(0, 0, 0, 0) == [3554890862, 1858792055, 2767107751, 987881268]
    assert noise.stream_words(2**63, 2**40 + 5, 3, 1) == [2754330865, 1120496473, 3103489706, 610159166]


@pytest.fixture(scope="module")
def sample():
    """Return (updates, 50, 8) draws."""
    return np.stack([drawn(TRIALS, update, 50) for update in range(2500)])


def test_draws_are_gaussian(sample):
    flat = sample.ravel()
    n = flat.size
    # four and a half standard errors of the first four moments of a Gaussian
    for power, moment, variance in ((1, 0, 1), (2, 1, 2), (3, 0, 15), (4, 3, 96)):
        assert abs(np.mean(flat**power) - moment) < 4.5 * np.sqrt(variance / n)
    assert stats.kstest(flat, "norm").pvalue > 1e-4
    assert 4.3 < np.abs(flat).max() < 6.5


def test_every_cable_and_trial_is_gaussian(sample):
    worst = min(stats.kstest(sample[:, i, lane], "norm").pvalue for i in range(50) for lane in range(8))
    assert worst > 1e-6


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (np.s_[:, 0::2], np.s_[:, 1::2]),
        (np.s_[:, :-1], np.s_[:, 1:]),
        (np.s_[:-1], np.s_[1:]),
        (np.s_[..., :-1], np.s_[..., 1:]),
        (np.s_[:-2, :-1], np.s_[2:, 1:]),
    ],
    ids=["pair", "cables", "updates", "trials", "both"],
)
def test_neighbours_are_independent(sample, one, other):
    a, b = sample[one].ravel(), sample[other].ravel()
    n = a.size
    for f in (np.asarray, np.abs, np.square):
        assert abs(np.corrcoef(f(a), f(b))[0, 1]) < 4.5 / np.sqrt(n)
    quadrants = np.bincount(2 * (a > 0.0) + (b > 0.0), minlength=4)
    assert stats.chisquare(quadrants).pvalue > 1e-4
