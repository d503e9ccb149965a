"""Run files of an older format: a copy in the present one. The old file stays as it is.

Every older format can be read, shown and resumed as it is. What a newer format adds (digests, in 2), an old
file gets only in a copy, when the user asks for one.
"""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Final

from engine.errors import RunFileError
from engine.storage.database import connect
from engine.storage.lock import RunLock
from engine.storage.reader import RunReader
from engine.storage.rows import digest
from engine.storage.schema import DIGESTS, FORMAT_VERSION, ORIGINS, SUFFIX
from engine.storage.writer import sync_folder, unwritable


def migrate(path: Path, out: Path) -> int:
    """Write a copy of a run in the present format.

    Args:
        path: of the run; only read.
        out: of the file to create.

    Returns:
        The format of the run.

    Raises:
        RunFileError: the run cannot be read or has the present format, or ``out`` exists or cannot be
            written.
    """
    if out.suffix != SUFFIX:
        raise RunFileError(f"{out}: a run file's name ends in {SUFFIX}")
    with RunReader(path) as reader:
        before, version = reader.canonical_hash(), reader.format_version
    if version == FORMAT_VERSION:
        raise RunFileError(f"{path} has the present format ({FORMAT_VERSION}) already")
    part = out.with_name(out.name + ".part")
    lock: RunLock | None = None
    try:
        lock = RunLock.acquire(out)
        if out.exists():
            raise RunFileError(f"{out} exists; choose another name for the copy")
        part.unlink(missing_ok=True)
        with (
            contextlib.closing(connect(path)) as old,
            contextlib.closing(sqlite3.connect(part, isolation_level=None)) as new,
        ):
            old.backup(new)
            new.execute("PRAGMA journal_mode=DELETE")
            new.execute("BEGIN")
            for step in range(version, FORMAT_VERSION):
                _STEPS[step](new)
            new.execute(f"PRAGMA user_version={FORMAT_VERSION}")
            new.execute("COMMIT")
        with RunReader(part) as reader:
            if reader.canonical_hash() != before:
                raise RunFileError(
                    f"{path} was changed while it was copied; try again when no process writes it"
                )
        part.replace(out)
        sync_folder(out)
    except (OSError, sqlite3.Error) as e:
        raise unwritable(out, e) from e
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        if lock is not None:
            lock.release()
    return version


def _add_digests_and_origins(db: sqlite3.Connection) -> None:
    for table in (DIGESTS, *ORIGINS):
        db.execute(table)
    for row in db.execute("SELECT * FROM evaluations"):
        db.execute("INSERT INTO digests VALUES (?, ?)", (row[0], digest(row)))


_STEPS: Final[dict[int, Callable[[sqlite3.Connection], None]]] = {1: _add_digests_and_origins}
"""Functions that convert a file from each format to the next."""
