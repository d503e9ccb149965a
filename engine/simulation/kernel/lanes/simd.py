"""Vectors of doubles, one lane per simulation, for code that Numba compiles.

An array of vectors is a NumPy array whose items are records of ``width`` numbers; the width is part of the
array's type, so that Numba compiles a function once for every width and one process can hold several:

    x = reals(3, width=8)      # (3,) vectors of 8 doubles, all zero
    by_lane(x)[2, 5] = 1.0     # the same memory as a (3, 8) array of doubles

    @njit
    def double(x):
        for i in range(len(x)):
            v = load(x, i)
            store(x, i, v + v)

In compiled code a vector has the operators ``+ - * /``, unary ``-`` and comparisons, between vectors and with
numbers; a comparison gives a mask with ``& | ^ ~``. A vector of 64-bit integers has ``+ - * & | ^ << >>`` and
comparisons; they are signed, but ``>>`` shifts zeros in.

Every operation is the one that IEEE 754 prescribes, lane by lane: no product is fused with a sum, nothing is
reordered and no mathematical library is called. A lane's bits therefore depend neither on the width, nor on
the processor, nor on what the other lanes hold.
"""

# Numba calls what types and emits an operation with arguments that not every operation needs
# ruff: noqa: ARG001

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, TypeAlias

import numpy as np
from llvmlite import ir
from numba import extending, types
from numba.core import cgutils

from engine.simulation.kernel.lanes.vectors import (
    AddressType,
    IntegerType,
    MaskType,
    RealType,
    VectorType,
    common,
    spread,
    vectors,
)

WIDTHS: Final = (1, 2, 4, 8)
"""Lanes that a vector may have; 2, 4 and 8 fill a register of SSE2, AVX2 and AVX-512."""
ALIGNMENT: Final = 64
"""Bytes of a cache line: no vector straddles two of them."""

Real: TypeAlias = Any
"""A vector of doubles, in compiled code."""
Integer: TypeAlias = Any
"""A vector of 64-bit integers, in compiled code."""
Mask: TypeAlias = Any
"""A vector of truth values, in compiled code."""
Reals: TypeAlias = Any
"""An array of vectors of doubles."""
Integers: TypeAlias = Any
"""An array of vectors of integers."""

intrinsic: Final[Callable[[Callable[..., Any]], Callable[..., Any]]] = extending.intrinsic
"""Numba's decorator, whose result is called without the typing context."""


def reals(*shape: int, width: int) -> np.ndarray:
    """Return an array of vectors of doubles, all zero."""
    return _allocate(shape, np.float64, width)


def integers(*shape: int, width: int) -> np.ndarray:
    """Return an array of vectors of 64-bit integers, all zero."""
    return _allocate(shape, np.int64, width)


def by_lane(vectors: np.ndarray) -> np.ndarray:
    """Return the same memory as an array of numbers with the lanes as its last axis."""
    base, shape = vectors.dtype["lane"].subdtype  # type: ignore[misc]
    return vectors.view(base).reshape(*vectors.shape, *shape)


def width_of(vectors: np.ndarray) -> int:
    """Return how many lanes an array's vectors have."""
    return vectors.dtype.itemsize // 8


def _allocate(shape: Sequence[int], dtype: type[np.generic], width: int) -> np.ndarray:
    assert width in WIDTHS
    n_bytes = 8 * width * int(np.prod(shape))
    raw = np.zeros(n_bytes + ALIGNMENT, np.uint8)
    start = -raw.ctypes.data % ALIGNMENT
    record = np.dtype([("lane", dtype, (width,))])
    return raw[start : start + n_bytes].view(record).reshape(shape)


@intrinsic
def load(typingctx: Any, array: Any, i: Any) -> Any:
    """Return vector i of a one-dimensional, contiguous array; the index is not checked."""
    kind = kind_of(array)

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        value = builder.load(_address(context, builder, sig, args))
        value.align = 8
        return value

    return kind(array, types.intp), emit


@intrinsic
def store(typingctx: Any, array: Any, i: Any, value: Any) -> Any:
    """Set vector i of a one-dimensional, contiguous array; the index is not checked."""
    kind = kind_of(array)

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        vector = args[2] if sig.args[2] == kind else spread(builder, kind, args[2])
        builder.store(vector, _address(context, builder, sig, args)).align = 8
        return context.get_dummy_value()

    return types.void(array, types.intp, value if value == kind else kind.scalar), emit


@intrinsic
def load_lane(typingctx: Any, array: Any, i: Any, lane: Any) -> Any:
    """Return one lane of vector i of an array as a number; the indices are not checked."""
    kind = kind_of(array)

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_address(context, builder, sig, args, lane=args[2]))

    return kind.scalar(array, types.intp, types.intp), emit


@intrinsic
def store_lane(typingctx: Any, array: Any, i: Any, lane: Any, value: Any) -> Any:
    """Set one lane of vector i of an array to a number; the indices are not checked."""
    kind = kind_of(array)

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        builder.store(args[3], _address(context, builder, sig, args, lane=args[2]))
        return context.get_dummy_value()

    return types.void(array, types.intp, types.intp, kind.scalar), emit


def kind_of(array: Any) -> Any:
    """Return the type of the vectors of an array or at an address."""
    if isinstance(array, AddressType):
        return array.kind
    assert isinstance(array, types.Array)
    assert array.ndim == 1
    assert array.layout == "C"
    element = array.dtype.typeof("lane").dtype
    return (RealType if element == types.float64 else IntegerType)(array.dtype.size // 8)


def _address(context: Any, builder: Any, sig: Any, args: Any, *, lane: Any = None) -> Any:
    """Return the address of a vector, or of one of its lanes, from (array, index, ...)."""
    kind = kind_of(sig.args[0])
    is_bare = isinstance(sig.args[0], AddressType)
    data = args[0] if is_bare else context.make_array(sig.args[0])(context, builder, args[0]).data
    if lane is None:
        return builder.gep(builder.bitcast(data, kind.ir.as_pointer()), [args[1]])
    k = builder.add(builder.mul(args[1], ir.Constant(args[1].type, kind.width)), lane)
    return builder.gep(builder.bitcast(data, kind.element.as_pointer()), [k])


@intrinsic
def lanes(typingctx: Any, array: Any) -> Any:
    """Return how many lanes the vectors of an array have, which the compiler knows."""
    width = kind_of(array).width

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return ir.Constant(ir.IntType(64), width)

    return types.intp(array), emit


@intrinsic
def splat(typingctx: Any, like: Any, value: Any) -> Any:
    """Return a number in every lane of a vector of the kind that ``like``, a vector or an array, holds."""
    kind = like if isinstance(like, RealType | IntegerType) else kind_of(like)

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return spread(builder, kind, args[1])

    return kind(like, kind.scalar), emit


@intrinsic
def select(typingctx: Any, mask: Any, a: Any, b: Any) -> Any:
    """Return a where a mask is true and b elsewhere; either may be a number."""
    kinds = common([a, b])
    if kinds is not None:
        kind, cast = kinds
    elif isinstance(types.unliteral(a), types.Float) and isinstance(types.unliteral(b), types.Float):
        kind, cast = RealType(mask.width), [types.float64, types.float64]
    else:
        return None

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        x, y = (
            v if t == kind else spread(builder, kind, v) for t, v in zip(sig.args[1:], args[1:], strict=True)
        )
        return builder.select(args[0], x, y)

    return kind(mask, *cast), emit


@intrinsic
def maximum(typingctx: Any, a: Any, b: Any) -> Any:
    """Return the larger of two vectors or numbers per lane, and b if either is NaN."""
    return _choice(a, b, ">")


@intrinsic
def minimum(typingctx: Any, a: Any, b: Any) -> Any:
    """Return the smaller of two vectors or numbers per lane, and b if either is NaN."""
    return _choice(a, b, "<")


def _choice(a: Any, b: Any, comparison: str) -> Any:
    kinds = common([a, b])
    if kinds is None:
        return None
    kind, cast = kinds
    real = isinstance(kind, RealType)

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        x, y = vectors(builder, sig, args)
        compare = builder.fcmp_ordered if real else builder.icmp_signed
        return builder.select(compare(comparison, x, y), x, y)

    return kind(*cast), emit


def _function(name: str) -> Callable[..., Any]:
    """Return a typing and lowering of an LLVM intrinsic of one vector of doubles."""

    def typed(typingctx: Any, a: Any) -> Any:
        if not isinstance(a, RealType):
            return None

        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            kind = ir.FunctionType(a.ir, [a.ir])
            f = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{a.width}f64")
            return builder.call(f, args)

        return a(a), emit

    return typed


@intrinsic
def square_root(typingctx: Any, a: Any) -> Any:
    """Return the correctly rounded square root."""
    return _function("sqrt")(typingctx, a)


@intrinsic
def absolute(typingctx: Any, a: Any) -> Any:
    """Return the absolute value."""
    return _function("fabs")(typingctx, a)


@intrinsic
def any_lane(typingctx: Any, mask: Any) -> Any:
    """Return whether a mask is true in any lane."""
    return _reduced(mask, "!=", 0)


@intrinsic
def all_lanes(typingctx: Any, mask: Any) -> Any:
    """Return whether a mask is true in every lane."""
    return _reduced(mask, "==", -1)


def _reduced(mask: Any, comparison: str, value: int) -> Any:
    if not isinstance(mask, MaskType):
        return None

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits = ir.IntType(mask.width)
        return builder.icmp_unsigned(comparison, builder.bitcast(args[0], bits), ir.Constant(bits, value))

    return types.boolean(mask), emit


def _converted(source: type[VectorType], target: type[VectorType], instruction: str) -> Callable[..., Any]:
    """Return a typing and lowering of one of LLVM's conversions."""

    def typed(typingctx: Any, a: Any) -> Any:
        if not isinstance(a, source):
            return None
        kind = target(a.width)

        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return getattr(builder, instruction)(args[0], kind.ir)

        return kind(a), emit

    return typed


@intrinsic
def to_bits(typingctx: Any, a: Any) -> Any:
    """Return the bits of doubles as integers."""
    return _converted(RealType, IntegerType, "bitcast")(typingctx, a)


@intrinsic
def from_bits(typingctx: Any, a: Any) -> Any:
    """Return the doubles that have the bits of integers."""
    return _converted(IntegerType, RealType, "bitcast")(typingctx, a)


@intrinsic
def to_real(typingctx: Any, a: Any) -> Any:
    """Return integers as the nearest doubles."""
    return _converted(IntegerType, RealType, "sitofp")(typingctx, a)


@intrinsic
def to_integer(typingctx: Any, a: Any) -> Any:
    """Return doubles as integers, rounded towards zero; they must be less than 2^63 in size."""
    return _converted(RealType, IntegerType, "fptosi")(typingctx, a)


@intrinsic
def mask_to_integer(typingctx: Any, a: Any) -> Any:
    """Return 1 where a mask is true and 0 elsewhere."""
    return _converted(MaskType, IntegerType, "zext")(typingctx, a)


@intrinsic
def multiply_32(typingctx: Any, a: Any, b: Any) -> Any:
    """Return the 64-bit products of the lower 32 bits, both without sign; b may be a number."""
    kinds = common([a, b])
    if kinds is None or not isinstance(kinds[0], IntegerType):
        return None
    kind, cast = kinds

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        low = spread(builder, kind, ir.Constant(kind.element, 0xFFFFFFFF))
        x, y = (builder.and_(v, low) for v in vectors(builder, sig, args))
        return builder.mul(x, y)

    return kind(*cast), emit


_INTEGER_GRID: Final = 1.5 * 2.0**52
"""Doubles from 2^52 to 2^53 are the integers: adding this rounds to one, to the even one at a half."""


@intrinsic
def nearest(typingctx: Any, a: Any) -> Any:
    """Return the nearest integer, at a half the even one, as doubles; less than 2^51 in size."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _nearest(builder, a, args[0])

    return (a(a), emit) if isinstance(a, RealType) else None


@intrinsic
def floor(typingctx: Any, a: Any) -> Any:
    """Return the largest integer that is not above, as doubles; less than 2^51 in size."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        rounded = _nearest(builder, a, args[0])
        one = spread(builder, a, ir.Constant(a.element, 1.0))
        above = builder.fcmp_ordered(">", rounded, args[0])
        return builder.select(above, builder.fsub(rounded, one), rounded)

    return (a(a), emit) if isinstance(a, RealType) else None


def _nearest(builder: Any, kind: Any, value: Any) -> Any:
    grid = spread(builder, kind, ir.Constant(kind.element, _INTEGER_GRID))
    return builder.fsub(builder.fadd(value, grid), grid)
