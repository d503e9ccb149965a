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

import operator
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeAlias

import numpy as np
from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

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


class _Vector(types.Type):
    """A Numba type of ``width`` elements."""

    element: ir.Type

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"{type(self).__name__}x{width}")

    @property
    def ir(self) -> ir.VectorType:
        """The vector's type in LLVM."""
        return ir.VectorType(self.element, self.width)


class RealType(_Vector):
    """The type of a vector of doubles."""

    element = ir.DoubleType()
    scalar = types.float64


class IntegerType(_Vector):
    """The type of a vector of 64-bit integers."""

    element = ir.IntType(64)
    scalar = types.int64


class MaskType(_Vector):
    """The type of a vector of truth values."""

    element = ir.IntType(1)


class AddressType(types.Type):
    """The type of an address of vectors of one kind."""

    def __init__(self, kind: _Vector) -> None:
        self.kind = kind
        super().__init__(name=f"Address({kind.name})")


class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: _Vector) -> None:
        super().__init__(manager, fe_type, fe_type.ir)


@register_model(AddressType)
class _AddressModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: AddressType) -> None:
        super().__init__(manager, fe_type, fe_type.kind.ir.as_pointer())


for _type in (RealType, IntegerType, MaskType):
    register_model(_type)(_Model)

_I32: Final = ir.IntType(32)


def _spread(builder: Any, kind: Any, value: Any) -> Any:
    """Return a vector with one number in every lane."""
    one = builder.insert_element(ir.Constant(kind.ir, ir.Undefined), value, ir.Constant(_I32, 0))
    lanes = ir.Constant(ir.VectorType(_I32, kind.width), [0] * kind.width)
    return builder.shuffle_vector(one, ir.Constant(kind.ir, ir.Undefined), lanes)


def _vectors(builder: Any, sig: Any, args: Sequence[Any]) -> list[Any]:
    """Return arguments as vectors, numbers spread over the lanes."""
    kind = next(t for t in sig.args if isinstance(t, RealType | IntegerType))
    return [
        v if isinstance(t, _Vector) else _spread(builder, kind, v)
        for t, v in zip(sig.args, args, strict=True)
    ]


def _common(args: Sequence[Any]) -> tuple[Any, list[Any]] | None:
    """Return the vector type of mixed arguments and the types to cast them to; None if they do not fit."""
    kinds = {a for a in args if isinstance(a, RealType | IntegerType)}
    if len(kinds) != 1:
        return None
    kind = kinds.pop()
    number = types.Number if isinstance(kind, RealType) else types.Integer
    if not all(a == kind or isinstance(types.unliteral(a), number) for a in args):
        return None
    return kind, [a if a == kind else kind.scalar for a in args]


_Emit: TypeAlias = Callable[..., Any]


def _define(
    symbol: Any, vector: type[_Vector], emit: _Emit, *, arity: int = 2, compares: bool = False
) -> None:
    """Give an operator a meaning for vectors of one kind.

    Args:
        symbol: the operator's function.
        vector: the kind of vector.
        emit: takes an LLVM builder and the operands' vectors, returns the result.
        arity: number of operands.
        compares: whether the result is a mask.
    """

    class Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if len(args) != arity or kws:
                return None
            if vector is MaskType:
                same = isinstance(args[0], MaskType) and all(a == args[0] for a in args)
                return signature(args[0], *args) if same else None
            common = _common(args)
            if common is None or not isinstance(common[0], vector):
                return None
            kind, cast = common
            return signature(MaskType(kind.width) if compares else kind, *cast)

    infer_global(symbol)(Template)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return emit(builder, *(args if vector is MaskType else _vectors(builder, sig, args)))

    scalar = getattr(vector, "scalar", None)
    operands: list[tuple[Any, ...]] = [(vector,) * arity]
    if scalar is not None and arity == 2:
        operands += [(vector, scalar), (scalar, vector)]
    for kinds in operands:
        lower_builtin(symbol, *kinds)(lower)


_COMPARISONS: Final = {
    operator.lt: "<",
    operator.le: "<=",
    operator.gt: ">",
    operator.ge: ">=",
    operator.eq: "==",
}


def _define_all() -> None:
    for symbol, name in (
        (operator.add, "fadd"),
        (operator.sub, "fsub"),
        (operator.mul, "fmul"),
        (operator.truediv, "fdiv"),
    ):
        _define(symbol, RealType, lambda b, x, y, name=name: getattr(b, name)(x, y))
    _define(operator.neg, RealType, lambda b, x: b.fneg(x), arity=1)
    for symbol, name in (
        (operator.add, "add"),
        (operator.sub, "sub"),
        (operator.mul, "mul"),
        (operator.and_, "and_"),
        (operator.or_, "or_"),
        (operator.xor, "xor"),
        (operator.lshift, "shl"),
        (operator.rshift, "lshr"),
    ):
        _define(symbol, IntegerType, lambda b, x, y, name=name: getattr(b, name)(x, y))
    for symbol, name in _COMPARISONS.items():
        _define(symbol, RealType, lambda b, x, y, n=name: b.fcmp_ordered(n, x, y), compares=True)
        _define(symbol, IntegerType, lambda b, x, y, n=name: b.icmp_signed(n, x, y), compares=True)
    # unlike the other comparisons, this one is true of NaN
    _define(operator.ne, RealType, lambda b, x, y: b.fcmp_unordered("!=", x, y), compares=True)
    _define(operator.ne, IntegerType, lambda b, x, y: b.icmp_signed("!=", x, y), compares=True)
    for symbol, name in ((operator.and_, "and_"), (operator.or_, "or_"), (operator.xor, "xor")):
        _define(symbol, MaskType, lambda b, x, y, name=name: getattr(b, name)(x, y))
    _define(operator.invert, MaskType, lambda b, x: b.not_(x), arity=1)


_define_all()


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
        vector = args[2] if sig.args[2] == kind else _spread(builder, kind, args[2])
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
        return _spread(builder, kind, args[1])

    return kind(like, kind.scalar), emit


@intrinsic
def select(typingctx: Any, mask: Any, a: Any, b: Any) -> Any:
    """Return a where a mask is true and b elsewhere; either may be a number."""
    common = _common([a, b])
    if common is not None:
        kind, cast = common
    elif isinstance(types.unliteral(a), types.Float) and isinstance(types.unliteral(b), types.Float):
        kind, cast = RealType(mask.width), [types.float64, types.float64]
    else:
        return None

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        x, y = (
            v if t == kind else _spread(builder, kind, v) for t, v in zip(sig.args[1:], args[1:], strict=True)
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
    common = _common([a, b])
    if common is None:
        return None
    kind, cast = common
    real = isinstance(kind, RealType)

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        x, y = _vectors(builder, sig, args)
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


def _converted(source: type[_Vector], target: type[_Vector], instruction: str) -> Callable[..., Any]:
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
    common = _common([a, b])
    if common is None or not isinstance(common[0], IntegerType):
        return None
    kind, cast = common

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        low = _spread(builder, kind, ir.Constant(kind.element, 0xFFFFFFFF))
        x, y = (builder.and_(v, low) for v in _vectors(builder, sig, args))
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
        one = _spread(builder, a, ir.Constant(a.element, 1.0))
        above = builder.fcmp_ordered(">", rounded, args[0])
        return builder.select(above, builder.fsub(rounded, one), rounded)

    return (a(a), emit) if isinstance(a, RealType) else None


def _nearest(builder: Any, kind: Any, value: Any) -> Any:
    grid = _spread(builder, kind, ir.Constant(kind.element, _INTEGER_GRID))
    return builder.fsub(builder.fadd(value, grid), grid)
