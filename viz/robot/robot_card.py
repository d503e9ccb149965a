"""The card of a robot: body, origin and scores, as HTML for a narrow panel."""

from __future__ import annotations

import html

import numpy as np

from engine.analysis.profile import still_limit
from engine.body.module import stiffness_n_per_m
from engine.body.morphology import Morphology
from engine.config import RunConfig
from engine.replay.dump import Dump
from engine.simulation.evaluation import Evaluation
from engine.tasks import get_task
from viz import theme, words

_ROW = (
    '<div style="display:flex;justify-content:space-between;gap:10px;padding:2px 0">'
    '<span style="opacity:.65">{}</span><span style="text-align:right">{}</span></div>'
)
_EXPLAINED = '<span title="{}" style="text-decoration:underline dotted;cursor:help">{}</span>'


def render(config: RunConfig, evaluation: Evaluation, where: str, entered: int | None) -> str:
    """Return a robot's card.

    Args:
        config: of its run.
        evaluation: the robot.
        where: the map and cell it was picked from.
        entered: the generation it was evaluated in.
    """
    solution, task = evaluation.solution, get_task(config.task)
    body = solution.morphology
    f_s = None if evaluation.fitness is None else 100 * (task.target_distance - evaluation.fitness)
    parts = [
        '<div class="ta-card" style="font-size:13px;line-height:1.45;padding:0 10px 8px">',
        f'<div style="font-size:17px;font-weight:600">Robot {solution.number}'
        f'<span style="font-weight:400;opacity:.65;font-size:13px"> · {html.escape(where)}</span></div>',
        _headline(f_s, 100 * still_limit(task)),
        _ROW.format("modules", body.n_modules),
        _ROW.format("stiffness", _stiffness(body)),
        _ROW.format(_explained("faces", words.FACES), " ".join(map(str, body.faces))),
        _ROW.format(
            _explained("head", words.HEAD), "last module" if evaluation.head_is_end else "first module"
        ),
        _ROW.format("descends from", _origin(evaluation)),
    ]
    if entered is not None:
        parts.append(_ROW.format("generation", entered))
    if evaluation.failure:
        parts.append(f'<div style="color:{theme.BAD_TEXT}">failed: {html.escape(evaluation.failure)}</div>')
    parts.append(_targets(config, evaluation))
    parts.append("</div>")
    return "".join(parts)


def render_failure(dump: Dump) -> str:
    """Return the card of a robot whose simulation failed."""
    failed, failure, body = dump.failed, dump.failed.failure, dump.failed.solution.morphology
    stages = {"settling": "settling", "head-search": "finding its head"}
    if failed.target is None or failed.repeat is None:
        where = stages[failed.stage]
    else:
        name = get_task(dump.task).target_names[failed.target]
        where = f"target {html.escape(name)}, seed {failed.repeat + 1}"
    versions = " · ".join(
        f"{name} {dump.versions[name]}" for name in ("tensatlas", "mujoco") if name in dump.versions
    )
    shown = len(failure.controls) * dump.physics.control_period
    return "".join(
        [
            '<div class="ta-card" style="font-size:13px;line-height:1.45;padding:0 10px 8px">',
            f'<div style="font-size:17px;font-weight:600">Robot {failed.solution.number}</div>',
            f'<div style="color:{theme.BAD_TEXT};margin:2px 0 6px">The simulation failed: '
            f"{html.escape(failure.reason)}</div>",
            _ROW.format("while", where),
            _ROW.format("dumped", f"the last {shown:.2f} s"),
            _ROW.format("modules", body.n_modules),
            _ROW.format("stiffness", _stiffness(body)),
            _ROW.format("faces", " ".join(map(str, body.faces))),
            _ROW.format("time step", f"{1000 * dump.physics.timestep:g} ms"),
            _ROW.format("simulated with", html.escape(versions) or "unknown versions"),
            "</div>",
        ]
    )


def _stiffness(body: Morphology) -> str:
    """Return the stiffness of all modules, or of each where they differ in it."""
    if body.stiffness_mode == "shared":
        return f"{body.stiffness_text} · {stiffness_n_per_m(body.stiffness):.1f} N/m"
    return f"{body.stiffness_text} (first to last)"


def _headline(f_s: float | None, still: float) -> str:
    """Return in words how much closer a robot comes, and its f_s beside it; all in cm."""
    if f_s is None:
        return ""
    said = _explained(f"f<sub>s</sub> {f_s:.2f} cm", words.F_S)
    return (
        '<div style="margin:2px 0 6px"><span style="font-size:22px;font-weight:600">'
        f'{words.gained(f_s, still)}</span> <span style="opacity:.65">{said}</span></div>'
    )


def _explained(markup: str, sentence: str) -> str:
    """Return words with a sentence about them that a mouse brings up."""
    return _EXPLAINED.format(html.escape(words.plain(sentence)), markup)


def _origin(evaluation: Evaluation) -> str:
    s = evaluation.solution
    if s.operator == "given":
        return html.escape(s.source or "a given robot")
    if s.parent is None:
        return "nobody (random)"
    if s.operator == "paired":
        return f"{s.parent}, body mutated; the controller is NEAT's"
    if s.operator == "again":
        return f"{s.parent}, the same robot under other noise"
    what = {"both": "body and controller", "morphology": "body", "controller": "controller"}
    return f"{s.parent}, {what.get(s.operator, html.escape(s.operator))} mutated"


def _targets(config: RunConfig, evaluation: Evaluation) -> str:
    """Return a bar per target: how the trials scored, mean and spread over the repeats."""
    task = get_task(config.task)
    start = 100 * task.target_distance
    rows = []
    for name, distances in zip(task.target_names, 100 * evaluation.distances, strict=True):
        if not np.isfinite(distances).all():
            continue
        mean, spread = distances.mean(), np.ptp(distances) / 2
        width = 100 * min(max(1 - mean / start, 0.0), 1.0)
        tail = f" ± {spread:.1f}" if len(distances) > 1 else ""
        rows.append(
            '<div style="display:grid;grid-template-columns:72px 1fr 92px;gap:8px;align-items:center">'
            f'<span style="opacity:.65">{html.escape(name)}</span>'
            '<span style="height:7px;border-radius:4px;background:rgba(128,128,128,.25)">'
            f'<span style="display:block;height:7px;border-radius:4px;width:{width:.0f}%;'
            'background:#36b3a0"></span></span>'
            f'<span style="text-align:right">{mean:.1f}{tail} cm</span></div>'
        )
    return (
        f'<div style="margin-top:8px;opacity:.65">{html.escape(task.score_name)}, by target '
        f"(at first {start:.0f} cm)</div>" + "".join(rows)
    )
