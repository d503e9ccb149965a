"""The database in a run file, opened for reading; files may come from strangers, so all is checked."""

from __future__ import annotations

import os
import sqlite3
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
        _check_header(path)
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
    where = urllib.parse.quote(str(path.absolute()))
    error: Exception | None = None
    modes = ["mode=ro"]
    if not os.access(path.parent, os.W_OK) and not path.with_name(path.name + "-wal").exists():
        # SQLite cannot lock a file there, and no process can be changing it
        modes.append("mode=ro&immutable=1")
    for options in modes:
        try:
            db = sqlite3.connect(f"file:{where}?{options}", uri=True, timeout=30.0, check_same_thread=False)
            db.row_factory = sqlite3.Row
            db.execute("PRAGMA trusted_schema=OFF")
            db.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()
            return db
        except (sqlite3.Error, UnicodeDecodeError) as e:
            error = e
    raise _unreadable(path, error)


def _unreadable(path: Path, error: Exception | None) -> RunFileError:
    """Return the error for a run that SQLite cannot read: damage, or an obstacle such as permissions."""
    in_the_way = (sqlite3.OperationalError, sqlite3.ProgrammingError, OverflowError)
    text = one_line(str(error))[:200] or "it asks for more memory than there is"
    if isinstance(error, in_the_way) and not any(w in text for w in ("malformed", "decode", "no such")):
        return RunFileError(f"{path} cannot be read: {text}")
    return DamagedRunFile(path, f"cannot be read: {text}")


def _check_header(path: Path) -> None:
    try:
        size = path.stat().st_size
        with open(path, "rb") as f:
            header = f.read(4096)
    except FileNotFoundError:
        raise RunFileError(f"{path} does not exist") from None
    except OSError as e:
        raise RunFileError(f"{path} cannot be read: {e.strerror}") from None
    if not size:
        raise RunFileError(f"{path} is empty")
    if not header.startswith(_HEADER) or len(header) < 100:
        if b"CREATE TABLE evaluations" in header:
            raise DamagedRunFile(path, "is damaged: its first bytes are wrong")
        raise RunFileError(f"{path} is not a TensAtlas run file")
    page = int.from_bytes(header[16:18], "big")
    expected = (65536 if page == 1 else page) * int.from_bytes(header[28:32], "big")
    if size < expected and not path.with_name(path.name + "-wal").exists():
        raise DamagedRunFile(path, f"is cut short: {size} of {expected} bytes")
