"""The database in a run file, opened for reading; files may come from strangers, so all is checked."""

from __future__ import annotations

import errno
import os
import sqlite3
import stat
import tempfile
import threading
import urllib.parse
from pathlib import Path
from typing import Any, Final

from engine.errors import (
    UNEXPECTED_DATA,
    DamagedRunFile,
    InvalidData,
    RunFileError,
    TensAtlasError,
    UnknownTask,
    one_line,
)
from engine.storage.lock import is_being_written
from engine.storage.raw import raw_bytes, raw_copy
from engine.storage.schema import APPLICATION_ID, COLUMNS, FORMAT_VERSION

_HEADER: Final = b"SQLite format 3\x00"


class RunDatabase:
    """A run file's tables; may be shared by threads and used while the run is written.

    Attributes:
        path: of the file.
        format_version: that it was written in.

    Raises:
        RunFileError: the file is missing, empty, cut short, of another program or a newer version.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._mutex = threading.Lock()
        self._db = connect(path)
        try:
            self._check_format()
        except TensAtlasError:
            self.close()
            raise

    def close(self) -> None:
        """Close the file."""
        with self._mutex:
            self._db.close()

    def query(self, sql: str, parameters: tuple[Any, ...] = ()) -> list[sqlite3.Row]:
        """Return the rows that a query finds.

        Raises:
            RunFileError: the file cannot be read or is damaged.
        """
        try:
            with self._mutex:
                return self._db.execute(sql, parameters).fetchall()
        except (sqlite3.Error, OverflowError, UnicodeDecodeError, MemoryError) as e:
            raise _unreadable(self.path, e) from None

    def guard(self) -> Damage:
        """Return a context that reports unexpected data as damage to this file."""
        return Damage(self.path)

    def _check_format(self) -> None:
        if self.query("PRAGMA application_id")[0][0] != APPLICATION_ID:
            raise RunFileError(f"{self.path} is a database of another program, not a TensAtlas run")
        version = self.format_version = int(self.query("PRAGMA user_version")[0][0])
        if version not in COLUMNS and version <= FORMAT_VERSION:
            raise DamagedRunFile(self.path, f"is damaged: it says that its format is {version}")
        if version > FORMAT_VERSION:
            raise RunFileError(
                f"{self.path} was written by a newer TensAtlas (format {version}, this one reads"
                f" {FORMAT_VERSION}); update TensAtlas"
            )
        self._check_tables()

    def _check_tables(self) -> None:
        """Make sure that there are plain tables only: a view or a computed column could run for ever."""
        names = set()
        for kind, name in self.query("SELECT type, name FROM sqlite_master"):
            if kind not in ("table", "index"):
                raise RunFileError(f"{self.path} is not a TensAtlas run file: it has a {kind}, {name!r:.60}")
            names.add(name)
        newest = max((v for v, tables in COLUMNS.items() if names.issuperset(tables)), default=0)
        if newest > self.format_version:
            raise DamagedRunFile(
                self.path, f"is damaged: it says that its format is {self.format_version}, not {newest}"
            )
        for table, columns in COLUMNS[self.format_version].items():
            found = {r[1]: r[6] for r in self.query(f"PRAGMA table_xinfo({table})")}
            if not set(found).issuperset(columns.split()):
                raise DamagedRunFile(self.path, f"is damaged: table {table} is not as expected")
            if any(found.values()):  # 0 is an ordinary column; others are computed or hidden
                raise RunFileError(f"{self.path} is not a TensAtlas run file: {table} has computed columns")


class Damage:
    """Turns any error that unexpected data causes into one clear message."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, UnknownTask):
            raise RunFileError(f"{self._path} cannot be opened: {error}") from None
        if isinstance(error, (InvalidData, *UNEXPECTED_DATA)):
            raise DamagedRunFile(self._path, f"is damaged: {error}") from None


def connect(path: Path) -> sqlite3.Connection:
    """Open a run file's database for reading.

    Raises:
        RunFileError: it cannot be read.
    """
    _check_file(path)
    where = f"file:{urllib.parse.quote(os.fsencode(path.absolute()))}?mode=ro"
    try:
        return _opened(where)
    except (sqlite3.Error, UnicodeDecodeError) as e:
        error = e
    if _code(error) in _NO_ROOM_BESIDE and not is_being_written(path):
        try:
            return _copied(path) if _has_log(path) else _opened(f"{where}&immutable=1")
        except OSError as e:
            raise RunFileError(
                f"{path} cannot be read where it is, because nothing can be written beside it, nor copied to"
                f" {tempfile.gettempdir()}: {e.strerror or e}; copy it and {path.name}-wal to another folder"
            ) from None
        except (sqlite3.Error, UnicodeDecodeError) as e:
            error = e
    raise _not_opened(path, error)


