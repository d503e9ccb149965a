"""An elite as data of an atlas page: what its card says, and its motion towards every target."""

from __future__ import annotations

import base64
import dataclasses
import json
import zlib
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from engine.analysis.profile import still_limit
from engine.body.feet import FEET_TEXT
from engine.body.module import stiffness_n_per_m
from engine.body.morphology import Morphology
from engine.config import RunConfig, task_of
from engine.replay.every_target import RecordedTrial
from engine.simulation.evaluation import Evaluation
from engine.simulation.rollout import Head
from engine.storage.rows import MAX_LINE, Ancestor
from viz import words
from viz.recording.motion import SERVO_CABLES, Detail, TrialMotion, motion
from viz.robot import lineage_list
from viz.robot.network_diagram import NetworkDiagram

DETAIL: Final = Detail(step=2.3e-4, levels=7, told=SERVO_CABLES)
"""The corner of a cube of half a step is 0.199 mm from its middle."""
FRAME: Final = 0.24
"""Seconds between two frames, as nearly as control updates allow. The servos' fastest rhythm takes 2 s; with
0.2 s the page of 180 elites would have more than 25 MB."""


def updates_per_frame(control_period: float) -> int:
    """Return how many control updates lie between two frames."""
    return max(round(FRAME / control_period), 1)


@dataclasses.dataclass(frozen=True, slots=True)
class PackedElite:
    """An elite as a page holds it.

    Attributes:
        text: base64 of the deflated data, for ``page.js``: the length of the JSON (four bytes, lowest first),
            the JSON, the columns of ``viz.recording.motion``, deflated themselves.
        off: the farthest that a point of it lies from where it was simulated, in m.
        differs: how far its scores are from the recorded ones, at most, in m.
    """

    text: str
    off: float
    differs: float


def pack_elite(
    config: RunConfig,
    evaluation: Evaluation,
    trials: Sequence[RecordedTrial],
    *,
    cells: Mapping[str, str],
    generation: int,
    line: Sequence[Ancestor],
    again: np.ndarray | None = None,
) -> PackedElite:
    """Return an elite as a page holds it.

    Args:
        config: of its run.
        evaluation: the elite.
        trials: of it, in the task's order, see ``replay_every_target``.
        cells: by the title of a map its cell there.
        generation: it was evaluated in.
        line: the elite and its ancestors.
        again: fitnesses in m under noise that it was not selected with; None or empty if it has none.
    """
    task, solution = task_of(config), evaluation.solution
    body, head = solution.morphology, Head.of(solution.morphology, evaluation.head_is_end)
    period = updates_per_frame(config.physics.control_period) * config.physics.control_period
    whole = [k for k, trial in enumerate(trials) if trial.failure is None]
    shown = None
    if whole:
        shown = motion(
            body,
            head,
            [
                TrialMotion(trials[k].poses, trials[k].lengths, trials[k].target, trials[k].walls)
                for k in whole
            ],
            detail=DETAIL,
            start=-period,
            period=period,
        )
    assert evaluation.fitness is not None  # one that failed holds no cell
    f_s = 100 * (task.target_distance - evaluation.fitness)
    expected, spread, what = _expected(f_s, None if again is None else 100 * (task.target_distance - again))
    diagram = NetworkDiagram(
        solution.controller, body.n_modules, task.inputs, head_is_end=evaluation.head_is_end
    )
    data = {
        "cells": dict(cells),
        "f_s": round(f_s, 2),
        "words": words.gained(expected, 100 * still_limit(task)),
        "spread": spread,
        "what": what,
        "facts": _facts(evaluation, generation),
        "targets": [
            {
                "name": name,
                "gain": _cm(task.target_distance - float(distances.mean())),
                "spread": _cm(float(np.ptp(distances)) / 2),
                "trial": whole.index(k) if k in whole else None,
                "failure": trials[k].failure,
            }
            for k, (name, distances) in enumerate(zip(task.target_names, evaluation.distances, strict=True))
        ],
        "network": diagram.render(),
        "lineage": _lineage(line, task.target_distance),
        "begins": None if line[-1].is_founder else len(line) >= MAX_LINE,
        "scene": None if shown is None else shown.scene,
    }
    text = json.dumps(data, allow_nan=False, separators=(",", ":")).encode()
    content = zlib.compress(text, 9)
    columns = b"" if shown is None else shown.columns
    return PackedElite(
        base64.b64encode(len(content).to_bytes(4, "little") + content + columns).decode(),
        0.0 if shown is None else shown.off,
        _differs(evaluation, trials),
    )


def _expected(f_s: float, again: np.ndarray | None) -> tuple[float, float | None, str]:
    """Return the f_s in cm to expect of an elite, its standard deviation if that is known, and what it is."""
    if again is None or not len(again):
        return f_s, None, "over its targets, the worst counting extra:"
    spread = round(float(again.std(ddof=1)), 2) if len(again) > 1 else None
    return float(again.mean()), spread, words.AGAIN.format(len(again))


def _facts(evaluation: Evaluation, generation: int) -> list[tuple[str, str]]:
    solution = evaluation.solution
    body = solution.morphology
    return [
        ("modules", str(body.n_modules)),
        ("stiffness", _stiffness(body)),
        ("faces", " ".join(map(str, body.faces))),
        *([("feet", FEET_TEXT[body.feet])] if body.feet != "none" else ()),
        ("head", "last module" if evaluation.head_is_end else "first module"),
        ("born in", f"generation {generation}"),
    ]


def _stiffness(body: Morphology) -> str:
    if body.stiffness_mode == "shared":
        return f"{body.stiffness_text} ({stiffness_n_per_m(body.stiffness):.0f} N/m)"
    return f"{body.stiffness_text}, first to last"


def _lineage(line: Sequence[Ancestor], distance: float) -> list[list[Any]]:
    """Return of the elite and its ancestors number, generation, f_s in cm and how each came about."""
    return [
        [
            a.number,
            a.generation,
            None if a.fitness is None else _cm(distance - a.fitness),
            lineage_list.origin(a, line[k + 1] if k + 1 < len(line) else None),
        ]
        for k, a in enumerate(line)
    ]


def _differs(evaluation: Evaluation, trials: Sequence[RecordedTrial]) -> float:
    """Return how far the scores of replays are from the recorded ones, at most, in m."""
    pairs = zip(trials, evaluation.distances[:, 0], strict=True)
    return max((abs(t.score - d) for t, d in pairs if t.score is not None), default=0.0)


def _cm(metres: float) -> float | None:
    return round(100 * metres, 2) if np.isfinite(metres) else None
