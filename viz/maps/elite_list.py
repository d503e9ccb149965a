"""The elites of a run's maps as a list, the best first, that can be searched."""

from __future__ import annotations

import dataclasses
import html
from collections.abc import Mapping, Sequence
from typing import Final

from engine.search.archive import Cell, cell_name
from viz.maps.contents import Content, ShownElite

MOST: Final = 400
"""Rows of a list; the search finds the others."""
THOUSAND: Final = 1000
_SMALL: Final = '<span style="opacity:.6;display:block;font-size:11px">{}</span>'
_STYLE: Final = (
    "<style>.ta-elites button{all:unset;box-sizing:border-box;display:grid;width:100%;cursor:pointer;"
    "grid-template-columns:52px 84px 1fr;gap:0 8px;padding:3px 6px;border-radius:5px;"
    "font-variant-numeric:tabular-nums}.ta-elites button:hover{background:rgba(128,128,128,.18)}"
    ".ta-elites button:focus-visible{outline:2px solid #36b3a0}"
    "</style>"
)


@dataclasses.dataclass(frozen=True, slots=True)
class ListedElite:
    """An elite.

    Attributes:
        elite: as maps know it.
        places: the archives and cells that it holds.
        robust: f_s in cm under noise that it was not selected with, None if that is not known.
    """

    elite: ShownElite
    places: tuple[tuple[str, Cell], ...]
    robust: float | None = None

    @property
    def words(self) -> str:
        """What the search looks at."""
        body = self.elite.morphology
        places = " ".join(f"{archive} {cell_name(cell)}" for archive, cell in self.places)
        return (
            f"robot {self.elite.number} {body.n_modules} modules stiffness {body.stiffness_text}"
            f" generation {self.elite.generation} {places}"
        ).lower()


def listed(contents: Mapping[str, Content], robust: Mapping[int, float] = {}) -> list[ListedElite]:
    """Return all elites of some archives once each, the best first.

    Args:
        contents: the archives by name.
        robust: as of ``best_elite``.
    """
    found: dict[int, ListedElite] = {}
    for archive, content in contents.items():
        for cell, elite in content.elites.items():
            known = found.get(elite.number, ListedElite(elite, (), robust.get(elite.number)))
            found[elite.number] = dataclasses.replace(known, places=(*known.places, (archive, cell)))
    return sorted(
        found.values(),
        key=lambda e: (e.robust is None, -(e.elite.f_s if e.robust is None else e.robust), e.elite.number),
    )


def searched(elites: Sequence[ListedElite], search: str, least: float | None) -> list[ListedElite]:
    """Return the elites that have every word of a search, and at least an f_s in cm."""
    words = search.lower().split()
    return [
        e
        for e in elites
        if (least is None or e.elite.f_s >= least) and all(word in e.words for word in words)
    ]


def click_name(number: int) -> str:
    """Return what a click on an elite reports; ``clicked_number`` reads it."""
    return f"elite:{number // THOUSAND},{number % THOUSAND}"


def clicked_number(name: str, index: tuple[int, ...]) -> int | None:
    """Return the number of the elite that was clicked, None for any other click."""
    if name != "elite" or len(index) != 2 or index[1] >= THOUSAND:
        return None
    return index[0] * THOUSAND + index[1]


def mark(chosen: int | None) -> str:
    """Return the style that marks the chosen robot in a list, wherever it is drawn: a click sends little."""
    if chosen is None:
        return ""
    return f'<style>.ta-elites [data-c="{click_name(chosen)}"]{{background:rgba(255,93,143,.16)}}</style>'


def _figures(elite: ListedElite) -> str:
    """Return what to expect of an elite, and what was recorded."""
    recorded = f"{elite.elite.f_s:.2f}"
    if elite.robust is None:
        return f"{recorded} cm"
    return f"{elite.robust:.2f} cm{_SMALL.format(f'recorded {recorded}')}"


def render(elites: Sequence[ListedElite], total: int, on_click: str) -> str:
    """Return the list.

    Args:
        elites: that were found.
        total: how many there are.
        on_click: JavaScript, already escaped for an attribute.
    """
    rows = []
    for e in elites[:MOST]:
        elite, body = e.elite, e.elite.morphology
        where = " · ".join(f"{archive} {cell_name(cell)}" for archive, cell in e.places)
        rows.append(
            f'<button type="button" data-c="{click_name(elite.number)}" onclick="{on_click}">'
            f'<b>{elite.number}</b><span style="text-align:right">{_figures(e)}</span>'
            f"<span>{body.n_modules} modules, {html.escape(body.stiffness_text)}"
            f"{_SMALL.format(html.escape(where))}</span></button>"
        )
    more = f", the first {MOST} are listed" if len(elites) > MOST else ""
    return (
        f'{_STYLE}<div class="ta-elites" style="font-size:12px;line-height:1.35;padding:0 6px 6px">'
        f'<div style="opacity:.7;padding:2px 6px">{len(elites)} of {total} elites{more}</div>'
        f'<div style="max-height:min(420px,52vh);overflow-y:auto">{"".join(rows)}</div></div>'
    )
