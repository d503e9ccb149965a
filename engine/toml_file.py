"""Reading TOML that a user wrote."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from engine.errors import InvalidData


def read_toml(path: Path) -> dict[str, Any]:
    """Read a file.

    Raises:
        InvalidData: it cannot be read or is no TOML; the message names it.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as e:
        raise InvalidData(f"{path} cannot be read: {e.strerror or e}") from None
    except UnicodeDecodeError:
        raise InvalidData(f"{path} cannot be read: it is not UTF-8 text") from None
    return parse_toml(text, file=str(path))


def parse_toml(text: str, *, file: str) -> dict[str, Any]:
    """Read text; ``file`` names it in messages.

    Raises:
        InvalidData: it is no TOML, or nested beyond all measure.
    """
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as e:
        raise InvalidData(f"{file}: not a TOML file: {e}") from None
