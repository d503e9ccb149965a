"""One run is one file: a SQLite database that one process writes and any number read.

Evaluations are added as they are finished; a generation is closed in one transaction with what both
archives then contain and the state that resuming needs. Whatever moment the writer dies at, the file
holds whole generations, and the finished evaluations of the one that was under way.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, Self

from engine.config import RunConfig, to_json
from engine.errors import UNEXPECTED_DATA, DamagedRunFile, InvalidData, RunFileError, as_typed
from engine.search.algorithm import Snapshot
from engine.search.archive import cell_name
from engine.search.variation import GivenRobot
from engine.simulation.evaluation import Evaluation
from engine.simulation.provenance import Origin
from engine.storage.layouts import CompactTables, tables_of
from engine.storage.layouts.tables import Change, Closed
from engine.storage.lock import RunLock, is_being_written, lock_path
from engine.storage.rescue import Place, rescue
from engine.storage.schema import APPLICATION_ID, FORMAT_VERSION, SUFFIX, TABLES

LOG_LIMIT: Final = 8 * 1024 * 1024
"""Bytes to which the write-ahead log is cut back when all readers have let go of it."""
CLOSE_PATIENCE: Final = 2000
"""Milliseconds that closing waits for readers."""
__all__ = ["SUFFIX", "RunWriter", "is_being_written", "lock_path"]


class RunWriter:
    """The one process that may write a run. Use ``create`` or ``open``, then as a context manager."""

    def __init__(self, path: Path, connection: sqlite3.Connection, lock: RunLock) -> None:
        self.path = path
        self._db = connection
        self._lock = lock
        self._place = Place(path, connection)
        self._lost = False
        self._placed: dict[tuple[str, str], int] = {}
        self._tables = tables_of(self._query, connection.execute("PRAGMA user_version").fetchone()[0])

    @classmethod
    def create(
        cls,
        path: Path,
        config: RunConfig,
        versions: Mapping[str, str],
        projection: Mapping[str, str] | None = None,
        created_at: str = "",
        given: Sequence[GivenRobot] = (),
    ) -> Self:
        """Start a new run file.

        Args:
            path: of the file.
            config: of the run.
            versions: of what decides its outcome.
            projection: what its archives were projected from, for a run that was not evolved itself.
            created_at: UTC date and time, for a run that is saved anew; by default now.
            given: robots that it starts from.

        Raises:
            RunFileError: the file exists, or cannot be written there.
        """
        if path.suffix != SUFFIX:
            raise RunFileError(f"{path}: a run file's name ends in {SUFFIX}")
        if path.parent.exists() and not path.parent.is_dir():
            raise RunFileError(f"{path.parent} is not a folder; choose another place for the run")
        lock: RunLock | None = None
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            lock = RunLock.acquire(path)
            if path.exists():
                raise RunFileError(
                    f"{path} exists; continue it with 'tensatlas resume {as_typed(path)}' or choose another"
                    " name"
                )
            part = path.with_name(path.name + ".part")
            # what a killed process may have left beside a file that is gone: SQLite would replay it
            for suffix in (".part", ".part-journal", "-wal", "-shm"):
                path.with_name(path.name + suffix).unlink(missing_ok=True)
            meta: dict[str, Any] = {
                "config": to_json(config),
                "versions": dict(versions),
                "created_at": created_at or _now(),
            }
            if projection is not None:
                meta["projection"] = dict(projection)
            if given:
                meta["given"] = [robot.to_json() for robot in given]
            with new_tables(part, meta):
                pass
            # a reader never sees a half-made file
            part.replace(path)
            sync_folder(path)
            return cls(path, _connect_for_writing(path), lock)
        except BaseException as e:  # Ctrl-C too must leave nothing behind
            if lock is not None:
                with contextlib.suppress(OSError):
                    path.with_name(path.name + ".part").unlink(missing_ok=True)
                lock.release()
            if isinstance(e, (OSError, sqlite3.Error)):
                raise unwritable(path, e) from e
            raise

    @classmethod
    def open(cls, path: Path) -> Self:
        """Open an existing, already checked run file to resume it.

        Raises:
            RunFileError: another process is writing it, or it cannot be written.
        """
        lock: RunLock | None = None
        try:
            lock = RunLock.acquire(path)
            writer = cls(path, _connect_for_writing(path), lock)
            writer._tables.check_numbers()
            placed = {(archive, cell): n for _, archive, cell, n in writer._tables.changes(-1)}
            writer._placed = {k: n for k, n in placed.items() if n is not None}
            return writer
        except BaseException as e:
            if lock is not None:
                lock.release()
            if isinstance(e, (InvalidData, *UNEXPECTED_DATA)):
                raise DamagedRunFile(path, f"is damaged: {e}") from None
            if isinstance(e, (OSError, sqlite3.Error)):
                raise unwritable(path, e) from e
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def pending(self, generation: int) -> list[Evaluation]:
        """Return the finished evaluations of a generation that was not closed."""
        try:
            numbers = self._query("SELECT number FROM evaluations WHERE generation = ?", (generation,))
            return [e for _, e in self._tables.evaluations(n for (n,) in numbers)]
        except (sqlite3.Error, InvalidData, *UNEXPECTED_DATA) as e:
            raise DamagedRunFile(self.path, f"is damaged: {e}") from None

    def n_told(self, generation: int) -> int:
        """Return how many evaluations the generations before this one have."""
        query = "SELECT COUNT(*) FROM evaluations WHERE generation < ?"
        (n,) = self._db.execute(query, (generation,)).fetchone()
        return int(n)

    def n_failed(self) -> int:
        """Return how many of the saved evaluations failed."""
        (n,) = self._db.execute("SELECT COUNT(failure) FROM evaluations").fetchone()
        return int(n)

    def add_evaluations(
        self,
        generation: int,
        evaluations: Sequence[Evaluation],
        origins: Sequence[Origin | None] = (),
    ) -> None:
        """Save finished evaluations of a generation under way.

        Args:
            generation: theirs.
            evaluations: to save.
            origins: what computed each, if that is known.
        """
        with self._transaction():
            self._tables.add_evaluations(generation, evaluations, origins)

    def add_recorded(self, closed: Closed, changes: Sequence[Change]) -> None:
        """Save a generation as another file has it recorded; its evaluations are saved already."""
        with self._transaction():
            self._tables.add_generation(closed, changes)

    def set_recorded_state(self, generation: int, algorithm: str) -> None:
        """Save the state to resume from, JSON, as another file has it."""
        with self._transaction():
            self._tables.set_state(generation, algorithm)

    def close_generation(
        self, algorithm: Snapshot, statistics: Any, seconds: float, finished_at: str = ""
    ) -> None:
        """Close a generation: save the archives' changes, their statistics and the state.

        Args:
            algorithm: after its ``tell``.
            statistics: JSON-ready figures of the archives.
            seconds: computing time of the run so far.
            finished_at: UTC date and time, for a generation that is saved anew; by default now.
        """
        generation = algorithm.generation - 1
        held = {
            (name, cell_name(cell)): e.solution.number
            for name, archive in algorithm.archives.items()
            for cell, e in archive
        }
        gone = [(generation, *key, None) for key in self._placed if key not in held]
        new = [(generation, *key, n) for key, n in held.items() if self._placed.get(key) != n]
        with self._transaction():
            # there may be evaluations of later generations already
            (n, failed) = self._db.execute(
                "SELECT COUNT(*), COUNT(failure) FROM evaluations WHERE generation <= ?", (generation,)
            ).fetchone()
            figures = json.dumps(statistics)
            self._tables.add_generation(
                Closed(generation, n, failed, figures, finished_at or _now(), seconds), [*gone, *new]
            )
            self._tables.set_state(generation, json.dumps(algorithm.state()))
        self._placed = held

    def close(self) -> None:
        """Fold the write-ahead log into the file, so that the file alone is the run, and release the lock.

        Raises:
            RunFileError: the file is not there any more; what was finished is saved elsewhere, if it can be.
        """
        error = None
        if not self._lost and (happened := self._place.lost()):
            error = self._rescued(happened)
        if self._lost:
            self._place.leave()
        else:
            with contextlib.suppress(sqlite3.Error):
                self._db.execute(f"PRAGMA busy_timeout={CLOSE_PATIENCE}")
                # refused while another process reads; then the log stays beside the file until the next close
                self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
                self._db.execute("PRAGMA journal_mode=DELETE")
            self._db.close()
        self._lock.release()
        if error is not None:
            raise error

    def _query(self, sql: str, parameters: tuple[Any, ...] = ()) -> list[sqlite3.Row]:
        return self._db.execute(sql, parameters).fetchall()

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[None]:
        happened = self._place.lost()
        if happened is None:
            self._lock.check()
        else:
            self._place.keep_out()
        try:
            self._db.execute("BEGIN IMMEDIATE")
            yield
            self._db.execute("COMMIT")
        except BaseException as e:  # Ctrl-C too must not leave a transaction open
            with contextlib.suppress(sqlite3.Error):
                self._db.execute("ROLLBACK")
            if happened is None:
                if isinstance(e, sqlite3.Error):
                    raise unwritable(self.path, e) from e
                if isinstance(e, InvalidData):
                    raise DamagedRunFile(self.path, f"is damaged: {e}") from None
                raise
        if happened is not None:
            raise self._rescued(happened)
        self._place.note()

    def _rescued(self, happened: str) -> RunFileError:
        """Save a lost file, what was to be added to it included; return what to tell the user."""
        self._lost = True
        text = f"{self.path} {happened} while this process wrote it"
        try:
            saved = rescue(self.path, self._db)
        except RunFileError as e:
            return RunFileError(f"{text}, and {e}")
        return RunFileError(
            f"{text}; what was finished is saved in {saved}:"
            f" continue with 'tensatlas resume {as_typed(saved)}'"
        )


@contextlib.contextmanager
def new_tables(path: Path, meta: Mapping[str, Any]) -> Iterator[CompactTables]:
    """Make a run file and give its tables, to be filled in one transaction.

    Args:
        path: of the file.
        meta: facts about the whole run, JSON-ready, by key.
    """
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as db:
        db.executescript("PRAGMA page_size=4096; BEGIN;" + TABLES)
        db.execute(f"PRAGMA application_id={APPLICATION_ID}")
        db.execute(f"PRAGMA user_version={FORMAT_VERSION}")
        db.row_factory = sqlite3.Row
        tables = CompactTables(lambda sql, parameters=(): db.execute(sql, parameters).fetchall())
        tables.create({key: json.dumps(value) for key, value in meta.items()})
        yield tables
        db.execute("COMMIT")


def sync_folder(path: Path) -> None:
    """Make sure that a new name in a folder outlives a power cut, where the system can."""
    with contextlib.suppress(OSError):
        descriptor = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _connect_for_writing(path: Path) -> sqlite3.Connection:
    db = sqlite3.connect(path, isolation_level=None, timeout=60.0)
    db.row_factory = sqlite3.Row
    db.execute("PRAGMA journal_mode=WAL")
    db.execute("PRAGMA synchronous=FULL")
    db.execute(f"PRAGMA journal_size_limit={LOG_LIMIT}")
    return db


def unwritable(path: Path, error: Exception) -> RunFileError:
    """Return the error for a run that cannot be written."""
    reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    full = isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    # SQLite calls some full disks, quotas and limits an I/O error
    if full or getattr(error, "sqlite_errorname", "").startswith(("SQLITE_FULL", "SQLITE_IOERR")):
        reason += (
            "; what was finished is saved: make room there, then continue with"
            f" 'tensatlas resume {as_typed(path)}'"
            if path.exists()
            else "; make room there"
        )
    elif path.exists() and not os.access(path.parent, os.W_OK):
        log = path.with_name(path.name + "-wal")
        reason += f"; copy it{f' and {log.name}' * log.exists()} to a folder that can be written to"
    return RunFileError(f"{path} cannot be written: {reason}")


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
