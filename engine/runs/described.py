"""A run described in a TOML file, by what differs from a preset or by every field of its configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from engine.config import DEFAULT_PRESET, RunConfig, every_value, from_json, preset, to_json
from engine.errors import InvalidData, TensAtlasError
from engine.files import read_toml, toml_text


def read_described(path: Path, chosen: str | None = None) -> RunConfig:
    """Return the configuration that a file describes; docs/using.md describes the file.

    Args:
        path: of the file.
        chosen: preset that has what the file leaves out; by default the one that the file names, or
            ``DEFAULT_PRESET``.

    Raises:
        InvalidData: it cannot be read, or a value is unknown, of the wrong type or does not fit the rest.
    """
    data = read_toml(path)
    named = data.pop("preset", DEFAULT_PRESET)
    try:
        if not isinstance(named, str):
            raise InvalidData(f"preset must be a name, not {named!r}")
        return from_json(merged(to_json(preset(named if chosen is None else chosen)), data))
    except TensAtlasError as e:
        raise InvalidData(f"{path}: {e}") from None


def describe(config: RunConfig) -> str:
    """Return TOML text that ``read_described`` reads as a configuration, whatever the presets are by then."""
    return toml_text(every_value(config))


def merged(base: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    """Return a configuration's values with some replaced, tables within it field by field."""
    return base | {
        key: merged(base[key], value)
        if isinstance(value, dict) and isinstance(base.get(key), dict)
        else value
        for key, value in own.items()
    }
