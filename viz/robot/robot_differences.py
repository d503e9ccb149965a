"""What robots differ in, as a table: what is not the same for all of them stands out."""

from __future__ import annotations

import dataclasses
import html
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from engine.analysis.robustness import Robustness
from engine.body.feet import FEET_TEXT
from engine.config import RunConfig
from engine.errors import printable
from engine.simulation.evaluation import Evaluation
from engine.tasks import get_task
from viz import theme, words

LETTERS = "ABCD"


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A robot to compare.

    Attributes:
        path: of its run.
        config: of the run.
        evaluation: the robot.
        entered: generation of the evaluation.
        robust: what evaluating the run's elites again has shown, None if that was not done.
    """

    path: Path
    config: RunConfig
    evaluation: Evaluation
    entered: int | None
    robust: Robustness | None = None

    @property
    def run(self) -> str:
        """Name of its run."""
        return printable(self.path.stem)

    @property
    def number(self) -> int:
        """Number of its evaluation."""
        return self.evaluation.solution.number


DifferenceRow = tuple[str, list[str], list[float | None]]
"""What is compared, the values as text, and numbers of which the largest is best: None where none is."""


def rows(entries: Sequence[Entry]) -> list[DifferenceRow]:
    """Return what robots are compared in, in cm where it is a length."""
    tasks = [get_task(e.config.task) for e in entries]
    bodies = [e.evaluation.solution.morphology for e in entries]
    nothing: list[float | None] = [None] * len(entries)
    found: list[DifferenceRow] = [
        ("run", [e.run for e in entries], nothing),
        ("robot", [str(e.number) for e in entries], nothing),
        ("generation", ["–" if e.entered is None else str(e.entered) for e in entries], nothing),
    ]
    if len({t.name for t in tasks}) > 1:
        found.append(("task", [t.name for t in tasks], nothing))
    found += [
        ("modules", [str(b.n_modules) for b in bodies], nothing),
        ("stiffness", [b.stiffness_text for b in bodies], nothing),
        ("faces", [" ".join(map(str, b.faces)) for b in bodies], nothing),
        ("head", ["last" if e.evaluation.head_is_end else "first" for e in entries], nothing),
    ]
    if {b.feet for b in bodies} != {"none"}:
        found.append(("feet", [FEET_TEXT[b.feet] for b in bodies], nothing))
    f_s = [
        None if e.evaluation.fitness is None else 100 * (t.target_distance - e.evaluation.fitness)
        for e, t in zip(entries, tasks, strict=True)
    ]
    again = [_again(e, t.target_distance) for e, t in zip(entries, tasks, strict=True)]
    if any(mean is not None for _, mean in again):
        found.append(("f_s again", [text for text, _ in again], [mean for _, mean in again]))
    found.append(("f_s", [_length(v) for v in f_s], f_s))
    for k in range(max(t.n_targets for t in tasks)):
        names = {t.target_names[k] for t in tasks if k < t.n_targets}
        means = [_mean(e.evaluation.distances, k) for e in entries]
        best = [None if m is None else -m for m in means]
        found.append((names.pop() if len(names) == 1 else f"target {k + 1}", [*map(_length, means)], best))
    return found


def render(entries: Sequence[Entry]) -> str:
    """Return the table of some robots, each under its letter and colour."""
    if not entries:
        return ""
    head = "".join(
        f'<th style="color:{_color(k)};text-align:right;padding:2px 0 2px 8px">{LETTERS[k]}</th>'
        for k in range(len(entries))
    )
    body = "".join(_row(*row) for row in rows(entries))
    return (
        '<div style="padding:2px 10px 6px;overflow-x:auto"><table class="ta-differences"'
        ' style="width:100%;border-collapse:collapse;font-size:12px;line-height:1.4;'
        'font-variant-numeric:tabular-nums">'
        f"<thead><tr><th></th>{head}</tr></thead><tbody>{body}</tbody></table>"
        '<div style="font-size:11px;opacity:.6;padding-top:3px">lengths in cm, the best one bold;'
        " a bar marks what differs; “again” is the mean under fresh noise</div></div>"
    )


def render_pins(entries: Sequence[Entry], handler: str) -> str:
    """Return the list of pinned robots, each with a button that unpins it, reported as ``unpin:k``."""
    return "".join(
        '<div style="display:flex;align-items:center;gap:8px;margin:0 10px 3px;padding:2px 4px 2px 8px;'
        f"font-size:12.5px;border-left:3px solid {_color(k)};background:rgba(128,128,128,.12);"
        f'border-radius:3px"><b>{LETTERS[k]}</b><span style="flex:1;overflow:hidden;text-overflow:ellipsis;'
        f'white-space:nowrap">robot {e.number} <span style="opacity:.6">{html.escape(e.run)}</span></span>'
        f'<button data-c="unpin:{k}" onclick="{handler}" title="Unpin" aria-label="Unpin {LETTERS[k]}"'
        ' style="all:unset;cursor:pointer;padding:2px 8px;opacity:.7">✕</button></div>'
        for k, e in enumerate(entries)
    )


def render_distances(lanes: Sequence[tuple[str | None, float | None]]) -> str:
    """Return how far robots are from their targets.

    Args:
        lanes: for every robot why its simulation failed, or None, and its distance in m, None before
            its trial begins.
    """
    parts = [
        f'<span><b style="color:{_color(k)}">{LETTERS[k]}</b> '
        + ("failed" if failure else "settles" if distance is None else f"{100 * distance:.1f}")
        + "</span>"
        for k, (failure, distance) in enumerate(lanes)
    ]
    return (
        '<div class="ta-lanes" style="display:flex;gap:12px;flex-wrap:wrap;font-size:12.5px;'
        'font-variant-numeric:tabular-nums;padding:0 10px 4px"><span style="opacity:.65">cm to go</span>'
        f"{''.join(parts)}</div>"
    )


def lane_name(entry: Entry, k: int) -> str:
    """Return the label of a robot's lane."""
    return f"{LETTERS[k]} · robot {entry.number}"


