"""A run file that is removed, replaced or overwritten while it is written: noticed, and saved elsewhere.

SQLite goes on writing a file that no name leads to any more, and all would be lost when it is closed. As long
as it is open, its content can be read and copied.
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
import tempfile
import urllib.parse
from pathlib import Path

from engine.errors import RunFileError, TensAtlasError
from engine.storage.database import connect
from engine.storage.schema import SUFFIX


class Place:
    """Where a run file lies, as its writer knows it.

    Args:
        path: of the file.
        db: the writer's connection to it.
    """

    def __init__(self, path: Path, db: sqlite3.Connection) -> None:
        self._path, self._db = path, db
        found = path.stat()
        self._identity = found.st_dev, found.st_ino
        self._meta = _meta(db)
        self.note()

    def note(self) -> None:
        """Remember the file as it is now, after a transaction of its writer."""
        self._newest = _newest(self._db)
        with contextlib.suppress(OSError):  # found out before the next transaction
            self._stamp = _stamp(self._path.stat())
        self._log = _identity(_beside(self._path, "-wal"))

    def lost(self) -> str | None:
        """Return what has happened to the file, as a predicate; None if it is what the writer left there."""
        try:
            found = self._path.stat()
        except FileNotFoundError:
            return "was removed"
        except OSError:
            return None  # SQLite says so when it writes
        if (found.st_dev, found.st_ino) != self._identity:
            return "was replaced by another file"
        if _stamp(found) != self._stamp and not self._holds_what_was_written():
            return "was overwritten"
        return None

    def keep_out(self) -> None:
        """Write nothing more into the file that is there now: what follows goes to the log alone."""
        with contextlib.suppress(sqlite3.Error):
            self._db.execute("PRAGMA wal_autocheckpoint=0")

    def leave(self) -> None:
        """Close the writer's connection and remove its log, without a trace in the file that is there now."""
        # SQLite writes the log into the file when the last connection is closed; this one cannot
        where = f"file:{urllib.parse.quote(os.fsencode(self._path.absolute()))}?mode=ro"
        with (
            contextlib.suppress(sqlite3.Error),
            contextlib.closing(sqlite3.connect(where, uri=True)) as other,
        ):
            with contextlib.suppress(sqlite3.Error):
                other.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()
            self._db.close()
            self._remove_log()
        self._db.close()
        self._remove_log()

    def _remove_log(self) -> None:
        """Remove the log that belongs to the lost file, so that SQLite never adds it to the one there now."""
        if self._log is None or _identity(_beside(self._path, "-wal")) != self._log:
            return
        for suffix in ("-wal", "-shm"):
            with contextlib.suppress(OSError):
                _beside(self._path, suffix).unlink()

    def _holds_what_was_written(self) -> bool:
        """Look into a file whose time stamp is not the writer's: that alone may be anybody's doing."""
        try:
            with contextlib.closing(connect(self._path)) as db:
                whole = db.execute("PRAGMA quick_check(1)").fetchone()[0] == "ok"
                return whole and _meta(db) == self._meta and _newest(db) == self._newest
        except (sqlite3.Error, TensAtlasError):
            return False


def rescue(path: Path, db: sqlite3.Connection) -> Path:
    """Save what a connection still reads of a lost file beside where it was, or in the system's own place.

    Returns:
        The path of the file made.

    Raises:
        RunFileError: it is not whole any more, or can be written nowhere.
    """
    reason: object = ""
    for folder in (path.absolute().parent, Path(tempfile.gettempdir())):
        part = folder / f"{path.stem}-rescued{SUFFIX}.part"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            part.unlink(missing_ok=True)
            with contextlib.closing(sqlite3.connect(part, isolation_level=None)) as new:
                db.backup(new)
                new.execute("PRAGMA journal_mode=DELETE")
                if (found := new.execute("PRAGMA quick_check(1)").fetchone()[0]) != "ok":
                    raise sqlite3.DatabaseError(found)
            return _settle(part)
        except (OSError, sqlite3.Error) as e:
            reason = reason or e
            with contextlib.suppress(OSError):
                part.unlink(missing_ok=True)
    raise RunFileError(f"it cannot be saved elsewhere: {reason}")


def _settle(part: Path) -> Path:
    """Give a file its name, one that no other has."""
    whole = part.with_suffix("")
    k = 1
    while (target := whole if k == 1 else whole.with_name(f"{whole.stem}-{k}{SUFFIX}")).exists():
        k += 1
    return part.rename(target)


def _meta(db: sqlite3.Connection) -> list[tuple[str, str]]:
    return [(str(k), str(v)) for k, v in db.execute("SELECT key, value FROM meta ORDER BY key")]


def _newest(db: sqlite3.Connection) -> tuple[int | None, int | None]:
    query = "SELECT (SELECT MAX(number) FROM evaluations), (SELECT MAX(generation) FROM generations)"
    number, generation = db.execute(query).fetchone()
    return number, generation


def _stamp(found: os.stat_result) -> tuple[int, int]:
    return found.st_mtime_ns, found.st_size


def _beside(path: Path, suffix: str) -> Path:
    return path.with_name(path.name + suffix)


def _identity(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino
