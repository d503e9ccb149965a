"""One colour scale of fitness for all runs of a task, so that maps of different runs can be compared."""

from __future__ import annotations

from pathlib import Path

from app.runs.library import Library
from engine.errors import TensAtlasError
from engine.storage.reader import RunReader
from viz.maps.contents import load_contents
from viz.maps.scale import color_limits


class SharedScale:
    """Knows the fitnesses of the elites of all runs on offer.

    Args:
        library: the runs.
    """

    def __init__(self, library: Library) -> None:
        self._library = library
        self._known: dict[Path, tuple[RunReader, int, list[float]]] = {}

    def limits(self, reader: RunReader) -> tuple[float, float]:
        """Return the ends, in cm, of a scale for all runs of the task of a run.

        Raises:
            RunFileError: the run itself cannot be read; others that cannot are left out.
        """
        values = list(self._values(reader.path, reader))
        for path in self._library.runs():
            try:
                other = self._library.reader(path)
                if other is not reader and other.config.task == reader.config.task:
                    values += self._values(path, other)
            except TensAtlasError:
                continue  # the list of runs says what is wrong with it
        return color_limits(values)

    def _values(self, path: Path, reader: RunReader) -> list[float]:
        last = reader.last_closed()
        if last is None:
            return []
        known = self._known.get(path)
        if known is None or known[0] is not reader or known[1] != last.number:
            contents = load_contents(reader, last)
            values = [e.f_s for content in contents.values() for e in content.elites.values()]
            known = self._known[path] = (reader, last.number, values)
        return known[2]
