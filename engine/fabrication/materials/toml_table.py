"""Tables of a TOML file as dataclasses: keys carry their unit, every one is required and checked."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, Final

from engine.errors import InvalidData

_UNITS: Final = {"mpa": 1e6, "mm": 1e-3, "mm2": 1e-6, "g": 1e-3, "percent": 1e-2}


def number(
    unit: str = "",
    *,
    zero: bool = False,
    optional: bool = False,
    within: tuple[float, float] = (0.0, math.inf),
) -> Any:
    """Describe a number of the file.

    Args:
        unit: that its key ends in.
        zero: whether it may be 0.
        optional: whether it may be left out.
        within: least and largest number, in that unit, with which a part can be made.
    """
    extra: dict[str, Any] = {"default": None} if optional else {}
    return dataclasses.field(metadata={"unit": unit, "zero": zero, "within": within}, **extra)


def read_table(kind: type, table: Any, where: str) -> Any:
    """Read a table of the file into its dataclass; ``where`` is the file and the table."""
    if not isinstance(table, Mapping):
        raise InvalidData(f"{where} must be a table")
    values: dict[str, Any] = {}
    fields = {_key(f): f for f in dataclasses.fields(kind)}
    for key in table:
        if key not in fields:
            raise InvalidData(f"{where}.{key} is unknown; known are {', '.join(fields)}")
    for key, field in fields.items():
        if key not in table:
            if field.default is None:
                continue
            raise InvalidData(f"{where}.{key} is missing")
        values[field.name] = _value(field, table[key], f"{where}.{key}")
    return kind(**values)


def _key(field: dataclasses.Field[Any]) -> str:
    unit = field.metadata.get("unit")
    return f"{field.name}_{unit}" if unit else field.name


def _value(field: dataclasses.Field[Any], value: Any, where: str) -> Any:
    if "unit" not in field.metadata:
        if field.type == "bool":
            if type(value) is not bool:
                raise InvalidData(f"{where} must be true or false, not {value!r}")
            return value
        return text_value(value, where)
    if str(field.type).startswith("tuple"):
        if not isinstance(value, list):
            raise InvalidData(f"{where} must be a list of numbers, not {value!r}")
        return tuple(_checked(field, v, f"{where}[{i}]") for i, v in enumerate(value))
    return _checked(field, value, where)


def _checked(field: dataclasses.Field[Any], value: Any, where: str) -> float | int:
    if type(value) not in (int, float):
        raise InvalidData(f"{where} must be a number, not {value!r}")
    try:
        finite = math.isfinite(value)
    except OverflowError:
        finite = False
    if not finite:
        raise InvalidData(f"{where} must be finite, not {value!r}")
    if value < 0 or (value == 0 and not field.metadata["zero"]):
        raise InvalidData(
            f"{where} must {'not be negative' if field.metadata['zero'] else 'be positive'}, not {value!r}"
        )
    low, high = field.metadata["within"]
    if not low <= value <= high:
        raise InvalidData(f"{where} must be from {low:g} to {high:g}, not {value!r}")
    if field.type == "int":
        if type(value) is not int:
            raise InvalidData(f"{where} must be a whole number, not {value!r}")
        return value
    return float(value) * _UNITS.get(field.metadata["unit"], 1.0)


def text_value(value: Any, where: str) -> str:
    """Return a line of text; ``where`` is the file and the key."""
    # control characters would end up in drawings and file names
    if not isinstance(value, str) or not value.strip() or not value.isprintable() or len(value) > 200:
        raise InvalidData(
            f"{where} must be a line of text of at most 200 characters, not {str(value)[:40]!r}"
        )
    return value
