"""Run files as a user names them: one by one, or by their folders."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from engine.errors import InvalidData, printable
from engine.storage.schema import SUFFIX


def run_files(places: Sequence[Path]) -> tuple[list[Path], list[str]]:
    """Return the run files of files and folders, each once, and a note on those named twice.

    Raises:
        InvalidData: a folder has none.
    """
    found: dict[Path, Path] = {}
    notes = []
    for place in places:
        files = sorted(place.glob(f"*{SUFFIX}")) if place.is_dir() else [place]
        if not files:
            raise InvalidData(f"the folder {place} has no run files (*{SUFFIX})")
        for file in files:
            if found.setdefault(file.resolve(), file) is not file:
                notes.append(f"{printable(str(file))} is named more than once; it counts once.")
    return list(found.values()), notes
