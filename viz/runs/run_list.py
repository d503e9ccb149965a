"""Runs to choose from, as HTML: what each is and how far it came."""

from __future__ import annotations

import dataclasses
import html
import math
from collections.abc import Collection, Sequence
from typing import Final, Literal

from viz import theme

State = Literal["live", "finished", "paused", "stopped"]

_COLORS: Final = {
    "live": theme.GOOD_TEXT,
    "paused": theme.WARNING_TEXT,
    "stopped": theme.WARNING_TEXT,
}
_STYLE: Final = (
    "<style>.ta-runs button{display:block;width:100%;border:0;color:inherit;font:inherit;text-align:left;"
    "cursor:pointer;background:none;border-radius:5px;padding:5px 8px}"
    ".ta-runs button:hover,.ta-runs button:focus-visible{background:rgba(128,128,128,.18)}"
    '.ta-runs button[aria-selected="true"]{background:rgba(54,179,160,.16)}'
    ".ta-runs .n{display:flex;justify-content:space-between;gap:10px;font-size:13px}"
    ".ta-runs .n b{overflow:hidden;text-overflow:ellipsis;white-space:nowrap}"
    ".ta-runs .d{display:block;font-size:11.5px;line-height:1.6;opacity:.8}"
    ".ta-runs button[disabled]{cursor:default}"
    ".ta-runs button[role=checkbox]{position:relative;padding-left:32px}"
    ".ta-runs button[role=checkbox]::before{content:'';position:absolute;left:9px;top:8px;width:13px;"
    "height:13px;border:1px solid rgba(128,128,128,.9);border-radius:3px;font:700 11px/13px system-ui;"
    "text-align:center;color:#10201d}"
    '.ta-runs button[aria-checked="true"]::before{content:"✓";background:#36b3a0;border-color:#36b3a0}'
    ".ta-runs button[role=checkbox][disabled]::before{visibility:hidden}</style>"
)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class RunFacts:
    """What a list says of a run.

    Attributes:
        task, algorithm: from its configuration.
        n_evaluations: that are saved.
        n_closed: of them in closed generations, by which runs are compared.
        best: its best f_s in m, None if there is none yet.
        date: of its beginning, such as 2026-11-24.
        state: whether it is being written, is complete, was paused by its user, or none of these.
        note: that its user has written.
        problem: why it cannot be shown, in which case nothing else is known.
    """

    task: str = ""
    algorithm: str = ""
    n_evaluations: int = 0
    n_closed: int = 0
    best: float | None = None
    date: str = ""
    state: State = "stopped"
    note: str = ""
    problem: str | None = None


SORTS: Final = ("name", "newest", "best f_s", "task")
"""Orders of a list of runs, the usual one first."""
Listed = tuple[str, RunFacts]
"""A run's label and what is known of it."""


def arranged(runs: Sequence[Listed], search: str, order: str) -> list[Listed]:
    """Return the runs that have every word of a search, in one of the orders; an unknown one is the usual."""
    words = search.lower().split()

    def has(label: str, f: RunFacts) -> bool:
        text = f"{label} {f.task} {f.algorithm} {f.date} {f.state} {f.note}".lower()
        return all(word in text for word in words)

    found = [(label, f) for label, f in runs if has(label, f)]
    if order == "newest":
        found.sort(key=lambda r: r[1].date, reverse=True)
    elif order == "best f_s":
        found.sort(key=lambda r: -math.inf if r[1].best is None else r[1].best, reverse=True)
    elif order == "task":
        found.sort(key=lambda r: (r[1].task, r[1].algorithm))
    return found


def state_markup(state: State) -> str:
    """Return a run's state for people."""
    mark = "● live" if state == "live" else state
    color = _COLORS.get(state)
    return f'<b style="color:{color}">{mark}</b>' if color else mark


