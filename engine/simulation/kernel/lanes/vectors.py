"""Numba's types of vectors of lanes, and what the operators do with them."""

# Numba calls what types and emits an operation with arguments that not every operation needs
# ruff: noqa: ARG001

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeAlias

from llvmlite import ir
from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model


class VectorType(types.Type):
    """A Numba type of ``width`` elements."""

    element: ir.Type

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"{type(self).__name__}x{width}")

    @property
    def ir(self) -> ir.VectorType:
        """The vector's type in LLVM."""
        return ir.VectorType(self.element, self.width)


class RealType(VectorType):
    """The type of a vector of doubles."""

    element = ir.DoubleType()
    scalar = types.float64


class IntegerType(VectorType):
    """The type of a vector of 64-bit integers."""

    element = ir.IntType(64)
    scalar = types.int64


class MaskType(VectorType):
    """The type of a vector of truth values."""

    element = ir.IntType(1)


class AddressType(types.Type):
    """The type of an address of vectors of one kind."""

    def __init__(self, kind: VectorType) -> None:
        self.kind = kind
        super().__init__(name=f"Address({kind.name})")


class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: VectorType) -> None:
        super().__init__(manager, fe_type, fe_type.ir)


@register_model(AddressType)
class _AddressModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: AddressType) -> None:
        super().__init__(manager, fe_type, fe_type.kind.ir.as_pointer())


for _type in (RealType, IntegerType, MaskType):
    register_model(_type)(_Model)

_I32: Final = ir.IntType(32)


def spread(builder: Any, kind: Any, value: Any) -> Any:
    """Return a vector with one number in every lane."""
    one = builder.insert_element(ir.Constant(kind.ir, ir.Undefined), value, ir.Constant(_I32, 0))
    lanes = ir.Constant(ir.VectorType(_I32, kind.width), [0] * kind.width)
    return builder.shuffle_vector(one, ir.Constant(kind.ir, ir.Undefined), lanes)


def vectors(builder: Any, sig: Any, args: Sequence[Any]) -> list[Any]:
    """Return arguments as vectors, numbers spread over the lanes."""
    kind = next(t for t in sig.args if isinstance(t, RealType | IntegerType))
    return [
        v if isinstance(t, VectorType) else spread(builder, kind, v)
        for t, v in zip(sig.args, args, strict=True)
    ]


def common(args: Sequence[Any]) -> tuple[Any, list[Any]] | None:
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
    symbol: Any, vector: type[VectorType], emit: _Emit, *, arity: int = 2, compares: bool = False
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
            found = common(args)
            if found is None or not isinstance(found[0], vector):
                return None
            kind, cast = found
            return signature(MaskType(kind.width) if compares else kind, *cast)

    infer_global(symbol)(Template)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return emit(builder, *(args if vector is MaskType else vectors(builder, sig, args)))

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
