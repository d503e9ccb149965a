"""A changed body as a grid of genes to click, and how it fares beside the original, as a table."""

from __future__ import annotations

import dataclasses
import html

import numpy as np

from engine.body import module as t
from engine.body.feet import feet_note
from engine.body.morphology import N_FACES, Morphology
from engine.config import RunConfig
from engine.simulation.evaluation import Evaluation
from engine.tasks import fitness, get_task, remaining_distance, target_offsets
from viz import theme

BETTER, WORSE = theme.GOOD_TEXT, theme.BAD_TEXT


@dataclasses.dataclass(frozen=True, slots=True)
class ComparedFigure:
    """A figure of original and variant, in cm, None where there is none.

    Attributes:
        what: the figure's name.
        original, variant: its values.
        higher_is_better: whether more of it is better.
    """

    what: str
    original: float | None
    variant: float | None
    higher_is_better: bool = False

    @property
    def change(self) -> float | None:
        """How much more the variant has."""
        if self.original is None or self.variant is None:
            return None
        return self.variant - self.original

    @property
    def is_better(self) -> bool:
        """Whether the variant does better."""
        change = self.change or 0.0
        return change > 0.0 if self.higher_is_better else change < 0.0


def compare(
    config: RunConfig, original: Evaluation, scores: np.ndarray | None, second: int
) -> list[ComparedFigure]:
    """Return f_s and every target's score of a robot and its variant.

    Args:
        config: of the run.
        original: the robot.
        scores: (targets, repeats) of the variant so far, in m, None before its trials.
        second: of the trials, at which the variant has these scores. At the trials' end, or where the
            original's path is not known, the original's final scores are taken.
    """
    task = get_task(config.task)
    theirs = scores_at(config, original, second)
    rows = [
        ComparedFigure("f_s", _f_s(task.target_distance, theirs), _f_s(task.target_distance, scores), True)
    ]
    for k, name in enumerate(task.target_names):
        rows.append(ComparedFigure(name, _mean(theirs[k]), None if scores is None else _mean(scores[k])))
    return rows


def scores_at(config: RunConfig, original: Evaluation, second: int) -> np.ndarray:
    """Return the (targets, repeats or 1) scores of a recorded robot at a second of its trials, in m.

    Before the end they follow from its recorded trajectory, which is the mean over its noise seeds.
    """
    task, path = get_task(config.task), original.trajectory
    if (
        task.score is remaining_distance
        and 1 <= second < config.trials.trial_time
        and second <= path.shape[1]
    ):
        ways = target_offsets(task) - path[:, second - 1].astype(float)
        return np.hypot(ways[:, 0], ways[:, 1])[:, None]
    return original.distances


def render_table(figures: list[ComparedFigure], heading: str, failure: str | None = None) -> str:
    """Return the table of a comparison.

    Args:
        figures: the rows of the table.
        heading: what the figures belong to.
        failure: why the variant has no fitness, or None.
    """
    body = "".join(
        f'<tr style="{"font-weight:650;font-size:13.5px" if k == 0 else ""}">'
        f'<td style="padding:1px 0;white-space:nowrap">{_name(figure.what)}</td>'
        f"<td{_RIGHT}>{_number(figure.original)}</td><td{_RIGHT}>{_number(figure.variant)}</td>"
        f'<td style="text-align:right;color:{_tint(figure)}">{_signed(figure.change)}</td></tr>'
        for k, figure in enumerate(figures)
    )
    failed = (
        f'<div style="color:{theme.BAD_TEXT};padding-top:4px">the simulation failed:'
        f" {html.escape(failure)}</div>"
        if failure
        else ""
    )
    return (
        '<div class="ta-what-if" style="padding:4px 10px 6px;font-size:12.5px;line-height:1.5;'
        f'font-variant-numeric:tabular-nums"><div style="opacity:.7">{html.escape(heading)}</div>'
        '<table style="width:100%;border-collapse:collapse"><thead style="opacity:.65"><tr><th></th>'
        f"<th{_RIGHT}>original</th><th{_RIGHT}>what if</th><th{_RIGHT}>change</th></tr></thead>"
        f"<tbody>{body}</tbody></table>{failed}</div>"
    )


def render_genes(body: Morphology, original: Morphology, handler: str) -> str:
    """Return the faces of a body as a grid to click: ``face:module,face``, with the module's index.

    The original's faces keep a ring; where the body has another one, that is filled in its own colour.
    """
    side, left, top = 27, 34, 16
    width, height = left + side * 10, top + side * N_FACES // 2 + 22
    row = side / 2
    parts = [
        f'<svg class="ta-genes" viewBox="0 0 {width} {height}" width="100%" onpointerdown="{handler}"'
        ' style="display:block;touch-action:manipulation;font:10px system-ui,sans-serif;user-select:none">'
        f'<text x="0" y="{top - 6}" fill="currentColor" fill-opacity=".65">face of module</text>'
    ]
    for face in range(1, N_FACES + 1):
        y = top + (face - 1) * row
        parts.append(
            f'<text x="{left - 8}" y="{y + row / 2 + 3.5}" text-anchor="end" fill="currentColor"'
            f' fill-opacity=".65">{face}</text>'
        )
        for module in range(body.n_modules):
            chosen = body.faces[module] == face
            was = module < original.n_modules and original.faces[module] == face
            fill = "rgba(128,128,128,.18)"
            if chosen:
                fill = theme.css(theme.ACCENT) if was else theme.LINKED
            ring = ' stroke="currentColor" stroke-opacity=".75"' if was and not chosen else ""
            parts.append(
                f'<rect data-c="face:{module},{face}" data-m="{module}"'
                f' x="{left + module * side + 1}" y="{y + 1}" width="{side - 2}" height="{row - 2}"'
                f' rx="2.5" fill="{fill}"{ring}'
                f' style="cursor:pointer"><title>module {t.module_number(module)}, face {face}</title></rect>'
            )
    y = top + N_FACES * row + 12
    for module in range(body.n_modules):
        new = module >= original.n_modules
        parts.append(
            f'<text x="{left + (module + 0.5) * side}" y="{y}" text-anchor="middle"'
            f' fill="{theme.LINKED if new else "currentColor"}" fill-opacity="{1 if new else 0.65}">'
            f"{t.module_number(module)}</text>"
        )
    return f'<div style="padding:6px 10px 0">{"".join(parts)}</svg></div>'


def describe(body: Morphology) -> str:
    """Return a body in a few words."""
    return f"{body.n_modules} modules, stiffness {body.stiffness_text}{feet_note(body.feet)}"


_RIGHT = ' style="text-align:right;font-weight:inherit"'


def _f_s(distance: float, scores: np.ndarray | None) -> float | None:
    if scores is None or not np.isfinite(scores).all():
        return None
    return 100 * (distance - fitness(scores))


def _mean(scores: np.ndarray) -> float | None:
    return 100 * float(scores.mean()) if np.isfinite(scores).all() else None


def _name(what: str) -> str:
    return "f<sub>s</sub>" if what == "f_s" else html.escape(what)


def _number(value: float | None) -> str:
    # without the sign of a negative zero
    return "–" if value is None else f"{round(value, 1) + 0.0:.1f}"


def _signed(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:+.1f}" if abs(value) >= 0.05 else "0.0"


def _tint(figure: ComparedFigure) -> str:
    if figure.change is None or abs(figure.change) < 0.05:
        return "inherit"
    return BETTER if figure.is_better else WORSE
