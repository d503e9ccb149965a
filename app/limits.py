"""How much a visitor may simulate."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Final

from engine.errors import InvalidData

VISITOR_SECONDS: Final = 600.0
"""Seconds of simulated time that a visitor may use in a window: about 14 replays."""
WINDOW: Final = 60.0
"""Seconds in which they count."""


class SimulationBudget:
    """Counts what one browser has simulated lately. Threads may share it.

    Args:
        seconds: of robots' time in a window; None for any number.
        window: in s.
        clock: returns the time, in s.
    """

    def __init__(
        self,
        seconds: float | None,
        *,
        window: float = WINDOW,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._limit = seconds
        self._window = window
        self._clock = clock
        self._mutex = threading.Lock()
        self._spent: deque[tuple[float, float]] = deque()

    def spend(self, seconds: float) -> None:
        """Count a simulation that is about to begin.

        Args:
            seconds: of a robot's time, of all robots together.

        Raises:
            InvalidData: it would exceed the limit.
        """
        if self._limit is None:
            return
        with self._mutex:
            now = self._clock()
            while self._spent and self._spent[0][0] <= now - self._window:
                self._spent.popleft()
            spent = sum(cost for _, cost in self._spent)
            if seconds > self._limit:
                raise InvalidData("A visitor may not have that much simulated.")
            if spent + seconds > self._limit:
                wait = self._spent[0][0] + self._window - now
                raise InvalidData(
                    f"That is enough simulation for a visitor; wait {max(wait, 1):.0f} s and try again."
                )
            self._spent.append((now, seconds))
