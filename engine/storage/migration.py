"""Copies of run files: in the present format, or slimmed. The file that is copied stays as it is.

Every older format can be read, shown and resumed as it is. What a newer format adds, an old file gets only in
a copy, when the user asks for one.
"""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import sqlite3
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from engine.config import to_json
from engine.errors import RunFileError
from engine.storage.lock import RunLock
from engine.storage.reader import RunReader
from engine.storage.rows import Slimmed
from engine.storage.schema import FORMAT_VERSION, SUFFIX
from engine.storage.writer import RunWriter, new_tables, sync_folder, unwritable

_TOGETHER: Final = 200
"""Evaluations in one transaction."""


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
    with RunReader(path) as reader:
        version = reader.format_version
        if version == FORMAT_VERSION:
            raise RunFileError(f"{path} has the present format ({FORMAT_VERSION}) already")
        with new_run_file(out) as place:
            before = reader.canonical_hash()
            _copy(reader, place)
            with RunReader(place) as copy:
                if copy.canonical_hash() != before:
                    raise RunFileError(
                        f"{path} was changed while it was copied; try again when no process writes it"
                    )
    return version


def slim(path: Path, out: Path) -> Slimmed:
    """Write a copy of a run that holds only the robots that the explorer shows.

    These are all that were an elite at the end of a generation or lie in a deep cell now, their ancestors,
    and the first robots. Of all others the figures are kept, so that maps, trends and counts are those of
    the run.

    Args:
        path: of the run; only read.
        out: of the file to create.

    Returns:
        What the copy says about itself.

    Raises:
        RunFileError: the run cannot be read, is slimmed already or being written, or ``out`` exists or cannot
            be written.
    """
    with RunReader(path) as reader:
        if reader.slimmed is not None:
            raise RunFileError(f"{path} is slimmed already")
        if reader.is_live:
            raise RunFileError(f"{path} is being written; slim it when that has ended")
        shown = _shown(reader)
        slimmed = Slimmed(hash=reader.canonical_hash(), n_kept=len(shown))
        meta = {
            "config": to_json(reader.config),
            "versions": reader.versions,
            "created_at": reader.created_at,
            "slimmed": dataclasses.asdict(slimmed),
        }
        if reader.projection is not None:
            meta["projection"] = reader.projection
        with new_run_file(out) as place, new_tables(place, meta) as tables:
            records = reader.records()
            tables.add_records(records, reader.origins({r.number for r in records}))
            kept = sorted(shown)
            for i in range(0, len(kept), _TOGETHER):
                tables.add_details(list(reader.evaluations(set(kept[i : i + _TOGETHER])).values()))
            for closed, changes in reader.recorded():
                tables.add_generation(closed, changes)
            if (state := reader.recorded_state()) is not None:
                tables.set_state(*state)
    return slimmed


def _shown(reader: RunReader) -> set[int]:
    """Return the numbers of the robots that the explorer shows, at any generation."""
    last = reader.last_closed()
    names = [] if last is None else list(last.archives)
    shown = {n for name in names for _, _, n in reader.placement_changes(name) if n is not None}
    shown |= {n for name in names for held in reader.members(name).values() for n in held}
    for first in reader.generations()[:1]:
        shown |= set(reader.first_robots(first))
    parents = {r.number: r.parent for r in reader.records()}
    line = list(shown)
    while line:
        parent = parents.get(line.pop())
        if parent is not None and parent in parents and parent not in shown:
            shown.add(parent)
            line.append(parent)
    return shown


@contextlib.contextmanager
def new_run_file(out: Path) -> Iterator[Path]:
    """Give a place for a run file that gets its name when it is whole, if nothing goes wrong until then.

    Raises:
        RunFileError: the name is not that of a run file, exists, or cannot be written.
    """
    if out.suffix != SUFFIX:
        raise RunFileError(f"{out}: a run file's name ends in {SUFFIX}")
    lock: RunLock | None = None
    try:
        lock = RunLock.acquire(out)
        if out.exists():
            raise RunFileError(f"{out} exists; choose another name for the copy")
        with tempfile.TemporaryDirectory(prefix=f".{out.name}-", dir=out.parent) as folder:
            place = Path(folder) / out.name
            yield place
            place.replace(out)
            sync_folder(out)
    except (OSError, sqlite3.Error) as e:
        raise unwritable(out, e) from e
    finally:
        if lock is not None:
            lock.release()


def _copy(reader: RunReader, place: Path) -> None:
    """Write everything that a run holds into a new file."""
    origin = reader.projection, reader.created_at, reader.given()
    with RunWriter.create(place, reader.config, reader.versions, *origin) as writer:
        for generation, group in itertools.groupby(reader.each_evaluation(), key=lambda found: found[0]):
            while part := [e for _, e in itertools.islice(group, _TOGETHER)]:
                origins = reader.origins({e.solution.number for e in part})
                writer.add_evaluations(generation, part, [origins.get(e.solution.number) for e in part])
        for closed, changes in reader.recorded():
            writer.add_recorded(closed, changes)
        state = reader.recorded_state()
        if state is not None:
            writer.set_recorded_state(*state)
