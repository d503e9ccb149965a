"""Vectors of lanes: operations are those of NumPy, whatever the width."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from engine.simulation.kernel.lanes import simd


@njit
def _operations(x, out, whole, whole_out):
    a, b = simd.load(x, 0), simd.load(x, 1)
    simd.store(out, 0, a + b)
    simd.store(out, 1, a - 2.0 * b)
    simd.store(out, 2, a / b)
    simd.store(out, 3, -a * b)
    simd.store(out, 4, simd.select(a > b, a, 0.5))
    simd.store(out, 5, simd.square_root(simd.absolute(a)))
    simd.store(out, 6, simd.nearest(a))
    simd.store(out, 7, simd.floor(a))
    simd.store(out, 8, simd.maximum(a, 0.0) + simd.minimum(a, b))
    simd.store(out, 9, simd.from_bits(simd.to_bits(a) ^ (1 << 52)))
    simd.store(out, 10, simd.select((a > 0.0) & ~(b > 0.0) | (a == b), 1.0, 2.0))
    simd.store(out, 11, 3)
    i, j = simd.load(whole, 0), simd.load(whole, 1)
    simd.store(whole_out, 0, i + j)
    simd.store(whole_out, 1, (i >> 3) ^ (j << 5))
    simd.store(whole_out, 2, simd.multiply_32(i, j))
    simd.store(whole_out, 3, simd.multiply_32(i, 0xD2511F53))
    simd.store(whole_out, 4, simd.mask_to_integer(i < j))
    simd.store(whole_out, 5, simd.to_integer(a))
    return simd.any_lane(a > 1e9), simd.all_lanes(a < 1e9)


@pytest.mark.parametrize("width", simd.WIDTHS)
def test_operations_are_numpys(width):
    rng = np.random.default_rng(3)
    x, out = simd.reals(2, width=width), simd.reals(12, width=width)
    whole, whole_out = simd.integers(2, width=width), simd.integers(6, width=width)
    a, b = simd.by_lane(x)[:] = rng.normal(size=(2, width)) * 20.0
    i, j = simd.by_lane(whole)[:] = rng.integers(-(2**63), 2**63, (2, width))
    any_big, all_small = _operations(x, out, whole, whole_out)
    expected = [
        a + b,
        a - 2.0 * b,
        a / b,
        -a * b,
        np.where(a > b, a, 0.5),
        np.sqrt(np.abs(a)),
        np.round(a),
        np.floor(a),
        np.maximum(a, 0.0) + np.minimum(a, b),
        (a.view(np.int64) ^ (1 << 52)).view(np.float64),
        np.where((a > 0.0) & ~(b > 0.0), 1.0, 2.0),
        np.full(width, 3.0),
    ]
    np.testing.assert_array_equal(simd.by_lane(out), expected)
    low = np.uint64(0xFFFFFFFF)
    u, v = i.view(np.uint64), j.view(np.uint64)
    expected_whole = [
        u + v,
        (u >> np.uint64(3)) ^ (v << np.uint64(5)),
        (u & low) * (v & low),
        (u & low) * np.uint64(0xD2511F53),
        (i < j).astype(np.uint64),
        a.astype(np.int64).view(np.uint64),
    ]
    np.testing.assert_array_equal(simd.by_lane(whole_out).view(np.uint64), expected_whole)
    assert not any_big
    assert all_small


@njit
def _lanes(x, lane):
    simd.store_lane(x, 1, lane, 7.0)
    return (
        simd.load_lane(x, 0, lane),
        simd.any_lane(simd.load(x, 1) == 7.0),
        simd.all_lanes(simd.load(x, 1) == 7.0),
    )


@pytest.mark.parametrize("width", simd.WIDTHS)
def test_one_lane_is_read_and_written_alone(width):
    x = simd.reals(2, width=width)
    simd.by_lane(x)[0] = np.arange(width)
    last = width - 1
    assert _lanes(x, last) == (last, True, width == 1)
    assert simd.by_lane(x)[1].tolist() == [0.0] * last + [7.0]


def test_vectors_do_not_straddle_cache_lines():
    for width in simd.WIDTHS:
        assert simd.reals(3, width=width).ctypes.data % simd.ALIGNMENT == 0
