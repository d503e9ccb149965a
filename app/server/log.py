"""What a server says on its terminal: faults, but never more of them than somebody can read."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable
from typing import Final

MOST: Final = 20
"""Records that are shown in a window."""
WINDOW: Final = 60.0
"""Seconds of it."""


class AtMost(logging.Filter):
    """Lets so many records through in a window of time, and says when it leaves out more.

    Args:
        most: records.
        window: in s.
        clock: returns the time, in s.
    """

    def __init__(
        self, most: int = MOST, window: float = WINDOW, clock: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__()
        self._most, self._window, self._clock = most, window, clock
        self._shown: deque[float] = deque()

    def filter(self, record: logging.LogRecord) -> bool:
        """Tell whether a record is shown; the last of a window becomes a word about those that follow."""
        now = self._clock()
        while self._shown and self._shown[0] <= now - self._window:
            self._shown.popleft()
        if len(self._shown) >= self._most:
            return False
        self._shown.append(now)
        if len(self._shown) == self._most:
            record.msg = (
                f"There are more than {self._most} faults in {self._window:g} s; the rest is not shown."
            )
            record.args = record.exc_info = record.exc_text = record.stack_info = None
        return True


def limit_log() -> None:
    """Show the faults of this process on its terminal, at most ``MOST`` of them in a minute."""
    handler = logging.StreamHandler()
    handler.addFilter(AtMost())
    logging.basicConfig(handlers=[handler], level=logging.WARNING, format="%(message)s")
