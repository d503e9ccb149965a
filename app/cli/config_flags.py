"""The configuration's fields as flags: tables that are ``INLINE`` add no prefix to their fields' names."""

from __future__ import annotations

import dataclasses
import typing
from typing import Annotated, Any, Final

import tyro
from tyro.constructors import ConstructorRegistry, StructConstructorSpec, StructFieldSpec, StructTypeInfo

from app.gui.field_docs import field_docs
from engine.config import RunConfig, inline_tables

REGISTRY: Final = ConstructorRegistry()
"""What tells tyro so; ``tyro.cli`` takes it."""


@REGISTRY.struct_rule
def _run_config(info: StructTypeInfo) -> StructConstructorSpec | None:
    if info.type is not RunConfig:
        return None
    hints, inline = typing.get_type_hints(RunConfig), inline_tables(RunConfig)
    fields = []
    for field in dataclasses.fields(RunConfig):
        kind: Any = hints[field.name]
        if field.name in inline:
            kind = Annotated[kind, tyro.conf.arg(name="")]
        fields.append(
            StructFieldSpec(
                name=field.name,
                type=kind,
                default=getattr(info.default, field.name, field.default),
                helptext=field_docs(RunConfig).get(field.name),
            )
        )
    return StructConstructorSpec(instantiate=RunConfig, fields=tuple(fields))
