"""Run files that were changed and whose digests say that they were written so: what a stranger could send."""

from __future__ import annotations

import sqlite3

from engine.storage.layouts.compact import SEAL, digest_of_changes, seal
from engine.storage.layouts.tables import digest
from engine.storage.schema import COLUMNS


def seal_again(db: sqlite3.Connection) -> None:
    """Set every digest and every total of a run file to what its tables hold.

    A file of an older format, or one that lacks a table, is left alone.
    """
    there = {name for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    if not there.issuperset(COLUMNS[3]):
        return
    counted = ("evaluations", "details", "state", "computers")
    counts = [db.execute(f"SELECT COUNT(*) FROM {table}").fetchone()[0] for table in counted]
    counts += db.execute("SELECT MAX(generation) FROM generations").fetchone()
    columns = "n_evaluations = ?, n_details = ?, n_states = ?, n_computers = ?, last_generation = ?"
    db.execute(f"UPDATE totals SET {columns}", counts)
    for table in ("totals", "evaluations", "details", "state", "computers"):
        for row in db.execute(f"SELECT * FROM {table}").fetchall():
            key = "number" if table in ("evaluations", "details") else "id"
            db.execute(f"UPDATE {table} SET digest = ? WHERE {key} = ?", (digest(row[:-1], table), row[0]))
    before = b""
    for row in db.execute("SELECT * FROM generations ORDER BY generation").fetchall():
        changes = db.execute(
            "SELECT generation, archive, cell, evaluation FROM placements WHERE generation = ?"
            " ORDER BY archive, cell",
            row[:1],
        ).fetchall()
        values = (*row[:-2], digest_of_changes(changes))
        before = digest((*values, before), "generations")
        db.execute(
            "UPDATE generations SET placed = ?, digest = ? WHERE generation = ?",
            (values[-1], before, row[0]),
        )
    meta = dict(db.execute("SELECT key, value FROM meta WHERE key <> ?", (SEAL,)))
    db.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (SEAL, seal(meta)))
