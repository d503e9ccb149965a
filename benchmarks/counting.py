"""Counts what a time step of the kernel computes, by running its own functions in Python.

Every compiled function is taken as the Python that it was written in. Vectors are NumPy arrays that count
what is done with them. Sums, products, quotients and roots give the same bits as compiled, so the step does
exactly what the compiled one does, sweeps included.
"""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numba.core.dispatcher import Dispatcher

from engine.simulation.kernel import step
from engine.simulation.kernel.lanes import bare, simd
from engine.simulation.kernel.physics.state import State
from engine.simulation.kernel.robots.model import Model

PARTS: Final = {
    "free_motion": "cables",
    "_search": "contacts and links",
    "_find_contacts": "contacts and links",
    "find_links": "contacts and links",
    "find_pairs": "contacts and links",
    "solve": "their forces",
    "integrate": "moving on",
}
"""The functions that a step calls, and what they do."""
_CHEAP: Final = {np.add, np.subtract, np.multiply}
_DEAR: Final = {np.divide, np.sqrt}


@dataclasses.dataclass(slots=True)
class Work:
    """What was done with vectors, each of all lanes.

    Attributes:
        cheap: sums, differences and products.
        dear: quotients and square roots.
        loads, stores: vectors read and written.
        touched: which vectors those were, by array and index.
        parts: operations by ``PARTS``.
    """

    cheap: int = 0
    dear: int = 0
    loads: int = 0
    stores: int = 0
    touched: set[tuple[int, int]] = dataclasses.field(default_factory=set)
    parts: dict[str, int] = dataclasses.field(default_factory=lambda: dict.fromkeys(PARTS.values(), 0))

    @property
    def operations(self) -> int:
        """Operations with numbers, per lane."""
        return self.cheap + self.dear


_work = Work()


class _Vector(np.ndarray):
    """A vector of doubles that counts what is done with it."""

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **_: Any) -> Any:
        plain = [x.view(np.ndarray) if isinstance(x, _Vector) else x for x in inputs]
        result = getattr(ufunc, method)(*plain)
        _work.cheap += ufunc in _CHEAP
        _work.dear += ufunc in _DEAR
        return result.view(_Vector) if result.dtype.kind == "f" else result


def count_step(model: Model, state: State) -> Work:
    """Move simulations on by one time step, as ``step.run`` does without judging, and return the work."""
    global _work
    _work = Work()
    with np.errstate(all="ignore"):
        _translated(step.advance)(model, state, 1)
    return _work


def _load(array: np.ndarray, i: int) -> np.ndarray:
    vector = simd.by_lane(array)[i].copy()
    _work.loads += 1
    _work.touched.add((array.ctypes.data, int(i)))
    return vector.view(_Vector) if vector.dtype.kind == "f" else vector


def _store(array: np.ndarray, i: int, value: Any) -> None:
    simd.by_lane(array)[i] = value
    _work.stores += 1
    _work.touched.add((array.ctypes.data, int(i)))


def _load_lane(array: np.ndarray, i: int, lane: int) -> float | int:
    return simd.by_lane(array)[i, lane].item()  # type: ignore[no-any-return]


def _store_lane(array: np.ndarray, i: int, lane: int, value: float) -> None:
    simd.by_lane(array)[i, lane] = value


def _splat(like: np.ndarray, value: Any) -> np.ndarray:
    is_array = like.dtype.names is not None
    dtype = simd.by_lane(like).dtype if is_array else like.dtype
    vector = np.full(simd.width_of(like) if is_array else len(like), value, dtype)
    return vector.view(_Vector) if dtype.kind == "f" else vector


def _chosen(mask: np.ndarray, a: Any, b: Any) -> np.ndarray:
    vector = np.where(mask, np.asarray(a), np.asarray(b))
    return vector.view(_Vector) if vector.dtype.kind == "f" else vector


_IN_PYTHON: Final[dict[Any, Callable[..., Any]]] = {
    simd.load: _load,
    simd.store: _store,
    simd.load_lane: _load_lane,
    simd.store_lane: _store_lane,
    simd.splat: _splat,
    simd.select: _chosen,
    simd.maximum: lambda a, b: _chosen(a > b, a, b),
    simd.minimum: lambda a, b: _chosen(a < b, a, b),
    simd.square_root: np.sqrt,
    simd.absolute: np.abs,
    simd.any_lane: lambda mask: bool(mask.any()),
    simd.all_lanes: lambda mask: bool(mask.all()),
    simd.mask_to_integer: lambda mask: mask.astype(np.int64),
    simd.to_real: lambda integers: integers.astype(float).view(_Vector),
    simd.lanes: simd.width_of,
    bare.bare: lambda record: record,
}
"""What stands in for the operations that exist in compiled code alone."""
_modules: Final[dict[str, dict[str, Any]]] = {}


def _translated(value: Any) -> Any:
    """Return a compiled function as the Python it was written in, and anything else as it is."""
    if isinstance(value, Dispatcher):
        function = value.py_func
        found = types.FunctionType(
            function.__code__, _globals(function), function.__name__, function.__defaults__
        )
        return _part(found) if function.__name__ in PARTS else found
    try:
        return _IN_PYTHON.get(value, value)
    except TypeError:  # not hashable
        return value


def _part(function: Callable[..., None]) -> Callable[..., None]:
    """Return a part of a step that counts its own operations."""

    def counted(model: Model, state: State) -> None:
        before = _work.operations
        function(model, state)
        _work.parts[PARTS[function.__name__]] += _work.operations - before

    return counted


def _globals(function: Any) -> dict[str, Any]:
    """Return the names that a compiled function's module knows, translated."""
    name = function.__module__
    if name not in _modules:
        _modules[name] = found = {}
        for key, value in function.__globals__.items():
            found[key] = _translated(value)
    return _modules[name]
