"""The card of a robot: body, origin and scores, as HTML for a narrow panel."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence

import numpy as np

from engine.analysis.profile import still_limit
from engine.analysis.robustness import Robustness
from engine.body.feet import FEET_TEXT
from engine.body.module import stiffness_n_per_m
from engine.body.morphology import Morphology
from engine.config import RunConfig
from engine.export import robot_id
from engine.replay.dump import Dump
from engine.simulation.evaluation import Evaluation
from engine.tasks import get_task, remaining_distance
from viz import theme, words
from viz.robot import head_paths

_LEAST_BAR = 2.0
"""Centimetres closer that the longest bar stands for, at least."""
_CARD = '<div class="ta-card" style="font-size:13px;line-height:1.45;padding:0 10px 8px">'
_ROW = (
    '<div style="display:flex;justify-content:space-between;gap:10px;font-size:12.5px">'
    '<span style="opacity:.65;white-space:nowrap">{}</span><span style="text-align:right">{}</span></div>'
)
_EXPLAINED = (
    '<span title="{}" style="text-decoration:underline dotted;white-space:nowrap;cursor:help">{}</span>'
)


def render(
    config: RunConfig,
    evaluation: Evaluation,
    where: str,
    entered: int | None,
    robust: Robustness | None = None,
) -> str:
    """Return a robot's card.

    Args:
        config: of its run.
        evaluation: the robot.
        where: the map and cell it was picked from.
        entered: the generation it was evaluated in.
        robust: what evaluating the run's elites again has shown, None if that was not done.
    """
    solution, task = evaluation.solution, get_task(config.task)
    body = solution.morphology
    f_s = None if evaluation.fitness is None else 100 * (task.target_distance - evaluation.fitness)
    again = None if robust is None else 100 * (task.target_distance - robust.fresh(solution.number))
    parts = [
        _CARD,
        f'<div style="font-size:17px;font-weight:600">Robot {solution.number}'
        f'<span style="font-weight:400;opacity:.65;font-size:13px"> · {html.escape(where)}</span></div>',
        _headline(f_s, again, 100 * still_limit(task)),
        _targets(config, evaluation),
        head_paths.render(config, evaluation),
        '<div style="height:6px"></div>',
        _ROW.format("modules", body.n_modules),
        _ROW.format("stiffness", _stiffness(body)),
        _ROW.format(_explained("faces", words.FACES), " ".join(map(str, body.faces))),
        *([_ROW.format("feet", _feet(body, config))] if body.feet != "none" else ()),
        _ROW.format(
            _explained("head", words.HEAD), f"module {body.n_modules if evaluation.head_is_end else 1}"
        ),
        _ROW.format("descends from", _origin(evaluation)),
    ]
    if entered is not None:
        parts.append(_ROW.format("generation", entered))
    if evaluation.failure:
        parts.append(f'<div style="color:{theme.BAD_TEXT}">failed: {html.escape(evaluation.failure)}</div>')
    parts.append(_ROW.format("id", robot_id(config, solution)))
    parts.append("</div>")
    return "".join(parts)


def render_verdict(material: str, problems: Sequence[str], instead: str = "") -> str:
    """Return whether a robot can be built from a material, and if not, why, and what is taken instead."""
    if not problems:
        text = f'<b style="color:{theme.GOOD_TEXT}">✓</b> can be built from {html.escape(material)}'
    else:
        text = (
            f'<b style="color:{theme.WARNING_TEXT}">✗</b> not from {html.escape(material)}'
            + (f", {html.escape(instead)} is taken instead" if instead else "")
            + f": {html.escape(problems[0])}"
            + (f" And {len(problems) - 1} more." if problems[1:] else "")
        )
    return (
        '<div class="ta-verdict" style="font-size:12px;line-height:1.4;margin:0 10px 6px;overflow:hidden;'
        'display:-webkit-box;-webkit-box-orient:vertical;-webkit-line-clamp:2"'
        f' title="{html.escape(chr(10).join(problems))}">{text}</div>'
    )


def in_words(f_s: float) -> str:
    """Return an f_s, or what a robot has gained on a target, in cm as people say it."""
    if abs(f_s) < 0.05:
        return "no closer"
    return f"{abs(f_s):.1f} cm {'closer' if f_s > 0 else 'farther'}"


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
    return _alone(
        failed.solution.number,
        f'<div style="color:{theme.BAD_TEXT};margin:2px 0 6px">The simulation failed: '
        f"{html.escape(failure.reason)}</div>",
        _ROW.format("while", where),
        _ROW.format("dumped", f"the last {shown:.2f} s"),
        _ROW.format("modules", body.n_modules),
        _ROW.format("stiffness", _stiffness(body)),
        _ROW.format("faces", " ".join(map(str, body.faces))),
        _ROW.format("time step", f"{1000 * dump.physics.timestep:g} ms"),
        _ROW.format("simulated with", html.escape(versions) or "unknown versions"),
    )


def render_drive(number: int, facts: Mapping[str, str]) -> str:
    """Return the card of a robot that was driven: its number and a row for each fact."""
    return _alone(
        number, *(_ROW.format(html.escape(name), html.escape(fact)) for name, fact in facts.items())
    )


def _alone(number: int, *parts: str) -> str:
    """Return the card of a robot that is in no map."""
    title = f'<div style="font-size:17px;font-weight:600">Robot {number}</div>'
    return "".join([_CARD, title, *parts, "</div>"])


def _stiffness(body: Morphology) -> str:
    """Return the stiffness of all modules, or of each where they differ in it."""
    if body.stiffness_mode == "shared":
        return f"{body.stiffness_text} · {stiffness_n_per_m(body.stiffness):.1f} N/m"
    return f"{body.stiffness_text} (first to last)"


def _feet(body: Morphology, config: RunConfig) -> str:
    """Return which way the feet slide, and both coefficients of friction."""
    physics = config.physics
    return f"{FEET_TEXT[body.feet]} · {physics.feet_forward:g} / {physics.feet_backward:g}"


def _headline(f_s: float | None, again: np.ndarray | None, still: float) -> str:
    """Return in words how much closer a robot comes, and its f_s below; all in cm.

    What to expect, if that is known, comes before what was recorded.
    """
    if f_s is None:
        return ""
    recorded = _explained(f"f<sub>s</sub> {f_s:.2f} cm", words.F_S)
    if again is None or not len(again):
        big, small = words.gained(f_s, still), f"{recorded}, as it was evaluated"
    else:
        spread = f" ± {again.std(ddof=1):.1f}" if len(again) > 1 else ""
        mean = float(again.mean())
        big = f"{words.gained(mean, still)}{spread and f'<small>{spread}</small>'}"
        small = f"{words.AGAIN.format(len(again))} {recorded}"
    return (
        f'<div style="margin:2px 0 8px"><div class="ta-closer" style="font-size:22px;font-weight:600">{big}'
        f'</div><div style="opacity:.7;font-size:12px">{small}</div></div>'
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
    if s.operator == "exchange":
        return f"{s.parent}, its body with another elite's controller"
    if s.operator == "switch":
        return f"{s.parent} for targets at the left, another network of its body for those at the right"
    what = {"both": "body and controller", "morphology": "body", "controller": "controller"}
    return f"{s.parent}, {what.get(s.operator, html.escape(s.operator))} mutated"


def _targets(config: RunConfig, evaluation: Evaluation) -> str:
    """Return a bar per target: how much closer the robot comes, mean and spread over the repeats."""
    task = get_task(config.task)
    gains = [
        (k, name, 100 * (task.target_distance - scores))
        for k, (name, scores) in enumerate(zip(task.target_names, evaluation.distances, strict=True))
        if np.isfinite(scores).all()
    ]
    if not gains:
        return ""
    means = [float(gained.mean()) for _, _, gained in gains]
    # from the worst or 0 to the best, at least so long that a millimetre is none
    low, high = min(0.0, *means), max(_LEAST_BAR, *means)
    rows = []
    for (k, name, gained), mean in zip(gains, means, strict=True):
        spread = f" ± {np.ptp(gained) / 2:.1f}" if len(gained) > 1 else ""
        left, right = sorted(100 * (v - low) / (high - low) for v in (0.0, mean))
        color = head_paths.COLORS[k % len(head_paths.COLORS)]
        rows.append(
            f'<span style="opacity:.65">{html.escape(name)}</span>'
            '<span style="position:relative;height:9px;border-radius:2px;background:rgba(128,128,128,.18)">'
            f'<span class="ta-gain" style="position:absolute;left:{left:.1f}%;width:{right - left:.1f}%;'
            f'top:0;bottom:0;border-radius:2px;background:{color}"></span>'
            f'<span style="position:absolute;left:{-100 * low / (high - low):.1f}%;top:-2px;bottom:-2px;'
            'width:1px;background:currentColor;opacity:.6"></span></span>'
            f'<span style="text-align:right;white-space:nowrap">{in_words(mean)}{spread}</span>'
        )
    scored = "" if task.score is remaining_distance else f"; by {html.escape(task.score_name)}"
    return (
        f'<div style="opacity:.65">by target, {100 * task.target_distance:.0f} cm away at first{scored}</div>'
        '<div style="display:grid;grid-template-columns:auto minmax(40px,1fr) auto;gap:1px 8px;'
        f'align-items:center">{"".join(rows)}</div>'
    )
