"""One trial as one HTML file that plays without a server: data, viewer and the robot's facts.

The file loads nothing from anywhere: its content security policy forbids it. The positions of the robot's
points are rounded to 0.1 mm: 40 s of ten modules fit into a few hundred kB.
"""

from __future__ import annotations

import base64
import hashlib
import html
import importlib.resources
import json
import re
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from engine.errors import ExportError
from engine.replay.replay import Replay
from engine.tasks import get_task
from viz.recording.motion import EVERY_CABLE, Detail, TrialMotion, motion
from viz.robot import robot_card

DETAIL: Final = Detail(step=1e-4, levels=31, told=EVERY_CABLE)
EVERY: Final = 2
"""One frame in so many is kept; the viewer interpolates."""


def standalone_replay(replay: Replay, *, run: str, where: str = "", entered: int | None = None) -> bytes:
    """Return a replay as an HTML file.

    Args:
        replay: simulated to the moment at which the file ends.
        run: name of its run.
        where: the map and cell that the robot was picked from.
        entered: the generation that it was evaluated in; None if it is not known.

    Raises:
        ExportError: the simulation failed or has not begun.
    """
    if replay.failure is not None or not replay.frames or replay.target is None:
        raise ExportError(f"there is no replay to show: {replay.failure or 'nothing was simulated'}")
    frames = replay.frames[EVERY - 1 :: EVERY]
    shown = motion(
        replay.morphology,
        replay.head,
        [
            TrialMotion(
                poses=np.array([f.pose for f in frames]),
                lengths=np.array([f.lengths for f in frames]),
                target=replay.target,
                walls=replay.walls,
            )
        ],
        detail=DETAIL,
        start=replay.start_time,
        period=EVERY * replay.frame_period,
    )
    number = replay.evaluation.solution.number
    return page(
        own_file("standalone_replay.html"),
        style=own_file("replay_view.css") + own_file("standalone_replay.css"),
        script=own_file("replay_view.js") + own_file("standalone_replay.js"),
        fields={
            "title": html.escape(f"Robot {number} of {run}"),
            "view": own_file("replay_view.html"),
            "source": html.escape(f"Run {run} · {replay.config.task}"),
            "trial": html.escape(_trial(replay)),
            "card": robot_card.render(replay.config, replay.evaluation, where, entered),
            "scene": json_text(shown.scene),
            "frames": base64.b64encode(shown.columns).decode(),
        },
    )


def page(template: str, *, style: str, script: str, fields: Mapping[str, str]) -> bytes:
    """Return a page that runs one script, its own, and loads nothing from anywhere.

    Args:
        template: HTML with places such as ``@title@``.
        style: of the page.
        script: of the page.
        fields: markup by place.
    """
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    parts = {"policy": policy, "style": style, "script": script, **fields}
    # in one pass: what a part holds is no place
    return re.sub(r"@([a-z]+)@", lambda found: parts[found[1]], template).encode()


def json_text(data: Any) -> str:
    """Return data as JSON that no element of a page can be ended by."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def own_file(name: str) -> str:
    """Return a part of a page that lies in this room."""
    return (importlib.resources.files("viz.recording") / name).read_text(encoding="utf-8")


def _trial(replay: Replay) -> str:
    """Say which trial it is and how it ended."""
    task = get_task(replay.config.task)
    score = "" if replay.score is None else f" · {task.score_name} {100 * replay.score:.2f} cm"
    noise = f"fresh noise {replay.fresh}" if replay.fresh else f"noise seed {replay.repeat + 1}"
    return f"Target {replay.target_name} · {noise}{score}"
