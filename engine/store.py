"""One run is one file: a SQLite database that one process writes and any number read.

Evaluations are added as they are finished; a generation is closed in one transaction with what both
archives then contain and the state that resuming needs. Whatever moment the writer dies at, the file
holds whole generations, and the finished evaluations of the one that was under way.
"""

from __future__ import annotations

import contextlib
import dataclasses
import fcntl
import json
import os
import sqlite3
import time
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, Self

from engine.algorithms.snapshot import Snapshot
from engine.computer import Computer, Origin
from engine.config import RunConfig, to_json
from engine.errors import InvalidData, RunFileError
from engine.evaluation import Evaluation
from engine.records import cell_name, from_row, to_row
from engine.schema import APPLICATION_ID, FORMAT_VERSION, ORIGINS, TABLES

SUFFIX: Final = ".tsmr"


def lock_path(path: Path) -> Path:
    """Return the file whose lock says that a process is writing a run."""
    return path.with_name(path.name + ".lock")


def is_being_written(path: Path) -> bool:
    """Tell whether a living process is writing a run."""
    try:
        with open(lock_path(path), "rb") as f:
            try:
                fcntl.flock(f, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return True
            return False
    except OSError:
        return False


class RunWriter:
    """The one process that may write a run. Use ``create`` or ``open``, then as a context manager."""

    def __init__(self, path: Path, connection: sqlite3.Connection, lock: int) -> None:
        self.path = path
        self._db = connection
        self._lock = lock
        self._placed: dict[tuple[str, str], int] = {}

    @classmethod
    def create(
        cls,
        path: Path,
        config: RunConfig,
        versions: Mapping[str, str],
        projection: Mapping[str, str] | None = None,
    ) -> Self:
        """Start a new run file.

        Args:
            path: of the file.
            config: of the run.
            versions: of what decides its outcome.
            projection: what its archives were projected from, for a run that was not evolved itself.

        Raises:
            RunFileError: the file exists, or cannot be written there.
        """
        if path.suffix != SUFFIX:
            raise RunFileError(f"{path}: a run file's name ends in {SUFFIX}")
        if path.parent.exists() and not path.parent.is_dir():
            raise RunFileError(f"{path.parent} is not a folder; choose another place for the run")
        lock = -1
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            lock = _acquire(path)
            if path.exists():
                _release(path, lock)
                raise RunFileError(
                    f"{path} exists; continue it with 'tensatlas resume {path}' or choose another name"
                )
            part = path.with_name(path.name + ".part")
            # what a killed process may have left beside a file that is gone: SQLite would replay it
            for suffix in (".part", ".part-journal", "-wal", "-shm"):
                path.with_name(path.name + suffix).unlink(missing_ok=True)
            with contextlib.closing(sqlite3.connect(part, isolation_level=None)) as db:
                db.executescript("PRAGMA page_size=4096; BEGIN;" + TABLES)
                db.execute(f"PRAGMA application_id={APPLICATION_ID}")
                db.execute(f"PRAGMA user_version={FORMAT_VERSION}")
                meta = {
                    "config": to_json(config),
                    "versions": dict(versions),
                    "created_at": _now(),
                }
                if projection is not None:
                    meta["projection"] = dict(projection)
                for key, value in meta.items():
                    db.execute("INSERT INTO meta VALUES (?, ?)", (key, json.dumps(value)))
                db.execute("COMMIT")
            # a reader never sees a half-made file
            part.replace(path)
            return cls(path, _connect_for_writing(path), lock)
        except (OSError, sqlite3.Error) as e:
            _release(path, lock)
            raise RunFileError(f"{path} cannot be written: {_reason(e)}") from e

    @classmethod
    def open(cls, path: Path) -> Self:
        """Open an existing, already checked run file to go on with it.

        Raises:
            RunFileError: another process is writing it, or it cannot be written.
        """
        lock = -1
        try:
            lock = _acquire(path)
            writer = cls(path, _connect_for_writing(path), lock)
            writer._db.executescript(ORIGINS)
            for archive, cell, evaluation in writer._db.execute(
                "SELECT archive, cell, evaluation FROM placements ORDER BY generation"
            ):
                writer._placed[archive, cell] = evaluation
            writer._placed = {k: v for k, v in writer._placed.items() if v is not None}
            return writer
        except (OSError, sqlite3.Error) as e:
            _release(path, lock)
            raise RunFileError(f"{path} cannot be written: {_reason(e)}") from e

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def pending(self, generation: int) -> list[Evaluation]:
        """Return the finished evaluations of a generation that was not closed."""
        try:
            rows = self._db.execute(
                "SELECT * FROM evaluations WHERE generation = ? ORDER BY number", (generation,)
            )
            return [from_row(row) for row in rows]
        except (sqlite3.Error, InvalidData) as e:
            raise RunFileError(f"{self.path} is damaged: {e}") from None

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
            self._db.executemany(
                f"INSERT INTO evaluations VALUES ({','.join('?' * 12)})",
                [to_row(generation, e) for e in evaluations],
            )
            for e, origin in zip(evaluations, origins, strict=False):
                if origin is not None:
                    self._db.execute(
                        "INSERT INTO computed VALUES (?, ?, ?)",
                        (e.solution.number, self._computer_id(origin.computer), origin.seconds),
                    )

    def _computer_id(self, computer: Computer) -> int:
        facts = json.dumps(dataclasses.asdict(computer), sort_keys=True)
        self._db.execute("INSERT OR IGNORE INTO computers (facts) VALUES (?)", (facts,))
        (number,) = self._db.execute("SELECT id FROM computers WHERE facts = ?", (facts,)).fetchone()
        return int(number)

    def close_generation(self, algorithm: Snapshot, statistics: Any, seconds: float) -> None:
        """Save what a generation left behind: the archives' changes, their statistics, the state.

        Args:
            algorithm: after its ``tell``.
            statistics: JSON-ready figures of the archives.
            seconds: computing time of the run so far.
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
            (n, failed) = self._db.execute(
                "SELECT COUNT(*), COUNT(failure) FROM evaluations WHERE generation <= ?", (generation,)
            ).fetchone()
            self._db.executemany("INSERT INTO placements VALUES (?, ?, ?, ?)", [*gone, *new])
            self._db.execute(
                "INSERT INTO generations VALUES (?, ?, ?, ?, ?, ?)",
                (generation, n, failed, json.dumps(statistics), _now(), seconds),
            )
            self._db.execute(
                "INSERT OR REPLACE INTO state VALUES (1, ?, ?)",
                (generation, json.dumps(algorithm.state())),
            )
        self._placed = held

    def close(self) -> None:
        """Fold the write-ahead log into the file, so that the file alone is the run, and let go."""
        with contextlib.suppress(sqlite3.Error):
            # refused while somebody reads; then the log stays beside the file until the next close
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            self._db.execute("PRAGMA journal_mode=DELETE")
        self._db.close()
        _release(self.path, self._lock)

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[None]:
        try:
            self._db.execute("BEGIN IMMEDIATE")
            yield
            self._db.execute("COMMIT")
        except BaseException as e:  # Ctrl-C too must not leave a transaction open
            with contextlib.suppress(sqlite3.Error):
                self._db.execute("ROLLBACK")
            if isinstance(e, sqlite3.Error):
                raise RunFileError(f"{self.path} cannot be written: {_reason(e)}") from e
            raise


def _connect_for_writing(path: Path) -> sqlite3.Connection:
    db = sqlite3.connect(path, isolation_level=None, timeout=60.0)
    db.row_factory = sqlite3.Row
    db.execute("PRAGMA journal_mode=WAL")
    db.execute("PRAGMA synchronous=FULL")
    return db


def _acquire(path: Path) -> int:
    lock = os.open(lock_path(path), os.O_RDWR | os.O_CREAT, 0o644)
    deadline = time.monotonic() + 1.0
    while True:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_at(lock, lock_path(path)):
                break
            # its last holder removed the file between our open and our lock
            os.close(lock)
            lock = os.open(lock_path(path), os.O_RDWR | os.O_CREAT, 0o644)
        except BlockingIOError:
            if time.monotonic() < deadline:  # a reader may be asking whether the run is live
                time.sleep(0.02)
                continue
            holder = os.read(lock, 20).decode(errors="replace").strip() or "unknown"
            os.close(lock)
            raise RunFileError(f"{path} is being written by another process ({holder})") from None
    os.ftruncate(lock, 0)
    os.write(lock, str(os.getpid()).encode())
    return lock


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _release(path: Path, lock: int) -> None:
    if lock >= 0:
        with contextlib.suppress(OSError):
            lock_path(path).unlink()
        os.close(lock)


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return str(error)


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
