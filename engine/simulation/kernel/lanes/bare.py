"""Arrays as bare addresses, inside compiled code.

Numba counts references to the arrays that a function gets; with some sixty of them that takes longer than
what a small function does (0.7 us against 0.1). ``bare`` turns the arrays of a named tuple into their
addresses, once per entry; whoever called keeps the arrays alive. An address of numbers is indexed like an
array, one of vectors goes to ``simd.load`` and ``simd.store``. Neither knows its length.
"""

# Numba calls what types and emits an operation with arguments that not every operation needs
# ruff: noqa: ARG001, ARG002

from __future__ import annotations

import operator
from typing import Any

from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

from engine.simulation.kernel.lanes.simd import intrinsic, kind_of
from engine.simulation.kernel.lanes.vectors import AddressType


class NumbersType(types.Type):
    """The type of an address of numbers."""

    def __init__(self, element: Any) -> None:
        self.element = element
        super().__init__(name=f"Numbers({element})")


@register_model(NumbersType)
class _NumbersModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: NumbersType) -> None:
        super().__init__(manager, fe_type, manager.lookup(fe_type.element).get_data_type().as_pointer())


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        if len(args) == 2 and isinstance(args[0], NumbersType) and isinstance(args[1], types.Integer):
            return signature(args[0].element, args[0], types.intp)
        return None


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        if len(args) == 3 and isinstance(args[0], NumbersType) and isinstance(args[1], types.Integer):
            return signature(types.void, args[0], types.intp, args[0].element)
        return None


@lower_builtin(operator.getitem, NumbersType, types.Integer)
def _get(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return context.unpack_value(builder, sig.return_type, builder.gep(args[0], [args[1]]))


@lower_builtin(operator.setitem, NumbersType, types.Integer, types.Any)
def _set(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    context.pack_value(builder, sig.args[2], args[2], builder.gep(args[0], [args[1]]))
    return context.get_dummy_value()


@intrinsic
def bare(typingctx: Any, record: Any) -> Any:
    """Return a named tuple with addresses in place of arrays, in the named tuples that it holds too."""
    result = _bare_type(record)

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _emit(context, builder, record, args[0])

    return result(record), emit


def _is_record(kind: Any) -> bool:
    return isinstance(kind, types.BaseNamedTuple)


def _bare_type(kind: Any) -> Any:
    if isinstance(kind, types.Array):
        return AddressType(kind_of(kind)) if isinstance(kind.dtype, types.Record) else NumbersType(kind.dtype)
    if _is_record(kind):
        fields = [_bare_type(t) for t in kind.types]
        if len(set(fields)) == 1:
            return types.NamedUniTuple(fields[0], len(fields), kind.instance_class)
        return types.NamedTuple(fields, kind.instance_class)
    return kind


def _emit(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.Array):
        data = context.make_array(kind)(context, builder, value).data
        return builder.bitcast(data, context.get_value_type(_bare_type(kind)))
    if _is_record(kind):
        values = cgutils.unpack_tuple(builder, value)
        fields = [_emit(context, builder, t, v) for t, v in zip(kind.types, values, strict=True)]
        return context.make_tuple(builder, _bare_type(kind), fields)
    return value
