"""Run files that browsers upload: checked before they are among the runs, never executed."""

from __future__ import annotations

import contextlib
import os
import re
import sqlite3
import tempfile
import threading
import urllib.parse
from collections.abc import Callable
from pathlib import Path
from typing import Final

import viser

from app.gui.actions import Actions
from app.gui.viser_private import Gate
from app.runs.library import UPLOADS
from engine.errors import InvalidData, RunFileError, TensAtlasError, printable
from engine.storage.reader import RunReader
from engine.storage.schema import KNOWN_TABLES, SUFFIX

MAX_BYTES: Final = 200_000_000
"""Size of the largest file that is taken."""
MAX_FILES: Final = 20
"""Largest number of files that are kept."""
MAX_GENERATIONS: Final = 20_000
"""Of a file: each of its browsers holds them all."""
_unsafe = re.compile(r"[^A-Za-z0-9_-]+")
_one_at_a_time = threading.Lock()


class Uploads:
    """Takes the files of one browser.

    Args:
        button: that uploads them.
        gate: of the browser.
        actions: of the browser.
        show: called with a run that was taken.
    """

    def __init__(
        self,
        button: viser.GuiUploadButtonHandle,
        gate: Gate,
        actions: Actions,
        show: Callable[[Path], None],
    ) -> None:
        def take() -> None:
            name, content = gate.taken(button)
            try:
                path = keep(name, content, UPLOADS)
            except RunFileError as e:
                actions.notify("Not uploaded", str(e), bad=True)
                return
            with actions.mutex:
                show(path)
            actions.notify("Uploaded", f"{path.name} is in {UPLOADS} and among the runs now.")

        button.on_upload(actions.slow(take))
        gate.open(
            button, SUFFIX, MAX_BYTES, lambda reason: actions.notify("Not uploaded", f"{reason}.", bad=True)
        )


def keep(name: str, content: bytes, folder: Path) -> Path:
    """Check a run file and keep it in a folder under a safe name.

    Args:
        name: of the file, as the browser says.
        content: of the file.
        folder: made if it does not exist.

    Raises:
        RunFileError: it is not a whole run file whose task is known here, is not named like one, or there are
            too many files.
    """
    safe = safe_name(name)
    if not name.lower().endswith(SUFFIX):
        raise RunFileError(f"{printable(name[-60:])} is no run file: their names end in {SUFFIX}")
    if len(content) > MAX_BYTES:
        raise RunFileError(f"{safe}{SUFFIX} is larger than {MAX_BYTES / 1e6:.0f} MB")
    with _one_at_a_time:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if sum(p.suffix == SUFFIX for p in folder.iterdir()) >= MAX_FILES:
                raise RunFileError(f"{folder} holds {MAX_FILES} files already; delete some there first")
            with tempfile.TemporaryDirectory(prefix=".checking-", dir=folder) as place:
                path = Path(place) / f"{safe}{SUFFIX}"
                path.write_bytes(content)
                try:
                    check(path)
                except TensAtlasError as e:
                    raise RunFileError(f"{e}".replace(str(path), path.name)) from None
                return _settle(path, folder)
        except OSError as e:
            raise RunFileError(f"{folder} cannot be written: {e.strerror}") from None


def safe_name(name: str) -> str:
    """Return a name for a file, without a suffix, made of what a browser says."""
    last = re.split(r"[/\\]", name)[-1]
    last = last[: -len(SUFFIX)] if last.lower().endswith(SUFFIX) else last
    return _unsafe.sub("-", last)[:60].strip("-_") or "run"


def check(path: Path) -> None:
    """Make sure that a file is a run that can be shown.

    Raises:
        RunFileError: it is damaged, of another program, or of a task that is not known here.
    """
    _check_tables(path)
    with RunReader(path) as reader:
        last = reader.last_generation()
        if last is not None and last >= MAX_GENERATIONS:
            raise RunFileError(
                f"{path} has more than {MAX_GENERATIONS} generations: too many to be shown here"
            )
        generations = reader.generations()
        if generations:
            elites = reader.elites(generations[-1])
            reader.evaluations({number for cells in elites.values() for number, _ in cells.values()})
        reader.n_evaluations()
        if reader.n_evaluations() and not generations:
            raise InvalidData("it has no finished generation; upload it when it has")


def _check_tables(path: Path) -> None:
    """Make sure that a database holds plain tables only: a view or a computed column could run for ever."""
    where = f"file:{urllib.parse.quote(os.fsencode(path.absolute()))}?mode=ro&immutable=1"
    try:
        with contextlib.closing(sqlite3.connect(where, uri=True)) as db:
            db.execute("PRAGMA trusted_schema=OFF")
            for kind, table, sql in db.execute("SELECT type, tbl_name, sql FROM sqlite_master").fetchall():
                plain = kind == "table" and "VIRTUAL" not in str(sql).upper()
                if table not in KNOWN_TABLES or not (plain or (kind == "index" and sql is None)):
                    raise RunFileError(f"{path} is not a TensAtlas run file: it has a {kind} {table!r}"[:300])
            for table in sorted(KNOWN_TABLES):  # one that is missing has no columns
                # 0 is an ordinary column; others are computed or hidden
                if any(row[6] for row in db.execute(f"PRAGMA table_xinfo({table})")):
                    raise RunFileError(f"{path} is not a TensAtlas run file: {table} has computed columns")
            found = db.execute("PRAGMA quick_check(1)").fetchone()[0]
            if found != "ok":
                raise RunFileError(f"{path} is damaged: {found}"[:300])
    except (sqlite3.Error, UnicodeDecodeError) as e:
        raise RunFileError(f"{path} is not a TensAtlas run file: {e}") from None


def _settle(path: Path, folder: Path) -> Path:
    """Move a file into a folder, under a name that no other has."""
    for k in range(1, MAX_FILES + 2):
        target = folder / (path.name if k == 1 else f"{path.stem}-{k}{SUFFIX}")
        try:
            os.link(path, target)
        except FileExistsError:
            continue
        return target.resolve()
    raise RunFileError(f"{folder} has too many files named like {path.name}")
