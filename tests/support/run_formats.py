"""Run files of older formats, and ones that were changed by hand and say that they were written so."""

import contextlib
import itertools
import sqlite3

from benchmarks.sealed import seal_again
from engine.storage.layouts import tables_of
from engine.storage.layouts.compact import SEAL, packed, unpacked
from engine.storage.reader import RunReader
from engine.storage.schema import APPLICATION_ID

FIRST = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE evaluations (
    number INTEGER PRIMARY KEY,
    generation INTEGER NOT NULL,
    morphology TEXT NOT NULL,
    controller TEXT NOT NULL,
    parent INTEGER,
    operator TEXT NOT NULL,
    source TEXT,
    fitness REAL,
    distances TEXT NOT NULL,
    trajectory BLOB NOT NULL,
    head_is_end INTEGER NOT NULL,
    failure TEXT
);
CREATE TABLE generations (
    generation INTEGER PRIMARY KEY,
    n_evaluations INTEGER NOT NULL,
    n_failed INTEGER NOT NULL,
    archives TEXT NOT NULL,
    finished_at TEXT NOT NULL,
    seconds REAL NOT NULL
);
CREATE TABLE placements (
    generation INTEGER NOT NULL,
    archive TEXT NOT NULL,
    cell TEXT NOT NULL,
    evaluation INTEGER,
    PRIMARY KEY (archive, cell, generation)
) WITHOUT ROWID;
CREATE TABLE state (
    id INTEGER PRIMARY KEY CHECK (id = 1),
    generation INTEGER NOT NULL,
    algorithm TEXT NOT NULL
);
"""
SECOND = """
CREATE TABLE digests (number INTEGER PRIMARY KEY, digest BLOB NOT NULL);
CREATE TABLE computers (id INTEGER PRIMARY KEY, facts TEXT NOT NULL UNIQUE);
CREATE TABLE computed (evaluation INTEGER PRIMARY KEY, computer INTEGER NOT NULL, seconds REAL);
"""


def in_format(path, out, version):
    """Write a run as an older program had written it."""
    with RunReader(path) as reader, contextlib.closing(sqlite3.connect(out)) as db, db:
        db.executescript(FIRST + (SECOND if version == 2 else ""))
        db.execute(f"PRAGMA application_id={APPLICATION_ID}")
        db.execute(f"PRAGMA user_version={version}")
        with contextlib.closing(sqlite3.connect(path)) as new:
            db.executemany(
                "INSERT INTO meta VALUES (?, ?)",
                new.execute("SELECT key, value FROM meta WHERE key <> ?", (SEAL,)).fetchall(),
            )
        db.row_factory = sqlite3.Row
        tables = tables_of(lambda sql, parameters=(): db.execute(sql, parameters).fetchall(), version)
        for generation, group in itertools.groupby(reader.each_evaluation(), key=lambda found: found[0]):
            evaluations = [e for _, e in group]
            origins = reader.origins({e.solution.number for e in evaluations})
            tables.add_evaluations(
                generation, evaluations, [origins.get(e.solution.number) for e in evaluations]
            )
        for closed, changes in reader.recorded():
            tables.add_generation(closed, changes)
        if (state := reader.recorded_state()) is not None:
            tables.set_state(*state)
    return out


def change(path, *statements, sealed=True):
    """Change a run file by hand.

    Args:
        path: of the file.
        statements: SQL, each as a text or as a tuple of a text and its parameters. ``packed`` and
            ``unpacked`` are functions from JSON to what the file's format stores, and back.
        sealed: whether every digest then says that this was written, in a file of the present format.
    """
    with contextlib.closing(sqlite3.connect(path)) as db:
        compact = db.execute("PRAGMA user_version").fetchone()[0] > 2
        db.create_function("packed", 1, packed if compact else str)
        db.create_function("unpacked", 1, unpacked if compact else str)
        with db:
            for statement in statements:
                db.execute(*([statement] if isinstance(statement, str) else statement))
        if sealed and compact:
            with db:
                seal_again(db)
