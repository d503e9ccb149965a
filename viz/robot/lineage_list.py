"""A robot's ancestors, one line each, like a log: the robot first, the random one it began with last."""

from __future__ import annotations

import html
from collections.abc import Sequence

from engine.body.feet import feet_note
from engine.body.morphology import body_changes
from engine.storage.rows import MAX_LINE, Ancestor
from viz import theme

THOUSAND = 1000


def click_name(number: int) -> str:
    """Return what a click on an ancestor reports; ``clicked_number`` reads it."""
    return f"ancestor:{number // THOUSAND},{number % THOUSAND}"


def clicked_number(name: str, index: tuple[int, ...]) -> int | None:
    """Return the number of the ancestor that was clicked, None for any other click."""
    if name != "ancestor" or len(index) != 2 or index[1] >= THOUSAND:
        return None
    return index[0] * THOUSAND + index[1]


def render(line: Sequence[Ancestor], shown: int, target_distance: float, on_click: str) -> str:
    """Return the list.

    Args:
        line: a robot, its parent, and so on; at least one.
        shown: number of the one that is shown.
        target_distance: from which f_s is measured, in m.
        on_click: JavaScript, already escaped for an attribute.
    """
    rows = [
        _row(a, line[k + 1] if k + 1 < len(line) else None, a.number == shown, target_distance, on_click)
        for k, a in enumerate(line)
    ]
    paired = any(a.operator == "paired" for a in line)
    notes = []
    if not line[-1].is_founder:
        notes.append(
            f"Only its last {MAX_LINE} ancestors are shown."
            if len(line) >= MAX_LINE
            else "This file does not hold its earlier ancestors."
        )
    if paired:
        notes.append(
            "This is the line of the bodies. Controllers evolve in a population of their own; whom they"
            " descend from is not recorded."
        )
    tail = "".join(f'<div style="opacity:.65;padding:6px 0 0">{n}</div>' for n in notes)
    return (
        '<div class="ta-lineage" style="font-size:12px;line-height:1.35;padding:2px 10px 6px">'
        "<style>.ta-lineage button{all:unset;box-sizing:border-box;display:grid;width:100%;cursor:pointer;"
        "grid-template-columns:16px 1fr auto;gap:0 6px;padding:4px 6px 4px 2px;border-radius:5px;"
        "position:relative}.ta-lineage button:hover{background:rgba(128,128,128,.18)}"
        ".ta-lineage button:focus-visible{outline:2px solid #36b3a0}"
        f".ta-lineage [aria-current=true]{{background:rgba(255,93,143,.16)}}"
        ".ta-lineage button:not(:last-child)::before{content:'';position:absolute;left:9px;top:17px;"
        "bottom:-5px;width:2px;background:rgba(128,128,128,.45)}</style>"
        f'<div style="max-height:340px;overflow-y:auto">{"".join(rows)}</div>{tail}</div>'
    )


def _row(a: Ancestor, parent: Ancestor | None, shown: bool, distance: float, on_click: str) -> str:
    f_s = None if a.fitness is None else 100 * (distance - a.fitness)
    gain = ""
    if f_s is not None and parent is not None and parent.fitness is not None:
        more = 100 * (parent.fitness - a.fitness) if a.fitness is not None else 0.0
        color = theme.GOOD_TEXT if more >= 0 else theme.BAD_TEXT
        gain = f'<span style="color:{color}"> {more:+.1f}</span>'
    dot = theme.SELECTED if shown else "#8b93a1"
    return (
        f'<button type="button" data-c="{click_name(a.number)}" onclick="{on_click}"'
        f' aria-current="{str(shown).lower()}" title="Show and replay robot {a.number}">'
        f'<span style="width:8px;height:8px;border-radius:50%;background:{dot};margin:4px 0 0 4px;'
        'z-index:1"></span>'
        f'<span><b>{a.number}</b><span style="opacity:.65"> · generation {a.generation}</span></span>'
        '<span style="text-align:right;font-variant-numeric:tabular-nums">'
        f"{'failed' if f_s is None else f'{f_s:.1f} cm'}{gain}</span>"
        f'<span style="grid-column:2/4;opacity:.75">{html.escape(origin(a, parent))}</span></button>'
    )


def origin(a: Ancestor, parent: Ancestor | None) -> str:
    """Return how a robot came about, in a few words.

    Args:
        a: the robot.
        parent: the one that it descends from, if it is known.
    """
    body = a.morphology
    if a.operator == "again":
        return "the same robot under other noise"
    if a.is_founder:
        kind = (a.source or "given") if a.operator == "given" else "random"
        return f"{kind}: {body.n_modules} modules, stiffness {body.stiffness_text}{feet_note(body.feet)}"
    parts = body_changes(parent.morphology, body) if parent is not None else []
    if a.operator in ("controller", "both"):
        parts.append("network mutated")
    elif a.operator in ("paired", "exchange"):
        parts.append("another network")
    elif a.operator == "switch":
        parts.append("joined with another network, which acts for targets at the right")
    return " · ".join(parts) or f"{a.operator} mutated"
