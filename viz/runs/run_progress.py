"""How a run fares, as HTML: progress, speed, time left, and what went wrong."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence
from typing import Final

from viz import theme

_LINE: Final = "font-size:12.5px;line-height:1.5;padding:1px 10px 4px"
_DUMP: Final = re.compile(r"evaluation-(\d+)-(?:target-(\d+)-repeat-(\d+)|(.+))")


def duration(seconds: float) -> str:
    """Return a duration for people: ``40 s``, ``12 min``, ``3 h 20 min``, ``2 days 4 h``."""
    if seconds < 90:
        return f"{max(seconds, 1):.0f} s"
    minutes = round(seconds / 60)
    if minutes < 90:
        return f"{minutes} min"
    hours, minutes = divmod(minutes, 60)
    if hours < 36:
        return f"{hours} h {minutes} min" if minutes else f"{hours} h"
    days, hours = divmod(hours, 24)
    return f"{days} days {hours} h" if hours else f"{days} days"


def render(n: int, budget: int, *, speed: float | None, n_failed: int, n_kept: int | None = None) -> str:
    """Return how far a run is.

    Args:
        n: evaluations that it holds.
        budget: evaluations that it will hold.
        speed: in evaluations per second; None if it is not known or the run is not live.
        n_failed: evaluations with a failed simulation.
        n_kept: robots that a slimmed run holds; None for others.
    """
    parts = [f"{n:,} of {budget:,} evaluations"]
    if speed is not None:
        rate = f"{speed:.1f} per s" if speed >= 1 else f"{60 * speed:.1f} per min"
        parts += [rate, f"{duration((budget - n) / speed)} left"]
    if n_failed:
        parts.append(f"{n_failed:,} failed")
    if n_kept is not None:
        parts.append(f"slimmed: it holds {n_kept:,} robots and cannot be resumed")
    return f'<div class="ta-progress" style="{_LINE};opacity:.85">{" · ".join(parts)}</div>'


def render_trouble(last_words: Sequence[str]) -> str:
    """Return the notice of a run whose process ended before the run was complete.

    Args:
        last_words: the last lines of its log.
    """
    lines = "".join(
        f'<div style="white-space:pre-wrap;overflow-wrap:anywhere">{html.escape(line[:300])}</div>'
        for line in last_words
    )
    said = f'Its log ends with:<div style="font:11px/1.4 monospace;margin-top:3px">{lines}</div>'
    return (
        f'<div class="ta-trouble" role="alert" style="{_LINE};border-left:2px solid #ff7b72;margin:2px 10px">'
        "The process ended before the run was complete. What was finished is saved; <b>Resume</b> goes on"
        f" there. {said if lines else ''}</div>"
    )


def render_failures(names: Sequence[str], on_click: str) -> str:
    """Return a list of failed simulations to look at.

    Args:
        names: of their dumps.
        on_click: JavaScript, already escaped for an attribute; a dump has ``data-c`` = ``dump:INDEX``.
    """
    buttons = "".join(
        f'<button type="button" data-c="dump:{k}" onclick="{on_click}" title="Watch its last moments"'
        f' style="display:block;border:0;background:none;color:{theme.WARNING_TEXT};font:inherit;'
        f'padding:1px 0;cursor:pointer;text-align:left">▸ {html.escape(_dump_label(name))}</button>'
        for k, name in enumerate(names)
    )
    return (
        f'<details class="ta-failures" style="{_LINE}"><summary style="cursor:pointer">Failed simulations'
        f' kept ({len(names)})</summary><div style="max-height:120px;overflow-y:auto;padding-left:10px">'
        f"{buttons}</div></details>"
    )


def _dump_label(name: str) -> str:
    match = _DUMP.fullmatch(name)
    if match is None:
        return name[:60]
    number, target, repeat, stage = match.groups()
    where = f"target {int(target) + 1}, seed {int(repeat) + 1}" if target else stage.replace("-", " ")
    return f"robot {int(number)}, {where}"
