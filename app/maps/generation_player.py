"""Runs through the generations of a run for one browser, at a pace that the eye can follow."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from typing import Final

FASTEST: Final = 0.15
"""Seconds between two steps at least: a browser has to draw each."""
SLOWEST: Final = 0.7
LONGEST: Final = 15.0
"""Seconds from the first to the last generation: of longer runs some generations are left out."""


def pace(n: int) -> tuple[float, int]:
    """Return the seconds between two steps and the generations that a step takes, for n generations."""
    seconds = min(max(LONGEST / max(n, 1), FASTEST), SLOWEST)
    return seconds, max(math.ceil(n * seconds / LONGEST), 1)


class GenerationPlayer:
    """Plays on a thread of its own, which lives while it plays.

    Args:
        show: called with the number of a generation; returns whether to go on.
        changed: called with whether it plays, whenever that changes.
    """

    def __init__(self, show: Callable[[int], bool], changed: Callable[[bool], None]) -> None:
        self._show = show
        self._changed = changed
        self._mutex = threading.Lock()
        self._stop: threading.Event | None = None

    @property
    def playing(self) -> bool:
        """Whether it plays."""
        return self._stop is not None

    def play(self, shown: int, last: Callable[[], int]) -> None:
        """Go on from a generation to the last one; from the first one if it is the last.

        Args:
            shown: number of the generation to begin with.
            last: returns the number of the generation to end with, which may grow.
        """
        if last() <= 0:
            return
        with self._mutex:
            if self._stop is not None:
                return
            stop = self._stop = threading.Event()
        begin = 0 if shown >= last() else shown
        self._changed(True)
        threading.Thread(target=self._run, args=(stop, begin, last), name="generations", daemon=True).start()

    def stop(self) -> None:
        """Stay at the generation that is shown."""
        with self._mutex:
            stop, self._stop = self._stop, None
        if stop is not None:
            stop.set()
            self._changed(False)

    def _run(self, stop: threading.Event, number: int, last: Callable[[], int]) -> None:
        seconds, step = pace(last())
        while not stop.is_set() and self._show(number) and number < last():
            number = min(number + step, last())
            if stop.wait(seconds):
                break
        with self._mutex:
            ended = self._stop is stop
            if ended:
                self._stop = None
        if ended:
            self._changed(False)
