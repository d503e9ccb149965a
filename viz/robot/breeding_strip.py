"""What is bred, as HTML: the parents to come, and the children of a run, each drawn, with its gain."""

from __future__ import annotations

import dataclasses
import html
from collections.abc import Collection, Sequence
from typing import Final

from engine.body.morphology import Morphology, body_changes
from engine.storage.layouts.tables import Record
from viz import theme
from viz.robot import body_drawing

MOST: Final = 30
"""Children that are shown, the best."""
PARENTS: Final = "Their parents"
THOUSAND: Final = 1000
_STYLE: Final = """<style>
.ta-breed{font-size:12px;line-height:1.3;padding:2px 10px 6px}
.ta-breed h4{margin:8px 0 4px;font-size:12px;font-weight:600;opacity:.75}
.ta-tiles{display:grid;grid-template-columns:repeat(auto-fill,minmax(86px,1fr));gap:6px}
.ta-tile{position:relative;border:1px solid rgba(128,128,128,.28);border-radius:8px;
background:rgba(128,128,128,.08);overflow:hidden;animation:ta-born .5s ease-out}
.ta-tile:hover,.ta-tile:focus-within{background:rgba(128,128,128,.18)}
.ta-tile[data-shown="1"]{border-color:#ff5d8f;box-shadow:0 0 0 1px #ff5d8f}
.ta-tile[data-kept="1"]{border-color:var(--ta-good,#36b3a0);box-shadow:0 0 0 1px var(--ta-good,#36b3a0)}
.ta-tile button{all:unset;cursor:pointer;box-sizing:border-box}
.ta-tile button:focus-visible{outline:2px solid #36b3a0;outline-offset:-2px;border-radius:8px}
.ta-tile .ta-play{display:block;width:100%;padding:4px 6px 5px;text-align:center}
.ta-play svg{display:block;width:100%;height:42px;margin-bottom:2px}
.ta-play b{font-size:13.5px;font-variant-numeric:tabular-nums}
.ta-play small{display:block;font-size:11px;white-space:nowrap;overflow:hidden;text-overflow:ellipsis}
.ta-tile .ta-keep,.ta-tile .ta-drop{position:absolute;top:0;padding:3px 6px 5px;font-size:13px;line-height:1;
opacity:.55}
.ta-tile .ta-keep{left:0}.ta-tile .ta-drop{right:0}
.ta-tile .ta-keep:hover,.ta-tile .ta-drop:hover,.ta-tile .ta-keep[aria-pressed=true]{opacity:1}
.ta-tile .ta-keep[aria-pressed=true]{color:var(--ta-good,#36b3a0)}
@keyframes ta-born{from{opacity:0;transform:scale(.85)}}
@media (prefers-reduced-motion:reduce){.ta-tile{animation:none}}
</style>"""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Tile:
    """A robot as it is shown.

    Attributes:
        number: of its evaluation.
        morphology: its body.
        head: index of its head module.
        f_s: how much closer it comes, in cm; None if a simulation failed.
        gain: how much more than its parent, in cm; None if that is not known, or it has no parent.
        about: how it came about.
    """

    number: int
    morphology: Morphology
    head: int
    f_s: float | None
    gain: float | None
    about: str


def tiles_of(records: Sequence[Record], distance: float) -> tuple[list[Tile], list[Tile]]:
    """Return the robots that a run started from, and their descendants, the best first.

    Args:
        records: of the run.
        distance: from which f_s is measured, in m.
    """
    known = {r.number: r for r in records}
    given: list[Tile] = []
    born: list[Tile] = []
    for r in records:
        parent = None if r.parent is None else known.get(r.parent)
        gain = None
        if parent is not None and parent.fitness is not None and r.fitness is not None:
            gain = 100.0 * (parent.fitness - r.fitness)
        tile = Tile(
            number=r.number,
            morphology=r.morphology,
            head=r.morphology.n_modules - 1 if r.head_is_end else 0,
            f_s=None if r.fitness is None else 100.0 * (distance - r.fitness),
            gain=gain,
            about=_about(r, parent),
        )
        (given if r.operator == "given" else born).append(tile)
    born.sort(key=lambda tile: (tile.f_s is None, -(tile.f_s or 0.0), tile.number))
    return given, born


