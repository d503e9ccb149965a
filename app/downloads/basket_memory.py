"""Keeps a basket over reloads of its page: the browser's tab remembers it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Final

import viser

from app.downloads.basket import MOST
from app.gui.browser_value import PageValue

Kept = tuple[str, int]
"""Name of a run, as its list has it, and number of an evaluation."""
KEY: Final = "tensatlas-basket"
MAX_LENGTH: Final = 20_000
"""Characters of the longest memory that is read."""
LARGEST: Final = 10**9


def parse(text: str) -> list[Kept]:
    """Read what a browser says that it remembers; what is not well formed is left out."""
    if len(text) > MAX_LENGTH:
        return []
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return []
    kept: list[Kept] = []
    for entry in found if isinstance(found, list) else ():
        match entry:
            case [str(name), int(number)] if not isinstance(number, bool) and 0 <= number < LARGEST:
                if (name, number) not in kept:
                    kept.append((name, number))
            case _:
                pass
    return kept[:MOST]


class BasketMemory:
    """Reads a tab's memory once, when its page is there, and writes it from then on.

    Args:
        gui: of one client, at a place that is always on the page.
        remembered: called with what the tab remembers.
    """

    def __init__(self, gui: viser.GuiApi, remembered: Callable[[list[Kept]], None]) -> None:
        memory = f"(sessionStorage.getItem('{KEY}')||'[]')"
        self._value = PageValue(gui, "basket memory", memory, lambda text: remembered(parse(text)))

    def keep(self, robots: Sequence[Kept]) -> None:
        """Let the tab remember robots instead of those before."""
        self._value.change(f"sessionStorage.setItem('{KEY}',{json.dumps(json.dumps(robots))})")
