"""Three-dimensional algebra on lanes: a point is a tuple of three vectors of lanes (or numbers).

A symmetric matrix is a tuple of six: xx, xy, xz, yy, yz, zz.
"""

from __future__ import annotations

from typing import Any, TypeAlias

from engine.simulation.kernel.lanes.compiling import inlined
from engine.simulation.kernel.lanes.simd import (
    Mask,
    Real,
    Reals,
    load,
    maximum,
    minimum,
    select,
    splat,
    store,
)

Point: TypeAlias = Any
"""Three vectors of lanes."""
Symmetric: TypeAlias = Any
"""Six vectors of lanes."""


@inlined
def load3(array: Reals, i: int) -> Point:
    """Return vectors i to i + 2 of an array."""
    return load(array, i), load(array, i + 1), load(array, i + 2)


@inlined
def store3(array: Reals, i: int, a: Point) -> None:
    """Set vectors i to i + 2 of an array."""
    store(array, i, a[0])
    store(array, i + 1, a[1])
    store(array, i + 2, a[2])


@inlined
def load6(array: Reals, i: int) -> Symmetric:
    """Return vectors i to i + 5 of an array."""
    return (
        load(array, i),
        load(array, i + 1),
        load(array, i + 2),
        load(array, i + 3),
        load(array, i + 4),
        load(array, i + 5),
    )


@inlined
def store6(array: Reals, i: int, s: Symmetric) -> None:
    """Set vectors i to i + 5 of an array."""
    store(array, i, s[0])
    store(array, i + 1, s[1])
    store(array, i + 2, s[2])
    store(array, i + 3, s[3])
    store(array, i + 4, s[4])
    store(array, i + 5, s[5])


@inlined
def zero3(like: Any) -> Point:
    """Return the origin, in vectors of the kind that ``like`` is or holds."""
    zero = splat(like, 0.0)
    return zero, zero, zero


@inlined
def add(a: Point, b: Point) -> Point:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def sub(a: Point, b: Point) -> Point:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def scale(a: Point, s: Real) -> Point:
    """Return a s."""
    return a[0] * s, a[1] * s, a[2] * s


@inlined
def dot(a: Point, b: Point) -> Real:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a: Point, b: Point) -> Point:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def select3(mask: Mask, a: Point, b: Point) -> Point:
    """Return a where a mask is true and b elsewhere."""
    return select(mask, a[0], b[0]), select(mask, a[1], b[1]), select(mask, a[2], b[2])


@inlined
def clamp(x: Real, lower: Real, upper: Real) -> Real:
    """Return the number between two bounds that is nearest to x."""
    return minimum(maximum(x, lower), upper)


@inlined
def rotate(rotation: tuple[Point, Point, Point], a: Point) -> Point:
    """Return a point turned by a rotation that is given by its three columns."""
    x, y, z = rotation
    return (
        x[0] * a[0] + y[0] * a[1] + z[0] * a[2],
        x[1] * a[0] + y[1] * a[1] + z[1] * a[2],
        x[2] * a[0] + y[2] * a[1] + z[2] * a[2],
    )


@inlined
def rotation_columns(q: Any) -> tuple[Point, Point, Point]:
    """Return the columns of the rotation of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    wx, wy, wz, xy, xz, yz = w * x, w * y, w * z, x * y, x * z, y * z
    return (
        (ww + xx - yy - zz, 2.0 * (xy + wz), 2.0 * (xz - wy)),
        (2.0 * (xy - wz), ww - xx + yy - zz, 2.0 * (yz + wx)),
        (2.0 * (xz + wy), 2.0 * (yz - wx), ww - xx - yy + zz),
    )


@inlined
def transform(s: Symmetric, a: Point) -> Point:
    """Return the product of a symmetric matrix and a point."""
    return (
        s[0] * a[0] + s[1] * a[1] + s[2] * a[2],
        s[1] * a[0] + s[3] * a[1] + s[4] * a[2],
        s[2] * a[0] + s[4] * a[1] + s[5] * a[2],
    )


@inlined
def inverse(s: Symmetric) -> Symmetric:
    """Return the inverse of a symmetric matrix, by its adjugate."""
    xx, xy, xz, yy, yz, zz = s
    a = yy * zz - yz * yz
    b = xz * yz - xy * zz
    c = xy * yz - xz * yy
    i = 1.0 / (xx * a + xy * b + xz * c)
    return (
        a * i,
        b * i,
        c * i,
        (xx * zz - xz * xz) * i,
        (xy * xz - xx * yz) * i,
        (xx * yy - xy * xy) * i,
    )
