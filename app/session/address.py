"""The address of what a browser shows: it can be shared, and brings back everybody's place after a reload.

``?run=NAME&archive=morphology&cell=3,7&robot=112`` names a run as the list of runs does and a robot of it:
by its cell, or exactly by its number, which what the app writes always has, because a live run may find a
better robot for a cell. ``generation``, ``target``, ``seed`` and ``fresh`` (noise that it was not evaluated
with) follow if they are not the usual ones; the last three count from 1, as the replay's panel does. A
target of one's own is ``aim=30,62``: 30 degrees to the left of the settled head, 62 cm from it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import re
import urllib.parse
from collections.abc import Callable
from typing import Final, Self

import viser

from app.gui.browser_value import BrowserValue
from engine.errors import InvalidData
from engine.replay.trial import FIRST_TRIAL, Aim, TrialChoice
from engine.search.archive import Cell

MAX_LENGTH: Final = 2000
"""Characters of the longest query that is read."""
_NUMBER: Final = re.compile(r"\d{1,9}")
_CELL: Final = re.compile(r"\d{1,3}(,\d{1,3}){0,5}")
_ARCHIVE: Final = re.compile(r"[a-z0-9-]{1,40}")


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Address:
    """What an address says; None is what it does not say.

    Attributes:
        run: name of a run.
        archive: of the robot.
        cell: of the archive.
        robot: number of its evaluation.
        generation: that the maps show; None for the last one.
        trial: of the robot.
    """

    run: str | None = None
    archive: str | None = None
    cell: Cell | None = None
    robot: int | None = None
    generation: int | None = None
    trial: TrialChoice = FIRST_TRIAL

    @classmethod
    def parse(cls, query: str) -> Self:
        """Read a query, with or without its question mark; what is not well formed is left out."""
        try:
            pairs = urllib.parse.parse_qsl(query[:MAX_LENGTH].removeprefix("?"), max_num_fields=30)
        except ValueError:
            pairs = []
        given = dict(pairs)

        def number(key: str, least: int = 0) -> int | None:
            text = given.get(key, "")
            return int(text) if _NUMBER.fullmatch(text) and int(text) >= least else None

        cell, archive = given.get("cell", ""), given.get("archive", "")
        return cls(
            run=given.get("run") or None,
            archive=archive if _ARCHIVE.fullmatch(archive) else None,
            cell=tuple(map(int, cell.split(","))) if _CELL.fullmatch(cell) else None,
            robot=number("robot"),
            generation=number("generation"),
            trial=TrialChoice(
                target=(number("target", 1) or 1) - 1,
                repeat=(number("seed", 1) or 1) - 1,
                fresh=number("fresh") or 0,
                aim=_aim(given.get("aim", "")),
            ),
        )

    def query(self) -> str:
        """Return the query that ``parse`` reads as this address; empty if it says nothing."""
        trial = self.trial
        said = {
            "run": self.run,
            "archive": self.archive,
            "cell": None if self.cell is None else ",".join(map(str, self.cell)),
            "robot": self.robot,
            "generation": self.generation,
            "target": trial.target + 1 if trial.target else None,
            "seed": trial.repeat + 1 if trial.repeat else None,
            "fresh": trial.fresh or None,
            "aim": None if trial.aim is None else trial.aim.text,
        }
        pairs = [(k, str(v)) for k, v in said.items() if v is not None]
        return "?" + urllib.parse.urlencode(pairs, safe=",/") if pairs else ""


def _aim(text: str) -> Aim | None:
    """Return the target of one's own that an address says, None if it says none."""
    with contextlib.suppress(InvalidData):
        return Aim.parse(text)
    return None


class AddressBar:
    """Reads a browser's address once, when its page is there, and writes it from then on.

    Args:
        gui: of one client, at a place that is always on the page.
        arrived: called with the address that the browser came with.
    """

    def __init__(self, gui: viser.GuiApi, arrived: Callable[[Address], None]) -> None:
        self._value = BrowserValue(
            gui, "address", "location.search", lambda text: arrived(Address.parse(text))
        )

    def show(self, address: Address) -> None:
        """Write an address, without a step in the browser's history."""
        self._value.change(f"history.replaceState(null,'',location.pathname+{json.dumps(address.query())})")
