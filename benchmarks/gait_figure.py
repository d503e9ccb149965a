"""Picture gaits with and without feet: ``python -m benchmarks.gait_figure OUT.png RUN:ROBOT:TARGET ...``.

Every robot is simulated twice, as it was evaluated and with its feet taken away (or given, if it has none),
towards the same target under the same noise. Lines are its modules' centres along its way, over time; they
are thick while a module's rod ends hold the ground.
"""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import Final

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from benchmarks.contraction_figure import draw
from engine.body import module as t
from engine.body.feet import Feet
from engine.config import task_of
from engine.replay.contact_record import rod_ends
from engine.replay.every_target import RecordedTrial, replay_every_target
from engine.simulation.evaluation import Evaluation
from engine.storage.reader import RunReader

UPDATES: Final = 4
"""Control updates between two samples."""
WINDOW: Final = (10.0, 22.0)
"""Seconds of the trial that are shown."""
HOLDS: Final = 0.004
"""Speed in m/s below which a rod end that touches counts as held."""
HOLDING, MOVING = "#1f6fb2", "#e8923a"


@dataclasses.dataclass(frozen=True, slots=True)
class Gait:
    """What a robot does in a trial.

    Attributes:
        title: of its panel.
        places: (samples, modules) of the modules' centres along the robot's way, in cm.
        holds: (samples, modules) whether the rod ends that touch the ground lie still.
    """

    title: str
    places: np.ndarray
    holds: np.ndarray


def gaits(text: str) -> tuple[float, list[Gait]]:
    """Return the seconds between two samples, and a robot's gait as evaluated and with feet changed."""
    path, number, target = text.rsplit(":", 2)
    with RunReader(Path(path)) as reader:
        config, evaluation = reader.config, reader.evaluation(int(number))
    body = evaluation.solution.morphology
    other: Feet = "none" if body.feet != "none" else "end"
    task = task_of(config)
    found = []
    for feet in (body.feet, other):
        [(e, trials)] = replay_every_target(config, [_with(evaluation, feet)], updates_per_frame=UPDATES)
        trial = trials[int(target) - 1]
        gain = 100 * (task.target_distance - (trial.score or np.nan))
        what = "without feet" if feet == "none" else f"feet slide toward the {feet}"
        title = f"Robot {number}, {body.n_modules} modules, {what}: {gain:.1f} cm closer"
        found.append(_gait(title, trial, UPDATES * config.physics.control_period))
        assert e.solution.number == int(number)
    return UPDATES * config.physics.control_period, found


def _with(evaluation: Evaluation, feet: Feet) -> Evaluation:
    solution = evaluation.solution
    body = dataclasses.replace(solution.morphology, feet=feet)
    return dataclasses.replace(evaluation, solution=dataclasses.replace(solution, morphology=body))


def _gait(title: str, trial: RecordedTrial, period: float) -> Gait:
    poses = trial.poses.astype(float)
    centres = poses[..., :2].mean(axis=2)
    middle = centres.mean(axis=1)
    way = middle[-1] - middle[0]
    way /= np.linalg.norm(way)
    ends = rod_ends(poses)
    speed = np.linalg.norm(np.gradient(ends[..., :2], period, axis=0), axis=-1)
    touching = ends[..., 2] <= t.ROD_RADIUS
    held = (touching & (speed < HOLDS)).sum(axis=2) >= np.maximum(1, 0.5 * touching.sum(axis=2))
    return Gait(title, 100 * (centres - middle[0]) @ way, held)


def figure(robots: list[tuple[float, list[Gait]]]) -> go.Figure:
    """Return the panels: a row per robot, on the left as evaluated, on the right with feet changed."""
    titles = [gait.title for _, pair in robots for gait in pair]
    result = make_subplots(
        rows=len(robots),
        cols=2,
        subplot_titles=titles,
        shared_yaxes=True,
        horizontal_spacing=0.03,
        vertical_spacing=0.14,
    )
    for row, (period, pair) in enumerate(robots, start=1):
        chosen = slice(*(round(moment / period) for moment in WINDOW))
        for column, gait in enumerate(pair, start=1):
            times = period * np.arange(len(gait.places))[chosen]
            for k in range(gait.places.shape[1]):
                places, holds = gait.places[chosen, k], gait.holds[chosen, k]
                for colour, width, shown in (
                    (MOVING, 1.5, places),
                    (HOLDING, 5, np.where(holds, places, np.nan)),
                ):
                    result.add_scatter(
                        x=times,
                        y=shown,
                        mode="lines",
                        line={"color": colour, "width": width},
                        name="rod ends of a module hold the ground"
                        if colour == HOLDING
                        else "they slide, or are in the air",
                        showlegend=row == column == 1 and k == 0,
                        row=row,
                        col=column,
                    )
        result.update_yaxes(title_text="along its way, cm", row=row, col=1)
    result.update_xaxes(title_text="time, s", row=len(robots))
    result.update_layout(
        template="simple_white",
        font={"size": 13},
        margin={"t": 70, "b": 50, "l": 60, "r": 20},
        legend={
            "orientation": "h",
            "y": 1.0,
            "yref": "container",
            "yanchor": "top",
            "x": 1,
            "xanchor": "right",
        },
    )
    result.update_annotations(font_size=14)
    return result


if __name__ == "__main__":
    draw(figure([gaits(text) for text in sys.argv[2:]]), Path(sys.argv[1]), (1100, 340 * len(sys.argv[2:])))
