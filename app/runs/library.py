"""The run files on offer, opened once for all browsers, and a watch on those that are shown."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import logging
import tempfile
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

from app.runs.run_names import without_folders
from app.runs.run_notes import note_of
from app.runs.time_limit import TimeLimit
from engine.analysis.robustness import robust_stamp
from engine.errors import InvalidData, RunFileError, TensAtlasError
from engine.storage.reader import RunReader
from engine.storage.schema import SUFFIX
from viz.runs.run_list import RunFacts, State

log = logging.getLogger(__name__)

POLL_INTERVAL = 0.25
"""Seconds between two checks of the shown runs."""
ANSWER_TIME = 5.0
"""Seconds that a file may take to be found, opened or read."""
PROJECT_ARCHIVES = Path(__file__).resolve().parents[2] / "saved_archives"
"""The shipped runs of a checkout."""
EXAMPLE = Path(__file__).resolve().parents[1] / "archive" / "example.tsmr"
"""The one run of an installation."""
NEW_RUNS = Path("runs")
UPLOADS = NEW_RUNS / "uploads"
"""Where uploaded files lie."""
PAUSED_SUFFIX = ".paused"
"""Ending of the marker beside a run that its user has paused."""


@dataclasses.dataclass(frozen=True, slots=True)
class RunStatus:
    """The progress of a run, which a watcher compares.

    Attributes:
        generation: number of the last closed one.
        n_evaluations: that are saved.
        live: whether it is being written.
        robust: changes with what ``tensatlas reevaluate`` has found; None for nothing.
    """

    generation: int | None
    n_evaluations: int
    live: bool
    robust: tuple[int, int] | None = None


Listener = Callable[[Path, RunStatus], None]


def run_state(path: Path, *, live: bool, complete: bool) -> State:
    """Return the state of a run in words: whether a process writes it, and if not, why."""
    if live:
        return "live"
    if complete:
        return "finished"
    return "paused" if path.with_name(path.name + PAUSED_SUFFIX).exists() else "stopped"


def default_places() -> tuple[Path, ...]:
    """Return the run files and folders to offer where none is named.

    These are ``saved_archives/``, the checkout's and the current folder's, and ``runs/``; without the former
    the example, so that there is something to see.
    """
    archives = dict.fromkeys(p.resolve() for p in (PROJECT_ARCHIVES, Path("saved_archives")) if p.is_dir())
    return (*archives, NEW_RUNS) if archives else (NEW_RUNS, EXAMPLE)


class Library:
    """Finds runs, keeps their readers, tells listeners when a watched run advances.

    Args:
        places: run files and folders to offer; empty for those of ``default_places``.
    """

    def __init__(self, places: Sequence[Path] = ()) -> None:
        self._places = tuple(places) or default_places()
        self._limit = TimeLimit(ANSWER_TIME)
        self._seen: dict[Path, list[Path]] = {}
        """The runs that were in a place when it last answered."""
        self._readers: dict[Path, tuple[int, RunReader]] = {}
        self._mutex = threading.Lock()
        self._listeners: dict[object, tuple[Path, Listener, RunStatus]] = {}
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="library", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop watching and close all files; what does not answer is left as it is."""
        self._stop.set()
        self._thread.join(ANSWER_TIME)
        with self._mutex:
            readers = [(path, reader) for path, (_, reader) in self._readers.items()]
            self._readers.clear()
        for path, reader in readers:
            self._let_go(path, reader)

    def runs(self) -> list[Path]:
        """Return the run files on offer: those named first, then by name; a new run appears by itself.

        Of a folder that does not answer, those that were in it when it did.
        """
        found: list[Path] = []
        for place in dict.fromkeys((*self._places, NEW_RUNS, UPLOADS)):
            with contextlib.suppress(TimeoutError, OSError):
                self._seen[place] = self._limit.call(place, "list", functools.partial(_runs_in, place))
            found += self._seen.get(place, ())
        return list(dict.fromkeys(found))

    def shown(self, path: Path | None) -> RunReader:
        """Return the reader of the run that a browser shows, as ``reader``.

        Raises:
            InvalidData: it shows none.
        """
        if path is None:
            raise InvalidData("Choose a run first.")
        return self.reader(path)

    def reader(self, path: Path) -> RunReader:
        """Return the shared reader of a run; a file that was replaced is opened anew.

        Raises:
            RunFileError: it cannot be opened.
            TaskError: a user's task file, which may hold its task, has an error.
        """
        try:
            inode = self._limit.call(path.parent, ("find", path), path.stat).st_ino
            with self._mutex:
                known = self._readers.get(path)
            if known is not None and known[0] == inode:
                return known[1]
            opened = self._limit.call(path.parent, ("open", path), lambda: RunReader(path))
        except TimeoutError:
            raise RunFileError(f"{path} does not answer; is its disk within reach?") from None
        except OSError:
            raise RunFileError(f"{path} does not exist any more") from None
        left: RunReader | None = opened
        with self._mutex:
            known = self._readers.get(path)
            if known is None or known[0] != inode:
                left = None if known is None else known[1]
                known = self._readers[path] = (inode, opened)
        if left is not None and left is not known[1]:
            self._let_go(path, left)
        return known[1]

    def forget(self, path: Path) -> None:
        """Close a run file that has been moved."""
        with self._mutex:
            known = self._readers.pop(path, None)
        if known is not None:
            self._let_go(path, known[1])

    def status(self, path: Path) -> RunStatus:
        """Return the progress of a run.

        Raises:
            RunFileError, TaskError: it cannot be read.
        """
        reader = self.reader(path)
        return RunStatus(reader.last_generation(), reader.n_evaluations(), reader.is_live, robust_stamp(path))

    def facts(self, path: Path) -> RunFacts:
        """Return a run's line in a list of runs, as of its last generation, which costs little to read."""
        try:
            reader = self.reader(path)
            last, n, live = self._limit.call(
                path.parent,
                ("facts", path),
                lambda: (reader.last_closed(), reader.n_evaluations(), reader.is_live),
            )
        except TensAtlasError as e:
            return RunFacts(problem=str(e))
        except TimeoutError:
            return RunFacts(problem=f"{path} does not answer")
        best = [f.best for f in last.archives.values() if f.best is not None] if last else []
        n_closed = last.n_evaluations if last else 0
        return RunFacts(
            task=reader.config.task,
            algorithm=reader.config.algorithm,
            n_evaluations=n,
            n_closed=n_closed,
            best=max(best, default=None),
            date=reader.created_at[:10],
            note=note_of(path),
            state=run_state(path, live=live, complete=n_closed >= reader.config.evaluations),
        )

    def for_visitors(self, text: str) -> str:
        """Return a text without the folders of this machine that it names."""
        with self._mutex:
            known = [path.parent for path in self._readers]
        places = [p.absolute() for p in (*self._places, NEW_RUNS, UPLOADS, *known)]
        folders = {*places, *(p.parent for p in places), Path.cwd(), Path.home(), Path(tempfile.gettempdir())}
        return without_folders(text, folders)

    def watch(self, key: object, path: Path, listener: Listener, shown: RunStatus) -> None:
        """Call a listener whenever a run advances beyond what is shown; a key has one watch at a time."""
        with self._mutex:
            self._listeners[key] = (path, listener, shown)

    def unwatch(self, key: object) -> None:
        """End a key's watch."""
        with self._mutex:
            self._listeners.pop(key, None)

    def _let_go(self, path: Path, reader: RunReader) -> None:
        """Close a reader, unless its disk does not answer."""
        with contextlib.suppress(TimeoutError):
            self._limit.call(path.parent, ("close", reader), reader.close)

    def _watch(self) -> None:
        while not self._stop.wait(POLL_INTERVAL):
            with self._mutex:
                watched = dict(self._listeners)
            statuses: dict[Path, RunStatus] = {}
            for key, (path, listener, before) in watched.items():
                try:
                    status = statuses.get(path) or self._limit.call(
                        path.parent, ("status", path), functools.partial(self.status, path)
                    )
                except (TensAtlasError, TimeoutError):
                    continue  # shown again as soon as it can be read again
                statuses[path] = status
                if status == before:
                    continue
                with self._mutex:
                    known = self._listeners.get(key)
                    if known is None or known[1] is not listener:
                        continue  # it has moved on to another run
                    self._listeners[key] = (path, listener, status)
                try:
                    listener(path, status)
                except Exception:  # one browser's trouble must not end the others' updates
                    log.exception("a browser could not be told about %s", path)


def _runs_in(place: Path) -> list[Path]:
    """Return the run files of a folder by name, or the file itself; pipes and devices are none.

    Raises:
        OSError: it cannot be read.
    """
    found = sorted(p for p in place.iterdir() if p.suffix == SUFFIX) if place.is_dir() else [place]
    return [p.resolve() for p in found if p.is_file()]
