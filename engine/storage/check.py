"""Checks a run file: is it whole, can it be resumed, is a process writing it?"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import shutil
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, Literal

from engine.errors import TensAtlasError, as_typed, one_line
from engine.storage.database import connect
from engine.storage.lock import holder_of, lock_path
from engine.storage.reader import RunReader, changed_versions
from engine.storage.salvaged_tables import SalvagedTables
from engine.storage.schema import FORMAT_VERSION

Verdict = Literal["ok", "note", "problem"]
_SHOWN: Final = 5
_WITHOUT: Final = {1: "its rows have no digests", 2: "only its evaluations have digests"}
"""What runs of older formats lack."""
_CHUNK: Final = 500
_COPY: Final = "copy {0} and {0}-wal to a folder that can be written to"


@dataclasses.dataclass(frozen=True, slots=True)
class Finding:
    """One line of a check.

    Attributes:
        verdict: ``ok``, a ``note`` without consequences, or a ``problem``.
        text: what was found.
        remedy: what to do, for all but ``ok``.
    """

    verdict: Verdict
    text: str
    remedy: str = ""


def check_run(path: Path) -> Iterator[Finding]:
    """Check a run file, from its first byte to the versions that made it, without writing to it."""
    try:
        with RunReader(path) as reader:
            config = reader.config
            what = f"{config.algorithm} on {config.task}, seed {config.seed}, format {reader.format_version}"
            yield Finding("ok", f"{as_typed(path)} is a run file: {what}")
            if reader.format_version < FORMAT_VERSION:
                remedy = (
                    f"tensatlas migrate {as_typed(path)} --out NEW.tsmr writes a smaller copy that has all"
                )
                yield Finding("note", f"its format is older: {_WITHOUT[reader.format_version]}", remedy)
            yield from _contents(path, reader)
            yield from _versions(path, reader)
            yield from _space(path, reader)
    except (TensAtlasError, sqlite3.Error, MemoryError) as e:
        yield Finding("problem", one_line(str(e)))
        yield from _what_is_left(path)
    yield from _lock(path)
    yield from _leftovers(path)


def _contents(path: Path, reader: RunReader) -> Iterator[Finding]:
    recover = f"tensatlas recover {as_typed(path)} --out NEW.tsmr saves what is whole"
    with contextlib.closing(connect(path)) as db:
        db.text_factory = lambda b: b.decode(errors="surrogateescape")  # what is no text is found out below
        try:
            problems = [str(r[0]) for r in db.execute(f"PRAGMA integrity_check({_SHOWN})")]
        except sqlite3.Error as e:
            problems = [str(e)]
        if problems != ["ok"]:
            lines = one_line("; ".join(problems))
            yield Finding("problem", f"SQLite finds damage: {lines}", recover)
            return
        yield Finding("ok", "SQLite finds no damage")
        differing = reader.differing()
        for table, keys in differing:
            text = f"{len(keys)} {_of(table)} differ from what was written: {_some(keys)}"
            yield Finding("problem", text, recover)
        if differing and reader.format_version > 2:
            return
        yield from _counts(db, reader, recover)
        yield from _evaluations(reader, not differing)
    last = reader.last_closed()
    if last is not None:
        n = sum(map(len, reader.elites(last).values()))
        yield Finding("ok", f"the {n} elites of generation {last.number} can be read")


def _counts(db: sqlite3.Connection, reader: RunReader, recover: str) -> Iterator[Finding]:
    generations = reader.generations()
    budget, n = reader.config.evaluations, reader.n_evaluations()
    closed = generations[-1].n_evaluations if generations else 0
    failed = generations[-1].n_failed if generations else 0
    state = "finished" if closed >= budget else "can be resumed"
    if reader.projection is not None:
        state = "a projection"
    yield Finding(
        "ok",
        f"{len(generations)} generations, {n} of {budget} evaluations ({n - closed} of an open generation),"
        f" {failed} failed: {state}",
    )
    last = generations[-1].number if generations else -1
    queries = {
        "generations are missing": (
            "SELECT value FROM (WITH RECURSIVE g(value) AS (SELECT 0 UNION ALL SELECT value + 1 FROM g"
            " WHERE value < ?1) SELECT value FROM g WHERE ?1 >= 0) WHERE value NOT IN"
            " (SELECT generation FROM generations)"
        ),
        "cells of archives hold evaluations that do not exist": (
            "SELECT DISTINCT evaluation FROM placements WHERE evaluation IS NOT NULL AND evaluation NOT IN"
            " (SELECT number FROM evaluations) AND ?1 IS NOT NULL"
        ),
        "changes of archives belong to generations that do not exist": (
            "SELECT DISTINCT generation FROM placements WHERE generation > ?1"
        ),
        "states to resume from are not of the last generation": (
            "SELECT generation FROM state WHERE generation <> ?1"
        ),
    }
    if reader.format_version == 2:
        queries["digests belong to evaluations that do not exist"] = (
            "SELECT number FROM digests WHERE number NOT IN (SELECT number FROM evaluations)"
            " AND ?1 IS NOT NULL"
        )
    clean = True
    for what, sql in queries.items():
        found = [r[0] for r in db.execute(sql, (last,)).fetchall()]
        if found:
            clean = False
            yield Finding("problem", f"{len(found)} {what}: {_some(found)}", recover)
    (n_up_to_last,) = db.execute("SELECT COUNT(*) FROM evaluations WHERE generation <= ?", (last,)).fetchone()
    if n_up_to_last != closed and reader.projection is None:
        clean = False
        yield Finding("problem", f"{closed} evaluations were counted, {n_up_to_last} are there", recover)
    if last >= 0 and not db.execute("SELECT 1 FROM state").fetchone() and reader.projection is None:
        clean = False
        yield Finding("problem", "the state to resume from is missing", recover)
    (later,) = db.execute("SELECT COUNT(*) FROM evaluations WHERE generation > ?", (last + 1,)).fetchone()
    if later:
        yield Finding("note", f"{later} evaluations wait for later generations", "resume will use them")
    if clean:
        yield Finding("ok", "nothing is orphaned or missing")


def _evaluations(reader: RunReader, as_written: bool) -> Iterator[Finding]:
    numbers = reader.numbers()
    n = len(numbers)
    for i in range(0, n, _CHUNK):
        reader.evaluations(set(numbers[i : i + _CHUNK]))
    if n and as_written:
        known = " and are as they were written" if reader.format_version > 1 else ""
        yield Finding("ok", f"all {n} evaluations can be read{known}")
    if reader.slimmed is not None:
        yield Finding("note", "slimmed: of other robots it has the figures", "it can be viewed, not resumed")
    elif reader.lacks_trajectories():
        yield Finding("note", "robots without a trajectory", "such a run can be viewed, not resumed")


def _versions(path: Path, reader: RunReader) -> Iterator[Finding]:
    changes = changed_versions(path)
    if change := reader.task_change:
        changes.append(change)
    for change in changes:
        yield Finding(
            "note",
            f"{'bodies are modelled differently: ' if change.startswith('physics') else ''}{change}",
            "replays may differ, and a resumed run mixes both versions",
        )
    if not changes:
        yield Finding("ok", "made with the versions and the physics installed here")


def _space(path: Path, reader: RunReader) -> Iterator[Finding]:
    n, budget = reader.n_evaluations(), reader.config.evaluations
    if n >= budget or reader.projection is not None:
        return
    per_evaluation = path.stat().st_size / n if n else 8192.0
    needed = 1.5 * per_evaluation * (budget - n) + 64e6
    free = shutil.disk_usage(path.absolute().parent).free
    text = f"{free / 1e9:.1f} GB free, the rest of the run needs about {needed / 1e9:.2f} GB"
    if free < needed:
        yield Finding("problem", text, f"make room in {path.absolute().parent}")
    else:
        yield Finding("ok", text)


def _what_is_left(path: Path) -> Iterator[Finding]:
    try:
        tables = SalvagedTables(path)
    except TensAtlasError:
        return
    found = tables.pages
    yield Finding(
        "note",
        f"of its pages {found.n_pages} are there and {found.n_missing} missing, {found.n_broken} entries"
        f" cannot be read; {tables.n_visible} evaluations, {len(tables.generations)} generations are visible",
        "recover saves what is whole of them",
    )


def _lock(path: Path) -> Iterator[Finding]:
    holder, file = holder_of(path), lock_path(path)
    try:
        with RunReader(path) as reader:
            live = reader.is_live
    except TensAtlasError:
        live = False
    if live:
        yield Finding("ok", f"being written by {holder or 'a process that does not say its name'}")
    elif file.exists() and not os.access(file.parent, os.W_OK):
        yield Finding(
            "note",
            f"{file.name} is left from a process that ended without closing the run:"
            f" {holder or 'it does not say its name'}",
            f"nothing is lost; to continue, {_COPY.format(path.name)} and resume it there",
        )
    elif file.exists() and holder is not None and not holder.is_here:
        yield Finding(
            "note",
            f"{file.name} names a process on another machine that gives no sign of life: {holder}",
            f"if it is dead, continue with: tensatlas resume {as_typed(path)}",
        )
    elif file.exists():
        since = " before this machine was restarted" if holder and not holder.is_of_this_boot else ""
        yield Finding(
            "note",
            f"{file.name} is left from a process that ended without closing the run{since}:"
            f" {holder or 'it does not say its name'}",
            f"nothing is lost; continue with: tensatlas resume {as_typed(path)}",
        )
    else:
        yield Finding("ok", "no process is writing it")


def _leftovers(path: Path) -> Iterator[Finding]:
    log = path.with_name(path.name + "-wal")
    with contextlib.suppress(OSError):
        if (size := log.stat().st_size) and not lock_path(path).exists():
            fold = f"tensatlas resume {as_typed(path)} folds it in"
            if not os.access(path.parent, os.W_OK):
                fold = f"to continue the run, {_COPY.format(path.name)} and resume it there"
            yield Finding(
                "note",
                f"{log.name} beside it holds {size / 1e6:.1f} MB that are part of the run",
                f"keep both together when copying; {fold}",
            )
    part = path.with_name(path.name + ".part")
    if part.exists():
        yield Finding("note", f"{part.name} is left from an interrupted creation", "delete it")


def _of(table: str) -> str:
    return table if table == "evaluations" else f"rows of {table}"


def _some(found: list[Any]) -> str:
    return ", ".join(map(str, found[:_SHOWN])) + (", ..." if len(found) > _SHOWN else "")