_NO_ROOM_BESIDE: Final = (
    sqlite3.SQLITE_CANTOPEN,
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_IOERR,
)
"""How SQLite fails where it cannot make the files that it shares with other readers."""


def _opened(where: str) -> sqlite3.Connection:
    db = sqlite3.connect(where, uri=True, timeout=30.0, check_same_thread=False)
    try:
        db.row_factory = sqlite3.Row
        db.execute("PRAGMA trusted_schema=OFF")
        db.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()
    except BaseException:
        db.close()
        raise
    return db


def _copied(path: Path) -> sqlite3.Connection:
    """Open a copy of a run whose log cannot be read where it is, as on read-only media.

    Raises:
        OSError: there is no room for it.
    """
    with tempfile.TemporaryDirectory(prefix="tensatlas-") as folder:
        copy = Path(folder) / "run"
        for suffix in ("", "-wal"):
            raw_copy(path.with_name(path.name + suffix), copy.with_name(copy.name + suffix))
        db = _opened(f"file:{urllib.parse.quote(os.fsencode(copy))}")
        try:
            db.execute("PRAGMA journal_mode=DELETE")  # the file alone is the run now
            db.execute("PRAGMA query_only=ON")
        except sqlite3.Error:
            db.close()
            raise
        return db  # an open file outlives its name


def _has_log(path: Path) -> bool:
    try:
        return path.with_name(path.name + "-wal").stat().st_size > 0
    except OSError:
        return False


def _code(error: Exception) -> int:
    """Return SQLite's number of an error, without the part that says which kind of it."""
    return int(getattr(error, "sqlite_errorcode", 0)) & 0xFF


def _check_file(path: Path) -> None:
    """Make sure that there is a file that can hold a run. It is not opened: see ``engine.storage.raw``."""
    try:
        found = path.stat()
    except FileNotFoundError:
        raise RunFileError(f"{path} does not exist") from None
    except OSError as e:
        raise RunFileError(f"{path} cannot be read: {e.strerror}") from None
    obstacle = (
        errno.EISDIR if stat.S_ISDIR(found.st_mode) else 0 if os.access(path, os.R_OK) else errno.EACCES
    )
    if obstacle:
        raise RunFileError(f"{path} cannot be read: {os.strerror(obstacle)}")
    if not stat.S_ISREG(found.st_mode):
        raise RunFileError(f"{path} is not a TensAtlas run file")
    if not found.st_size:
        raise RunFileError(f"{path} is empty")


def _unreadable(path: Path, error: Exception) -> RunFileError:
    """Return the error for a run that SQLite cannot read: damage, or an obstacle such as permissions."""
    in_the_way = (sqlite3.OperationalError, sqlite3.ProgrammingError, OverflowError)
    text = one_line(str(error))[:200] or "it asks for more memory than there is"
    if isinstance(error, in_the_way) and not any(w in text for w in ("malformed", "decode", "no such")):
        return RunFileError(f"{path} cannot be read: {text}")
    return DamagedRunFile(path, f"cannot be read: {text}")


def _not_opened(path: Path, error: Exception) -> RunFileError:
    """Return the error for a file that SQLite does not open; its first bytes say more than SQLite does."""
    if _code(error) not in (sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT):
        return _unreadable(path, error)
    try:
        header, size = raw_bytes(path, 4096), path.stat().st_size
    except OSError as e:
        return RunFileError(f"{path} cannot be read: {e.strerror}")
    if not header.startswith(_HEADER) or len(header) < 100:
        if b"CREATE TABLE evaluations" in header:
            return DamagedRunFile(path, "is damaged: its first bytes are wrong")
        return RunFileError(f"{path} is not a TensAtlas run file")
    page = int.from_bytes(header[16:18], "big")
    expected = (65536 if page == 1 else page) * int.from_bytes(header[28:32], "big")
    if size < expected and not path.with_name(path.name + "-wal").exists():
        return DamagedRunFile(path, f"is cut short: {size} of {expected} bytes")
    return _unreadable(path, error)
