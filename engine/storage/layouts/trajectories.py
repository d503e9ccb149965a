"""Trajectories as bytes: whole numbers of a step where all positions are such, else the floats' bits.

What is stored are differences, from one second to the next and then from one target to the next, in Rice's
code (R. F. Rice, Some practical universal noiseless coding techniques, JPL 79-22, 1979): with a parameter k,
a number's lowest k bits, and the others as that many zeros and a one. The layout is in ``docs/run-file.md``.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.errors import InvalidData
from engine.storage.layouts.numbers import Bytes, varint

MAX_EXPONENT: Final = 30
"""Of the finest step in which positions are counted, 2 ** -30 m."""
_FLOATS: Final = 255
"""In place of the exponent: the numbers are the floats' bits."""
_MAX_K: Final = 40
_FINE: Final = 2**31
"""Largest whole number of steps."""


def encode(trajectory: np.ndarray) -> bytes:
    """Return a trajectory as bytes; no bytes if it has no second.

    Args:
        trajectory: (targets, seconds, 2) float32.
    """
    n_seconds = trajectory.shape[1]
    if not n_seconds:
        return b""
    exponent, numbers = _whole_numbers(np.ascontiguousarray(trajectory, dtype="<f4"))
    differences = np.diff(numbers, axis=1, prepend=0)
    candidates = [differences, np.diff(differences, axis=0, prepend=0)]
    coded = [_rice(_zigzag(c.transpose(0, 2, 1).reshape(-1, n_seconds))) for c in candidates]
    best = min(range(len(coded)), key=lambda i: len(coded[i]))
    return varint(n_seconds) + bytes((exponent, best)) + coded[best]


def decode(content: bytes, n_targets: int) -> np.ndarray:
    """Return what ``encode`` made bytes of, (targets, seconds, 2) float32.

    Raises:
        InvalidData: the bytes are not from ``encode``.
    """
    if not content:
        return np.zeros((n_targets, 0, 2), dtype="<f4")
    source = Bytes(content)
    n_seconds = source.varint()
    exponent, by_target = source.take(2)
    # a number takes at least one bit
    if not 0 < 2 * n_targets * n_seconds <= 8 * len(content) or by_target > 1:
        raise InvalidData("a trajectory has an impossible size")
    if exponent > MAX_EXPONENT and exponent != _FLOATS:
        raise InvalidData("a trajectory is counted in an unknown step")
    unsigned = _unrice(source, 2 * n_targets, n_seconds).astype(np.int64)
    signed = np.where(unsigned & 1, -((unsigned + 1) >> 1), unsigned >> 1)
    differences = signed.reshape(n_targets, 2, n_seconds).transpose(0, 2, 1)
    if by_target:
        differences = np.cumsum(differences, axis=0)
    numbers = np.cumsum(differences, axis=1)
    if exponent == _FLOATS:
        if numbers.size and not -_FINE <= numbers.min() <= numbers.max() < _FINE:
            raise InvalidData("a trajectory holds no floats")
        return _exchange(numbers.astype("<i4")).view("<f4")
    return np.ldexp(numbers, -exponent).astype("<f4")


def _whole_numbers(values: np.ndarray) -> tuple[int, np.ndarray]:
    """Return the exponent of the coarsest step that all values are whole numbers of, and the numbers."""
    wide = values.astype("<f8")
    if np.isfinite(wide).all() and np.abs(wide).max() * 2.0**MAX_EXPONENT < 2.0**52:
        finest = np.ldexp(wide, MAX_EXPONENT)
        numbers = finest.astype(np.int64)
        # bits are compared: 0.0 equals -0.0, which no whole number is
        same = np.ldexp(numbers, -MAX_EXPONENT).astype("<f4").view("<u4") == values.view("<u4")
        if same.all() and np.abs(numbers).max() < _FINE << 8:
            used = int(np.bitwise_or.reduce(numbers, axis=None))
            spare = min(MAX_EXPONENT, (used & -used).bit_length() - 1) if used else MAX_EXPONENT
            return MAX_EXPONENT - spare, numbers >> spare
    return _FLOATS, _exchange(values.view("<i4")).astype(np.int64)


def _exchange(bits: np.ndarray) -> np.ndarray:
    """Exchange the bits of floats and whole numbers in the same order: neighbours become neighbours."""
    return np.where(bits < 0, bits ^ np.int32(0x7FFFFFFF), bits).astype("<i4")


def _zigzag(values: np.ndarray) -> np.ndarray:
    return np.where(values < 0, -2 * values - 1, 2 * values)


def _rice(rows: np.ndarray) -> bytes:
    """Return rows of whole numbers from 0 in Rice's code: each row's k, its low bits, then all high parts."""
    ks = np.arange(_MAX_K + 1)
    sizes = (rows[:, :, None] >> ks).sum(axis=1) + ks * rows.shape[1]
    best = sizes.argmin(axis=1)
    low = [
        np.unpackbits(_low_bytes(row), axis=1, bitorder="little")[:, :k]
        for row, k in zip(rows, best, strict=True)
    ]
    high = rows >> best[:, None]
    ends = np.cumsum(high.ravel() + 1) - 1
    ones = np.zeros(int(ends[-1]) + 1, dtype=np.uint8)
    ones[ends] = 1
    bits = np.concatenate([*(part.ravel() for part in low), ones])
    return best.astype(np.uint8).tobytes() + np.packbits(bits, bitorder="little").tobytes()


def _low_bytes(row: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(row, dtype="<u8").view(np.uint8).reshape(-1, 8)


def _unrice(source: Bytes, n_rows: int, n_columns: int) -> np.ndarray:
    ks = np.frombuffer(source.take(n_rows), np.uint8)
    if ks.max() > _MAX_K:
        raise InvalidData("a trajectory is coded in an unknown way")
    bits = np.unpackbits(np.frombuffer(source.rest(), np.uint8), bitorder="little")
    n_low = int(ks.sum(dtype=np.int64)) * n_columns
    ends = np.flatnonzero(bits[n_low:])
    if len(ends) != n_rows * n_columns or len(bits) - n_low - ends[-1] > 8:
        raise InvalidData("a trajectory is cut short or too long")
    high = np.diff(ends, prepend=-1) - 1
    rows = high.reshape(n_rows, n_columns).astype(np.uint64)
    at = 0
    for row, k in zip(rows, ks.tolist(), strict=True):
        low = np.zeros((n_columns, 64), dtype=np.uint8)
        low[:, :k] = bits[at : at + k * n_columns].reshape(n_columns, k)
        row <<= np.uint64(k)
        row |= np.packbits(low, axis=1, bitorder="little").view("<u8")[:, 0]
        at += k * n_columns
    return rows
