"""What plain and nested maps share: tiles, the ring, margins, labels, what the browser needs."""

from __future__ import annotations

import dataclasses
import html
from typing import Final

from engine.search.archive import Cell, cell_name
from viz import theme

LEFT: Final = 66
TOP: Final = 14
WIDTH: Final = 400
"""Width of a map of 9 columns, the usual one. Other pictures keep to it, so that their texts match."""
SHARED_STYLE: Final = (
    ".ta-map .z{fill-opacity:.38}"
    ".ta-map{outline-offset:3px;border-radius:4px}.ta-map:focus{outline:none}"
    f".ta-map:focus-visible{{outline:2px solid rgb{theme.ACCENT}}}"
    "@keyframes ta-flash{from{fill:#fff;stroke:#fff;stroke-width:3}}"
    "@media (prefers-reduced-motion:no-preference){.ta-map .f{animation:ta-flash 1.4s ease-out}}"
)
"""Rules for every map: the visible focus, and the flash of cells that have just been won."""

PALE: Final = 0.13
"""Opacity of cells that a filter leaves out."""


@dataclasses.dataclass(frozen=True, slots=True)
class Tile:
    """A filled cell.

    Attributes:
        hint: the lines of its hover card.
        number: of its evaluation.
        body: the faces of its robot, which the hover card draws; empty for no drawing.
        still: whether the robot lies still, which is pale.
        pale: whether a filter leaves the robot out, which is paler.
    """

    hint: str
    number: int
    body: str = ""
    still: bool = False
    pale: bool = False


@dataclasses.dataclass(frozen=True, slots=True)
class Ring:
    """A mark around the cell of the chosen robot.

    Attributes:
        cell: where the robot lies.
        linked: whether it was chosen in another archive.
        covered: whether the cell shows another, better robot.
    """

    cell: Cell
    linked: bool = False
    covered: bool = False

    @property
    def color(self) -> str:
        """Its colour."""
        return theme.LINKED if self.linked else theme.SELECTED


def attributes(name: str, cell: tuple[int, int], start: Cell | None) -> str:
    """Return what makes a map reachable by keyboard, see ``viz.maps.interaction``.

    Args:
        name: of the map.
        cell: width and height of its cells.
        start: the cell where the keyboard begins; None if no cell is filled.
    """
    begin = "" if start is None else f' data-start="{cell_name(start)}"'
    return (
        f'data-map="{html.escape(name)}" data-size="{cell[0]},{cell[1]}"{begin} tabindex="0"'
        f' role="application" aria-label="{html.escape(name)} map: arrow keys choose a robot, Enter replays'
        ' it, Space pauses"'
    )


def text(x: float, y: float, content: str, *, anchor: str = "start", small: bool = False) -> str:
    """Return a label as SVG; the content is markup."""
    look = ' fill-opacity="0.75" font-size="10"' if small else ""
    place = "" if anchor == "start" else f' text-anchor="{anchor}"'
    return f'<text x="{x:g}" y="{y:g}"{place} fill="currentColor"{look}>{content}</text>'


def upright_text(x: float, y: float, content: str) -> str:
    """Return an axis's title that reads upwards, centred; the content is markup."""
    return (
        f'<text transform="translate({x:g} {y:g}) rotate(-90)" text-anchor="middle" fill="currentColor">'
        f"{content}</text>"
    )
