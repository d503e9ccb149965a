"""Reads the packed columns of pages as ``replay_view.js`` does, one number after the other."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

import numpy as np

from viz.recording.packing import TAPS, UNIT


def unpack(packed: bytes, frames: Sequence[int], n_columns: int) -> list[np.ndarray]:
    """Return (frames, columns) int16 of every trial."""
    content, whole = zlib.decompress(packed), sum(frames)
    assert len(content) == 2 * n_columns * (TAPS + whole)
    back = np.frombuffer(content[: n_columns * TAPS], np.uint8).reshape(n_columns, TAPS)
    weights = np.frombuffer(content[n_columns * TAPS : 2 * n_columns * TAPS], np.int8)
    weights = weights.reshape(n_columns, TAPS)
    low, high = np.frombuffer(content[2 * n_columns * TAPS :], np.uint8).reshape(2, n_columns, whole)
    steps = np.zeros((n_columns, whole), np.int16)
    for c in range(n_columns):
        guess = np.full(whole, UNIT // 2, np.int64)
        for tap in range(TAPS):
            guess += int(weights[c, tap]) * steps[c - int(back[c, tap])].astype(np.int64)
        folded = low[c].astype(np.int64) + 256 * high[c].astype(np.int64)
        steps[c] = (guess // UNIT + ((folded >> 1) ^ -(folded & 1))).astype(np.int16)
    parts = np.split(steps, np.cumsum(frames)[:-1], axis=1)
    return [np.cumsum(part, axis=1, dtype=np.int16).T for part in parts]
