"""What a user does to the files of a run: another name, the bin."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from pathlib import Path
from typing import Final

from app.runs.launcher import check_name, log_path, paused_path
from app.runs.run_notes import note_path
from engine.analysis.robustness import robust_path
from engine.errors import RunFileError, printable
from engine.storage.lock import is_being_written, lock_path
from engine.storage.schema import SUFFIX, failures_folder

BIN: Final = "bin"
"""Folder beside a run that deleted runs go to, each in a folder of its own."""


def rename(path: Path, name: str) -> Path:
    """Give a run, and all that belongs to it, another name in its folder; return its new path.

    Raises:
        InvalidData: a file cannot have that name.
        RunFileError: it is being written, the name is taken, or the files cannot be moved.
    """
    target = path.with_name(f"{check_name(name)}{SUFFIX}")
    if target == path:
        return path
    _check_at_rest(path)
    for rename_to in _belongings(target):
        if rename_to.exists():
            raise RunFileError(f"{printable(rename_to.name)} exists already; choose another name")
    _move(path, target)
    return target


def to_bin(path: Path) -> Path:
    """Move a run, and all that belongs to it, to the bin beside it; return where it is now.

    Raises:
        RunFileError: it is being written, or the files cannot be moved.
    """
    _check_at_rest(path)
    day = datetime.datetime.now().strftime("%Y-%m-%d-%H%M%S-%f")
    folder = path.parent / BIN / f"{path.stem}-{day}"
    try:
        folder.mkdir(parents=True)
    except OSError as e:
        raise RunFileError(f"{printable(str(folder))} cannot be made: {e.strerror}") from None
    _move(path, folder / path.name)
    return folder / path.name


def _check_at_rest(path: Path) -> None:
    if not path.exists():
        raise RunFileError(f"{printable(path.name)} does not exist any more")
    if is_being_written(path):
        raise RunFileError(f"{printable(path.name)} is being written; stop it first")


def _belongings(path: Path) -> list[Path]:
    """Return the run file and all that may lie beside it, the file itself first."""
    beside: tuple[Callable[[Path], Path], ...] = (
        lambda p: p.with_name(p.name + "-wal"),
        lambda p: p.with_name(p.name + "-shm"),
        lock_path,
        paused_path,
        note_path,
        log_path,
        robust_path,
        failures_folder,
    )
    return [path, *(place(path) for place in beside)]


def _move(path: Path, target: Path) -> None:
    """Move a run's belongings; if one cannot be moved, put the others back."""
    done: list[tuple[Path, Path]] = []
    try:
        for old, new in zip(_belongings(path), _belongings(target), strict=True):
            if old.exists():
                old.rename(new)
                done.append((old, new))
    except OSError as e:
        for old, new in reversed(done):
            new.rename(old)
        raise RunFileError(f"{printable(path.name)} cannot be moved: {e.strerror}") from None
