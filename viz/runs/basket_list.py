"""The robots in a basket as HTML, each with a button that takes it out."""

from __future__ import annotations

import html
from collections.abc import Sequence

REMOVE = "basket"
"""Name under which the buttons report clicks; what follows is the position in the list."""


def render(rows: Sequence[tuple[str, int, int, float | None]], handler: str) -> str:
    """Return the list.

    Args:
        rows: run, number, modules and f_s in cm of each robot.
        handler: JavaScript for ``onclick`` that reports ``data-c``, escaped.
    """
    if not rows:
        return (
            '<div class="ta-basket" style="font-size:13px;opacity:.7;padding:0 10px 6px">'
            "The basket is empty. It keeps robots of any runs until you close this tab.</div>"
        )
    lines = [
        '<div style="display:grid;grid-template-columns:1fr auto auto;gap:8px;align-items:center;'
        'padding:2px 0">'
        '<span style="min-width:0;overflow:hidden;text-overflow:ellipsis;white-space:nowrap" '
        f'title="{html.escape(run)}"><b>{number}</b> <span style="opacity:.65">· {html.escape(run)} · '
        f"{modules} modules</span></span>"
        f"<span>{'' if f_s is None else f'{f_s:.1f} cm'}</span>"
        f'<button type="button" data-c="{REMOVE}:{k}" title="Take it out" '
        f'aria-label="Take robot {number} of {html.escape(run)} out" style="border:0;background:none;'
        'color:inherit;cursor:pointer;font-size:15px;padding:2px 6px;opacity:.8">×</button></div>'
        for k, (run, number, modules, f_s) in enumerate(rows)
    ]
    return (
        f'<div class="ta-basket" onclick="{handler}" style="font-size:13px;padding:0 10px 6px;'
        f'max-height:180px;overflow:auto">{"".join(lines)}</div>'
    )
