"""Work with files that may never end: the disk of a run may be in a network that is gone."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")


class TimeLimit:
    """Does work on threads of its own and waits for it no longer than a time. Threads may share it.

    Work of the same kind that is going on already is not begun again, and while something takes too long,
    nothing else is tried in the same folder: a disk that does not answer holds few threads, however often it
    is asked.

    Args:
        seconds: that work may take.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._mutex = threading.Lock()
        self._going_on: dict[tuple[Path, Hashable], tuple[float, Future[Any]]] = {}

    def call(self, folder: Path, kind: Hashable, work: Callable[[], T]) -> T:
        """Return what work returns, or raise what it raises.

        Args:
            folder: whose files it is about.
            kind: of work.
            work: to be done.

        Raises:
            TimeoutError: it takes too long, or other work in the folder does; it goes on.
        """
        key, now = (folder, kind), time.monotonic()
        with self._mutex:
            begun_here = [begun for (where, _), (begun, _) in self._going_on.items() if where == folder]
            if min(begun_here, default=now) + self._seconds < now:
                raise TimeoutError
            begun, result = self._going_on.get(key, (now, None))
            if result is None:
                result = Future()
                self._going_on[key] = (begun, result)
                threading.Thread(target=self._do, args=(key, work, result), name="file", daemon=True).start()
        found: T = result.result(max(0.0, begun + self._seconds - now))
        return found

    def _do(self, key: tuple[Path, Hashable], work: Callable[[], Any], result: Future[Any]) -> None:
        try:
            done = work()
        except BaseException as e:
            self._forget(key)
            result.set_exception(e)
        else:
            self._forget(key)
            result.set_result(done)

    def _forget(self, key: tuple[Path, Hashable]) -> None:
        with self._mutex:
            del self._going_on[key]
