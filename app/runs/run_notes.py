"""A user's note on a run, a text file beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from engine.errors import RunFileError, printable
from engine.files import open_file, write_files

MAX_NOTE: Final = 2000
"""Characters of the longest note."""


def note_path(path: Path) -> Path:
    """Return the file beside a run that holds its user's note."""
    return path.with_name(path.name + ".note.txt")


def note_of(path: Path) -> str:
    """Return the note on a run, empty if there is none or it cannot be read."""
    try:
        with open_file(note_path(path)) as f:
            return f.read(4 * MAX_NOTE).decode(errors="replace")[:MAX_NOTE]
    except OSError:
        return ""


def keep_note(path: Path, text: str) -> None:
    """Keep a note on a run; an empty one is none.

    Raises:
        RunFileError: it is too long, or cannot be written.
    """
    text = text.strip()
    if len(text) > MAX_NOTE:
        raise RunFileError(f"a note has at most {MAX_NOTE} characters, not {len(text)}")
    target = note_path(path)
    try:
        if text:
            write_files({target: text})
        else:
            target.unlink(missing_ok=True)
    except OSError as e:
        raise RunFileError(f"{printable(target.name)} cannot be written: {e.strerror}") from None
