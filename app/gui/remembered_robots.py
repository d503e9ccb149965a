"""Robots that a browser's tab remembers, so that they outlive a reload of the page."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Final

import viser

from app.gui.browser_value import BrowserValue

MAX_MEMORY: Final = 20_000
"""Characters of the longest memory that is read."""
MAX_NUMBER: Final = 10**9
"""Numbers of evaluations lie below it."""
MARK: Final = "*"
"""What a memory begins with that has something more to say of its robots than which they are."""
Kept = tuple[str, int]
"""Name of a run, as its list has it, and number of an evaluation: what a tab remembers of a robot."""


def parse_memory(text: str, most: int) -> tuple[list[Kept], bool]:
    """Read what a browser claims to remember: at most so many robots, and whether they are marked.

    Malformed parts are left out.
    """
    if len(text) > MAX_MEMORY:
        return [], False
    try:
        found = json.loads(text.removeprefix(MARK))
    except (ValueError, RecursionError):
        return [], False
    kept: list[Kept] = []
    for entry in found if isinstance(found, list) else ():
        match entry:
            case [str(name), int(number)] if not isinstance(number, bool) and 0 <= number < MAX_NUMBER:
                if (name, number) not in kept:
                    kept.append((name, number))
            case _:
                pass
    return kept[:most], text.startswith(MARK)


class RememberedRobots:
    """Reads a tab's memory once, when its page is there, and writes it from then on.

    Args:
        gui: of one client, at a place that is always on the page.
        key: of the memory.
        most: robots that it may hold.
        remembered: called with what the tab remembers, and whether it is marked.
    """

    def __init__(
        self, gui: viser.GuiApi, key: str, most: int, remembered: Callable[[list[Kept], bool], None]
    ) -> None:
        self._key = key
        self._value = BrowserValue(
            gui,
            f"memory of {key}",
            f"(sessionStorage.getItem('{key}')||'[]')",
            lambda text: remembered(*parse_memory(text, most)),
        )

    def keep(self, robots: Sequence[Kept], *, marked: bool = False) -> None:
        """Let the tab remember robots instead of those before."""
        text = MARK * marked + json.dumps(robots)
        self._value.change(f"sessionStorage.setItem('{self._key}',{json.dumps(text)})")
