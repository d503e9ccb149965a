"""Short names of runs, which tell those on offer apart in lists and in addresses."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from engine.errors import printable

_FOLDERS: Final = re.compile(r"(?<![\w./~])/(?:[^/\s'\"`,;:()<>]+/)+")
"""Folders of an absolute path, up to the name at its end."""


def label_paths(paths: Sequence[Path]) -> dict[str, Path]:
    """Return short, distinct labels for run files: with as many folders of the path as needed."""
    labels: dict[str, Path] = {}
    for path in paths:
        parts = _parts(path)
        label = next(
            ("/".join(parts[-n:]) for n in range(1, len(parts)) if _n_ending(paths, parts[-n:]) == 1),
            printable(str(path)),
        )
        labels[label] = path
    return labels


def run_name(path: Path, paths: Sequence[Path]) -> str | None:
    """Return the name of a run among those on offer."""
    return next((label for label, p in label_paths(paths).items() if p == path), None)


def find_run(name: str, paths: Sequence[Path]) -> Path | None:
    """Return the run on offer that a name stands for, or None; names are never used as paths."""
    labels = label_paths(paths)
    if name in labels:
        return labels[name]
    # when the name was written, there may have been fewer or more runs that end in it
    end = tuple(part for part in name.removesuffix(".tsmr").split("/") if part)
    ways = [end[-n:] for n in range(len(end), 0, -1)]
    return next((p for way in ways for p in paths if _parts(p)[-len(way) :] == way), None)


def without_folders(text: str, folders: Iterable[Path]) -> str:
    """Return a text for visitors: they need not know where the files lie that it names.

    Args:
        text: of an error.
        folders: that may be in it; others are found by their form, as far as they have no spaces.
    """
    for folder in sorted(map(str, folders), key=len, reverse=True):
        if len(folder) > 1:
            text = text.replace(f"{folder}/", "").replace(folder, "its folder")
    return _FOLDERS.sub("", text)


def _parts(path: Path) -> tuple[str, ...]:
    return tuple(map(printable, path.with_suffix("").parts))


def _n_ending(paths: Sequence[Path], end: tuple[str, ...]) -> int:
    return sum(_parts(p)[-len(end) :] == end for p in paths)
