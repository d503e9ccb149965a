"""Whole numbers that change little from frame to frame, as few bytes; ``replay_view.js`` unpacks them.

Deflate alone sees bytes, not motion. So every column is written as what a guess from other columns leaves:
what a rod's end does in a frame follows mostly from what its other end and its neighbours do. The guesses are
whole-number arithmetic, so that Python and a browser make the same ones, and nothing is lost.

The bytes are: for every column ``TAPS`` distances back to the columns that it is guessed from (0 for none),
for every column as many weights (int8, in units of 1 / ``UNIT``), then the low bytes of all rests, column by
column and in each trial by trial, and the high bytes. A rest is zigzag-coded: 0, -1, 1, -2 is 0, 1, 2, 3.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import Final

import numpy as np

TAPS: Final = 8
"""Columns that a column is guessed from; with four there would be 6 % more bytes."""
REACH: Final = 120
"""How many columns back these lie at most: a module has 39 coordinates, and its neighbour moves with it."""
UNIT: Final = 64
"""Parts that a weight of 1 has."""
_DEFLATE: Final = (9, zlib.DEFLATED, zlib.MAX_WBITS, 6, zlib.Z_FILTERED)
"""Small blocks, because columns differ, and few matches: a tenth fewer bytes than zlib's usual choices."""


def packed(trials: Sequence[np.ndarray]) -> bytes:
    """Return the compressed columns of trials that resemble each other: one robot's towards several targets.

    Args:
        trials: (frames, columns) int16 each; every one has the same columns.
    """
    steps = [_steps(values) for values in trials]
    back, weights = _taps(np.concatenate(steps))
    rests = [(own - _guess(own, back, weights)).astype(np.int16) for own in steps]
    columns = np.concatenate(rests).astype(np.int32).T
    folded = ((columns << 1) ^ (columns >> 31)).astype(np.uint16)
    low, high = (folded & 0xFF).astype(np.uint8), (folded >> 8).astype(np.uint8)
    deflate = zlib.compressobj(*_DEFLATE)
    content = [part.tobytes() for part in (back, weights, low, high)]
    return b"".join([*map(deflate.compress, content), deflate.flush()])


def _steps(values: np.ndarray) -> np.ndarray:
    """Return the (frames, columns) differences in time modulo 2 ** 16 as int64; the first are from 0."""
    first = np.zeros((1, values.shape[1]), dtype=np.uint16)
    return np.diff(values.astype(np.uint16), axis=0, prepend=first).astype(np.int16).astype(np.int64)


def _guess(steps: np.ndarray, back: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the (frames, columns) guesses of steps from the same steps of other columns."""
    columns = np.arange(steps.shape[1])
    total = np.full(steps.shape, UNIT // 2, dtype=np.int64)
    for tap in range(TAPS):
        total += weights[:, tap].astype(np.int64) * steps[:, columns - back[:, tap]]
    return total // UNIT


def _taps(steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (columns, ``TAPS``) distances back and weights that leave little, found one after the other."""
    n = steps.shape[1]
    back, weights = np.zeros((n, TAPS), dtype=np.uint8), np.zeros((n, TAPS), dtype=np.int8)
    products = steps.T.astype(float) @ steps
    # columns that are nearly one and the same would get huge weights of either sign
    products += 1e-3 * np.diag(np.diag(products)) + np.eye(n)
    for c in range(1, n):
        first = max(c - REACH, 0)
        own, wanted = products[first:c, first:c], products[first:c, c]
        sizes, rest = np.diag(own), wanted
        chosen: list[int] = []
        found = np.zeros(0)
        for _ in range(min(TAPS, c)):
            gains = rest**2 / sizes
            gains[chosen] = -1.0
            chosen.append(int(gains.argmax()))
            found = np.linalg.solve(own[np.ix_(chosen, chosen)], wanted[chosen])
            rest = wanted - own[:, chosen] @ found
        back[c, : len(chosen)] = c - first - np.array(chosen)
        weights[c, : len(chosen)] = np.clip(np.round(UNIT * found), -127, 127)
    return back, weights
