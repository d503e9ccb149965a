"""Gaussian noise that is a function of where it is drawn, not of what was drawn before.

Every number follows from the run's seed, the evaluation, the target, the repeat, the control update, the
module and the cable, by Philox4x32-10 (Salmon, Moraes, Dror and Shaw 2011, "Parallel random numbers: as easy
as 1, 2, 3"). So no simulation feels another's presence, and one can be taken up anywhere without drawing what
came before.

The first four make a stream: the 128 bits of BLAKE2b (RFC 7693) of ``"seed number target repeat"`` in
decimal, which takes whole numbers of any size. Among 2^40 streams two are the same with probability 2^-49.
Half of the bits are Philox's key, the others its counter's upper half; the lower half is the pair of draws
and the update. Cable c of module m has draw 5 m + c, and pair k has draws 2 k and 2 k + 1.

The draws are Box and Muller's (1958): of two 52-bit numbers one gives a radius, the other an angle, and the
point's coordinates are the two draws. The radius is at most 8.49; that of a Gaussian pair is larger with
probability 2^-52.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.simulation.kernel.lanes.compiling import inlined
from engine.simulation.kernel.lanes.simd import (
    Integer,
    Integers,
    Reals,
    by_lane,
    from_bits,
    integers,
    load,
    multiply_32,
    splat,
    square_root,
    store,
)
from engine.simulation.kernel.lanes.transcendental import logarithm, sine_and_cosine

_MULTIPLIERS: Final = (0xD2511F53, 0xCD9E8D57)
_WEYL: Final = (0x9E3779B9, 0xBB67AE85)
"""What is added to the two halves of the key from round to round."""
_ROUNDS: Final = 10
_LOW: Final = 0xFFFFFFFF
_ONE_BITS: Final = 0x3FF0000000000000
_TURN: Final = 2.0 * math.pi


def stream_words(run_seed: int, number: int, target: int, repeat: int) -> list[int]:
    """Return the four 32-bit words that name the noise of one trial."""
    text = f"{run_seed} {number} {target} {repeat}".encode("ascii")
    digest = hashlib.blake2b(text, digest_size=16).digest()
    return [int.from_bytes(digest[k : k + 4], "little") for k in range(0, 16, 4)]


def streams(trials: Sequence[tuple[int, int, int, int]], *, width: int) -> Integers:
    """Return the streams of as many trials as there are lanes, as ``gaussians`` takes them.

    Args:
        trials: per lane its run's seed, its evaluation's number, its target and its repeat.
        width: of the vectors.
    """
    assert len(trials) == width
    words = integers(4, width=width)
    by_lane(words)[:] = np.array([stream_words(*trial) for trial in trials]).T
    return words


@inlined
def philox(
    c0: Integer, c1: Integer, c2: Integer, c3: Integer, k0: Integer, k1: Integer
) -> tuple[Integer, Integer, Integer, Integer]:
    """Return Philox4x32-10's four 32-bit words for a counter of four such words and a key of two."""
    for _ in range(_ROUNDS):
        # what is above 32 bits never gets into the lower 32, so that it can stay until the end
        first, second = multiply_32(c0, _MULTIPLIERS[0]), multiply_32(c2, _MULTIPLIERS[1])
        c0, c1, c2, c3 = (second >> 32) ^ c1 ^ k0, second, (first >> 32) ^ c3 ^ k1, first
        k0, k1 = k0 + _WEYL[0], k1 + _WEYL[1]
    return c0 & _LOW, c1 & _LOW, c2 & _LOW, c3 & _LOW


@inlined
def gaussians(streams: Integers, update: int, draws: Reals) -> None:
    """Draw the standard normal numbers of one control update.

    Args:
        streams: (4,) vectors from ``streams``.
        update: number of the control update, less than 2^32.
        draws: (n,) vectors to be filled; number i is the same whatever n is.
    """
    k0, k1, c2, c3 = load(streams, 0), load(streams, 1), load(streams, 2), load(streams, 3)
    c1 = splat(k0, update)
    for pair in range((len(draws) + 1) // 2):
        w0, w1, w2, w3 = philox(splat(k0, pair), c1, c2, c3, k0, k1)
        above_one = from_bits((w0 << 20) ^ (w1 >> 12) | _ONE_BITS)
        radius = square_root(-2.0 * logarithm(2.0 - above_one))
        sine, cosine = sine_and_cosine(_TURN * (from_bits((w2 << 20) ^ (w3 >> 12) | _ONE_BITS) - 1.0))
        store(draws, 2 * pair, radius * cosine)
        if 2 * pair + 1 < len(draws):
            store(draws, 2 * pair + 1, radius * sine)