def render_chosen(label: str, n_runs: int, is_open: bool, on_click: str) -> str:
    """Return the chosen run as a button that opens and closes the list.

    Args:
        label: of the run; empty if none is chosen.
        n_runs: to choose from.
        is_open: whether the list is shown.
        on_click: JavaScript, already escaped for an attribute; the button has ``data-c`` = ``runs:0``.
    """
    name = html.escape(label) or "no run"
    count = f"{n_runs} run{'' if n_runs == 1 else 's'}"
    return (
        '<div style="padding:6px 10px 2px"><button type="button" class="ta-run" data-c="runs:0"'
        f' onclick="{on_click}" aria-expanded="{str(is_open).lower()}" title="Choose a run"'
        ' style="display:flex;width:100%;'
        "gap:10px;align-items:center;border:1px solid rgba(128,128,128,.4);border-radius:6px;"
        'background:rgba(128,128,128,.1);color:inherit;font:inherit;padding:5px 9px;cursor:pointer">'
        '<b style="flex:1;text-align:left;font-size:13.5px;overflow:hidden;text-overflow:ellipsis;'
        f'white-space:nowrap">{name}</b><span style="font-size:11.5px;opacity:.75">{count}</span>'
        f'<span aria-hidden="true">{"▴" if is_open else "▾"}</span></button></div>'
    )


def render_list(runs: Sequence[tuple[str, RunFacts]], chosen: int | None, on_click: str) -> str:
    """Return the list.

    Args:
        runs: labels and facts.
        chosen: index of the one that is shown.
        on_click: JavaScript, already escaped for an attribute; a run has ``data-c`` = ``run:INDEX``.
    """
    rows = [_row(k, label, facts, k == chosen, on_click) for k, (label, facts) in enumerate(runs)]
    return (
        f'{_STYLE}<div class="ta-runs" role="listbox" aria-label="Runs" style="max-height:min(560px,62vh);'
        "overflow-y:auto;margin:2px 10px 6px;padding:3px;border:1px solid rgba(128,128,128,.3);"
        f'border-radius:6px">{"".join(rows) or "no runs yet"}</div>'
    )


def render_choices(runs: Sequence[tuple[str, RunFacts]], chosen: Collection[int], on_click: str) -> str:
    """Return a list of which any number of runs can be chosen; one with a problem cannot.

    Args:
        runs: labels and facts.
        chosen: indices of the chosen ones.
        on_click: JavaScript, already escaped for an attribute; a run has ``data-c`` = ``run:INDEX``, the
            button that chooses all ``all:0``, the one that chooses none ``none:0``.
    """
    rows = [
        _row(k, label, facts, k in chosen, on_click, role="checkbox", state="aria-checked")
        for k, (label, facts) in enumerate(runs)
    ]
    links = "".join(
        f'<button type="button" data-c="{name}:0" onclick="{on_click}" title="Choose {name} of the runs"'
        f' style="border:0;background:none;color:{theme.GOOD_TEXT};font:inherit;padding:0 0 0 10px;'
        'cursor:pointer">'
        f"{name}</button>"
        for name in ("all", "none")
    )
    return (
        f'{_STYLE}<div style="display:flex;margin:4px 10px 3px;font-size:12px">'
        f'<span style="flex:1;opacity:.8">{len(chosen)} of {len(runs)} runs chosen</span>{links}</div>'
        '<div class="ta-runs ta-choices" role="group" aria-label="Runs to compare" style="max-height:340px;'
        "overflow-y:auto;margin:2px 10px 8px;padding:3px;border:1px solid rgba(128,128,128,.3);"
        f'border-radius:6px">{"".join(rows) or "no runs yet"}</div>'
    )


def _row(
    index: int,
    label: str,
    facts: RunFacts,
    chosen: bool,
    on_click: str,
    *,
    role: str = "option",
    state: str = "aria-selected",
) -> str:
    disabled = " disabled" if facts.problem is not None and role == "checkbox" else ""
    if facts.problem is not None:
        best, details = "", f'<span style="color:{theme.BAD_TEXT}">{html.escape(facts.problem)}</span>'
    else:
        best = "" if facts.best is None else f"{100 * facts.best:.2f} cm"
        date = f" · {html.escape(facts.date)}" if facts.date else ""
        details = (
            f"{html.escape(facts.task)} · {html.escape(facts.algorithm)} · {facts.n_evaluations:,}"
            f" evaluations{date} · {state_markup(facts.state)}"
        )
        if facts.note:
            line = html.escape(facts.note.splitlines()[0][:90])
            details += f'<i style="display:block;white-space:normal">{line}</i>'
    return (
        f'<button type="button" role="{role}" {state}="{str(chosen).lower()}" data-c="run:{index}"'
        f' onclick="{on_click}"{disabled}><span class="n"><b>{html.escape(label)}</b>'
        f'<span title="best f_s">{best}</span></span><span class="d">{details}</span></button>'
    )
