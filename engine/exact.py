"""Numbers whose last bit is the same on every machine.

Sines, norms and products of matrices come from libraries that choose their code by the processor, and may
round differently there. A simulation repeats bit for bit, so all that leads to it is computed here, or by
sums, products, quotients and square roots in a fixed order, which IEEE 754 prescribes to the last bit.
"""

from __future__ import annotations

import functools
import math
from fractions import Fraction
from typing import Final

import numpy as np

_BITS: Final = 192
"""Bits after the point of the whole numbers that stand for fractions in a series: 2^192 is 1."""
_ONE: Final = 1 << _BITS
_MOST_BITS: Final = 1280
"""The same of pi: the largest double has 1,024 bits before the point."""
_TINY: Final = 1e-9
"""Angles in rad up to which sine and angle, cosine and 1 are the same double."""


def _arctangent(n: int, bits: int) -> int:
    """Return arctan(1/n), times 2^bits, by its Taylor series."""
    total, power, k = 0, (1 << bits) // n, 0
    while power:
        total += (power if k % 2 == 0 else -power) // (2 * k + 1)
        power //= n * n
        k += 1
    return total


_HALF_PI: Final = 8 * _arctangent(5, _MOST_BITS) - 2 * _arctangent(239, _MOST_BITS)
"""Half of pi, times 2^_MOST_BITS, by Machin's formula."""


@functools.lru_cache(maxsize=1024)
def cosine_and_sine(angle: float) -> tuple[float, float]:
    """Return the doubles nearest to cosine and sine of a finite angle in rad."""
    if abs(angle) < _TINY:
        return 1.0, float(angle)
    # as many more bits as the angle has before the point, so that as many are left after its reduction
    more = max(0, math.frexp(angle)[1])
    whole, part = float(angle).as_integer_ratio()
    x, half_pi = (whole << _BITS + more) // part, _HALF_PI >> _MOST_BITS - _BITS - more
    quarter = (x + (half_pi >> 1)) // half_pi
    x = (x - quarter * half_pi) >> more
    cosine, sine = _alternating(_ONE, x, 0) / _ONE, _alternating(x, x, 1) / _ONE
    return ((cosine, sine), (-sine, cosine), (-cosine, -sine), (sine, -cosine))[quarter % 4]


def _alternating(term: int, x: int, k: int) -> int:
    """Return the Taylor series of cosine or sine, times 2^_BITS, whose first term is that in x^k."""
    total, square = 0, x * x >> _BITS
    while term not in (0, -1):
        total += term
        term = (-term * square >> _BITS) // ((k + 1) * (k + 2))
        k += 2
    return total


def _artanh(x: int) -> int:
    """Return artanh of x / 2^_BITS, times 2^_BITS, by its Taylor series."""
    total, power, square, k = 0, x, x * x >> _BITS, 1
    while power not in (0, -1):
        total += power // k
        power = power * square >> _BITS
        k += 2
    return total


_LN_2: Final = 2 * _artanh(_ONE // 3)


def logarithm(x: float) -> float:
    """Return the double nearest to the natural logarithm of a positive, finite number."""
    part, exponent = math.frexp(x)
    if part < 0.7:
        part, exponent = 2.0 * part, exponent - 1
    numerator, denominator = part.as_integer_ratio()
    fraction = ((numerator - denominator) << _BITS) // (numerator + denominator)
    return (2 * _artanh(fraction) + exponent * _LN_2) / _ONE


def exponential(x: float) -> float:
    """Return the double nearest to e^x, for x from -700 to 700."""
    whole, part = float(x).as_integer_ratio()
    fixed = (whole << _BITS) // part
    exponent = fixed // _LN_2
    rest = fixed - exponent * _LN_2
    total, term, k = 0, _ONE, 1
    while term:
        total += term
        term = (term * rest >> _BITS) // k
        k += 1
    return math.ldexp(total / _ONE, exponent)


def length(vectors: np.ndarray) -> np.ndarray:
    """Return the (...) lengths of (..., n) vectors."""
    squares = vectors * vectors
    total = squares[..., 0]
    for i in range(1, vectors.shape[-1]):
        total = total + squares[..., i]
    return np.sqrt(total)


def _double_and_rest(x: Fraction) -> tuple[float, float]:
    return float(x), float(x - Fraction(float(x)))


_PI: Final = Fraction(_HALF_PI, 1 << (_MOST_BITS - 1))
_PI_DOUBLE, _PI_REST = _double_and_rest(_PI)
_SERIES: Final = [float(Fraction((-1) ** k, 2 * k + 1)) for k in reversed(range(1, 14))]
"""Of arctan(u) / u, without its first term; the highest power's first."""
_BASES: Final = np.array(
    [
        (0.0, 0.0, 0.0),
        (0.5, *_double_and_rest(Fraction(_arctangent(2, _BITS), _ONE))),
        (1.0, *_double_and_rest(_PI / 4)),
    ]
)
"""Three numbers, with their arctangents and what is missing of these."""


def bearing(left: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Return the angles in rad, from -pi to pi, of vectors by their parts to the left and ahead.

    They are at most 2 ulp off, and 0 for a vector of length 0. A zero's sign does not count: straight behind
    is pi. What is done is ``angle`` of ``engine.simulation.kernel.lanes.transcendental``.
    """
    across, along = np.abs(left), np.abs(ahead)
    small, large = np.minimum(across, along), np.maximum(across, along)
    large = np.where(large > 0.0, large, 1.0)
    # arctan(t) = arctan(c) + arctan((t - c) / (1 + c t)) with c = 0, 1/2 or 1; for these t - c is exact
    nearest = np.where(small > 0.72 * large, 2, np.where(small > 0.25 * large, 1, 0))
    c, base, base_rest = (_BASES[nearest, i] for i in range(3))
    u = (small - c * large) / (large + c * small)
    square = u * u
    series = square * _SERIES[0] + _SERIES[1]
    for coefficient in _SERIES[2:]:
        series = series * square + coefficient
    first = base + (u + (u * square * series + base_rest))
    # the first eighth of a turn, to be mirrored
    steep, behind = across > along, ahead < 0.0
    whole = np.where(steep, 0.5 * _PI_DOUBLE, np.where(behind, _PI_DOUBLE, 0.0))
    whole_rest = np.where(steep, 0.5 * _PI_REST, np.where(behind, _PI_REST, 0.0))
    size = whole + (np.where(steep ^ behind, -first, first) + whole_rest)
    return np.where(left < 0.0, -size, size)
