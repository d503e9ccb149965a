"""Which files this process opens by itself; SQLite's own opening is not seen."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

_installed: list[bool] = []
_seen: list[Path] | None = None


def _hook(event: str, arguments: tuple[object, ...]) -> None:
    if _seen is not None and event == "open" and isinstance(arguments[0], str | bytes | os.PathLike):
        _seen.append(Path(os.path.realpath(os.fsdecode(arguments[0]))))


@contextlib.contextmanager
def files_opened() -> Iterator[list[Path]]:
    """Return a list to which every file is added that the process opens during the ``with`` block."""
    global _seen
    if not _installed:
        sys.addaudithook(_hook)  # cannot be removed
        _installed.append(True)
    _seen = []
    try:
        yield _seen
    finally:
        _seen = None