def _row(what: str, values: list[str], order: list[float | None]) -> str:
    differs = len(set(values)) > 1
    known = [v for v in order if v is not None]
    best = max(known) if differs and known else None
    cells = "".join(
        '<td style="text-align:right;vertical-align:top;padding:1px 0 1px 8px;overflow-wrap:break-word;'
        f'{"font-weight:650;" if best is not None and o == best else ""}">{html.escape(v)}</td>'
        for v, o in zip(values, order, strict=True)
    )
    mark = f"border-left:2px solid {theme.LINKED};" if differs else "border-left:2px solid transparent;"
    if not differs:
        cells = f'<td colspan="{len(values)}" style="text-align:right">{html.escape(values[0])}</td>'
    label = words.markup(html.escape(what))
    return (
        f'<tr class="{"differs" if differs else "same"}" style="opacity:{1 if differs else 0.6}">'
        f'<td style="{mark}padding:1px 0 1px 6px;white-space:nowrap;vertical-align:top">{label}</td>'
        f"{cells}</tr>"
    )


def _again(entry: Entry, distance: float) -> tuple[str, float | None]:
    """Return mean and standard deviation of f_s under fresh noise as text, and the mean in cm, if known."""
    mean = None if entry.robust is None else entry.robust.mean(entry.number)
    if entry.robust is None or mean is None:
        return _length(None), None
    f_s, deviation = 100 * (distance - mean), entry.robust.deviation(entry.number)
    return _length(f_s) + ("" if deviation is None else f" ± {100 * deviation:.1f}"), f_s


def _mean(distances: np.ndarray, target: int) -> float | None:
    """Return the mean over the repeats of a target, in cm, None if there is no such one or it failed."""
    if target >= len(distances) or not np.isfinite(distances[target]).all():
        return None
    return 100 * float(distances[target].mean())


def _color(k: int) -> str:
    """Return the CSS colour of a robot's lane."""
    return theme.css(theme.LANES[k])


def _length(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"