def render_children(
    given: Sequence[Tile],
    born: Sequence[Tile],
    *,
    kept: Collection[int],
    dropped: Collection[int],
    shown: int | None,
    heading: str,
    handler: str,
) -> str:
    """Return the robots of a run.

    Args:
        given: that it started from.
        born: their descendants, the best first.
        kept: numbers of those that will be bred from.
        dropped: numbers of those that are not to be seen.
        shown: number of the one that is replayed.
        heading: over the descendants.
        handler: JavaScript for ``onclick`` that reports ``data-c``, escaped.
    """
    left = [tile for tile in born if tile.number not in dropped]
    rows = []
    for title, tiles in ((html.escape(heading), left[:MOST]), (PARENTS, given)):
        if tiles or title != PARENTS:
            drawn = "".join(_tile(tile, tile.number in kept, tile.number == shown) for tile in tiles)
            rows.append(f'<h4>{title}</h4><div class="ta-tiles">{drawn}</div>')
    more = f"<div>and {len(left) - MOST} more</div>" if len(left) > MOST else ""
    return f'<div class="ta-breed ta-children" onclick="{handler}">{"".join(rows)}{more}</div>'


def render_parents(parents: Sequence[tuple[str, Morphology, int]], handler: str) -> str:
    """Return the robots that will be bred from, each with a button that takes it out again.

    Args:
        parents: name, body and index of the head module of each.
        handler: JavaScript for ``onclick`` that reports ``data-c``, escaped.
    """
    invitation = (
        "Breed from the robot that you see, or choose up to eight: add them here, or mark children with ♥."
    )
    tiles = "".join(
        '<div class="ta-tile" data-kept="1"><span class="ta-play">'
        f"{body_drawing.svg(body, head)}<small>{html.escape(name)}</small></span>"
        f'<button type="button" class="ta-drop" data-c="unmark:{k}" title="Take it out"'
        f' aria-label="Take {html.escape(name)} out">×</button></div>'
        for k, (name, body, head) in enumerate(parents)
    )
    inner = (
        f'<div class="ta-tiles">{tiles}</div>' if tiles else f'<div style="opacity:.75">{invitation}</div>'
    )
    return (
        f'{_STYLE}{body_drawing.symbols()}<div class="ta-breed ta-parents" onclick="{handler}">{inner}</div>'
    )


def clicked_number(index: tuple[int, ...]) -> int | None:
    """Return the number of the robot that a click names, None if it names none."""
    return index[0] * THOUSAND + index[1] if len(index) == 2 and index[1] < THOUSAND else None


def _tile(tile: Tile, kept: bool, shown: bool) -> str:
    at = f"{tile.number // THOUSAND},{tile.number % THOUSAND}"
    closer = "failed" if tile.f_s is None else f"{tile.f_s:+.1f} cm"
    said = "it failed" if tile.f_s is None else f"it comes {tile.f_s:.1f} cm closer"
    gain = "&nbsp;"
    if tile.gain is not None:
        color = theme.GOOD_TEXT if tile.gain >= 0.05 else theme.BAD_TEXT if tile.gain <= -0.05 else "inherit"
        told = "as its parent" if abs(tile.gain) < 0.05 else f"{tile.gain:+.1f} to parent"
        gain = f'<span style="color:{color}">{told}</span>'
    keep = "Do not breed from" if kept else "Breed from"
    return (
        f'<div class="ta-tile" data-number="{tile.number}" data-shown="{shown:d}" data-kept="{kept:d}">'
        f'<button type="button" class="ta-play" data-c="replay:{at}"'
        f' title="Robot {tile.number}: {html.escape(tile.about)}; {said}. Click to see it crawl">'
        f"{body_drawing.svg(tile.morphology, tile.head)}<b>{closer}</b><small>{gain}</small></button>"
        f'<button type="button" class="ta-keep" data-c="keep:{at}" aria-pressed="{str(kept).lower()}"'
        f' title="{keep} it" aria-label="{keep} robot {tile.number}">{"♥" if kept else "♡"}</button>'
        f'<button type="button" class="ta-drop" data-c="drop:{at}" title="Drop it"'
        f' aria-label="Drop robot {tile.number}">×</button></div>'
    )


def _about(r: Record, parent: Record | None) -> str:
    if parent is None:
        return r.source or "random"
    parts = body_changes(parent.morphology, r.morphology)
    if r.operator in ("controller", "both"):
        parts.append("network mutated")
    return f"from robot {parent.number}, {' · '.join(parts) or r.operator}"
