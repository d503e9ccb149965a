"""Exponential, logarithm, sine, cosine and the angle of a vector, for lanes of doubles.

A mathematical library's last bit differs from one processor or release to the next. These functions use only
``+ - * /`` and bits, so that their results are the same everywhere. Where a series is cut off, the rest is
less than 2^-59 of the result. An ulp is the distance of two neighbouring doubles at the exact result.

The reductions are Cody and Waite's (Software Manual for the Elementary Functions, 1980): an argument minus a
multiple of a constant, in two or three steps of which the first are exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import factorial
from typing import Final

from engine.simulation.kernel.lanes.compiling import inlined
from engine.simulation.kernel.lanes.simd import Real, absolute, from_bits, maximum, minimum, select, to_bits

EXPONENTIAL_LIMIT: Final = 700.0
"""Largest size of an argument of the exponential."""
SINE_LIMIT: Final = 65536.0
"""Largest size of an argument of sine and cosine, in rad."""

_LN2_HIGH: Final = float.fromhex("0x1.62e42fefa2000p-1")  # 40 bits: a whole number of them is exact
_LN2_LOW: Final = float.fromhex("0x1.9ef35793c7673p-41")
_PER_LN2: Final = float.fromhex("0x1.71547652b82fep+0")

_HALF_PI_1: Final = float.fromhex("0x1.921fb54440000p+0")  # 36 bits
_HALF_PI_2: Final = float.fromhex("0x1.68c234c4c0000p-39")  # 36 bits
_HALF_PI_3: Final = float.fromhex("0x1.98a2e03707345p-77")
_PER_HALF_PI: Final = float.fromhex("0x1.45f306dc9c883p-1")

_PI: Final = float.fromhex("0x1.921fb54442d18p+1")
_PI_REST: Final = float.fromhex("0x1.1a62633145c07p-53")
_ARCTAN_HALF: Final = float.fromhex("0x1.dac670561bb4fp-2")
_ARCTAN_HALF_REST: Final = float.fromhex("0x1.a2b7f222f65e2p-56")

_ROOT_HALF_BITS: Final = 0x3FE6A09E667F3BCD
"""The bits of the root of one half."""
_UP_TO_ONE: Final = 0x3FF0000000000000 - _ROOT_HALF_BITS
_FRACTION_BITS: Final = (1 << 52) - 1
_TWO_52: Final = 2.0**52
_TWO_52_BITS: Final = 0x4330000000000000
_GRID: Final = 1.5 * _TWO_52
"""Added to a small number it rounds to a whole one, which is then in the lowest bits."""


def _nearest_doubles(coefficients: Sequence[Fraction]) -> tuple[float, ...]:
    """Return the doubles nearest to fractions, the last first, as Horner's rule takes them."""
    return tuple(float(c) for c in reversed(coefficients))


# Taylor's series without their first terms
_EXP: Final = _nearest_doubles([Fraction(1, factorial(k)) for k in range(2, 15)])
_SIN: Final = _nearest_doubles([Fraction((-1) ** k, factorial(2 * k + 1)) for k in range(1, 10)])
_COS: Final = _nearest_doubles([Fraction((-1) ** k, factorial(2 * k)) for k in range(2, 10)])
_ARTANH: Final = _nearest_doubles([Fraction(2, 2 * k + 1) for k in range(1, 12)])
_ARCTAN: Final = _nearest_doubles([Fraction((-1) ** k, 2 * k + 1) for k in range(1, 14)])


@inlined
def _polynomial(coefficients: tuple[float, ...], x: Real) -> Real:
    """Return the sum of coefficients times powers of x, by Horner's rule, the highest power's first."""
    total = x * coefficients[0] + coefficients[1]
    for c in coefficients[2:]:
        total = total * x + c
    return total


@inlined
def exponential(x: Real) -> Real:
    """Return e to the power of x, at most 1 ulp off; the size of x is at most ``EXPONENTIAL_LIMIT``."""
    shifted = x * _PER_LN2 + _GRID
    k = shifted - _GRID
    high = x - k * _LN2_HIGH
    low = k * _LN2_LOW
    r = high - low
    rest = (high - r) - low
    value = 1.0 + (r + (r * r * _polynomial(_EXP, r) + rest))
    return from_bits(to_bits(value) + (to_bits(shifted) << 52))


@inlined
def logarithm(x: Real) -> Real:
    """Return the natural logarithm of x, at most 1 ulp off; x is positive, normal and finite."""
    # x is m times a power of two, m between the roots of a half and of two
    bits = to_bits(x) + _UP_TO_ONE
    m = from_bits((bits & _FRACTION_BITS) + _ROOT_HALF_BITS)
    k = from_bits((bits >> 52) | _TWO_52_BITS) - (_TWO_52 + 1023.0)
    f = m - 1.0
    s = f / (m + 1.0)
    # log(m) = 2 artanh(s) = f - s (f - R); split so that f^2 / 2, the largest part of s (f - R), is exact
    square = 0.5 * f * f
    s2 = s * s
    rest = s * (square + s2 * _polynomial(_ARTANH, s2)) + k * _LN2_LOW
    return k * _LN2_HIGH + (f - (square - rest))


@inlined
def sine_and_cosine(x: Real) -> tuple[Real, Real]:
    """Return sine and cosine of x in rad, at most 1 ulp off; its size is at most ``SINE_LIMIT``."""
    shifted = x * _PER_HALF_PI + _GRID
    quarter = to_bits(shifted)
    k = shifted - _GRID
    left = x - k * _HALF_PI_1
    step = k * _HALF_PI_2
    high = left - step
    low = ((left - high) - step) - k * _HALF_PI_3
    r = high + low
    rest = (high - r) + low
    r2 = r * r
    sine = r + (r * r2 * _polynomial(_SIN, r2) + rest * (1.0 - 0.5 * r2))
    half = 0.5 * r2
    one = 1.0 - half
    cosine = one + (((1.0 - one) - half) + (r2 * r2 * _polynomial(_COS, r2) - r * rest))
    swapped = (quarter & 1) == 1
    s, c = select(swapped, cosine, sine), select(swapped, sine, cosine)
    return select((quarter & 2) == 2, -s, s), select(((quarter + 1) & 2) == 2, -c, c)


@inlined
def angle(y: Real, x: Real) -> Real:
    """Return the angle of the vector (x, y) in rad, from -pi to pi, at most 2 ulp off; 0 for (0, 0).

    The sizes of x and y are 0 or from 1e-150 to 1e150. A zero's sign does not count: straight behind is pi.
    """
    across, along = absolute(y), absolute(x)
    small, large = minimum(across, along), maximum(across, along)
    large = select(large > 0.0, large, 1.0)
    # arctan(t) = arctan(c) + arctan((t - c) / (1 + c t)) with c = 0, 1/2 or 1; for these t - c is exact
    over_half, over_one = small > 0.25 * large, small > 0.72 * large
    c = select(over_one, 1.0, select(over_half, 0.5, 0.0))
    u = (small - c * large) / (large + c * small)
    base = select(over_one, 0.25 * _PI, select(over_half, _ARCTAN_HALF, 0.0))
    base_rest = select(over_one, 0.25 * _PI_REST, select(over_half, _ARCTAN_HALF_REST, 0.0))
    u2 = u * u
    first = base + (u + (u * u2 * _polynomial(_ARCTAN, u2) + base_rest))
    # the first eighth of a turn, to be mirrored
    steep, behind = across > along, x < 0.0
    whole = select(steep, 0.5 * _PI, select(behind, _PI, 0.0))
    whole_rest = select(steep, 0.5 * _PI_REST, select(behind, _PI_REST, 0.0))
    size = whole + (select(steep ^ behind, -first, first) + whole_rest)
    return select(y < 0.0, -size, size)
