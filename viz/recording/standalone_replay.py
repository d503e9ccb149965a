"""One trial as one HTML file that plays without a server: data, viewer and the robot's facts.

The file loads nothing from anywhere: its content security policy forbids it. The positions of the robot's
points are rounded to 0.1 mm and written coordinate by coordinate as differences in time: 40 s of ten modules
fit into a few hundred kB.
"""

from __future__ import annotations

import base64
import hashlib
import html
import importlib.resources
import json
import zlib
from typing import Final

import numpy as np

from engine.body import module as t
from engine.errors import ExportError
from engine.replay.replay import Replay
from engine.tasks import get_task
from viz import theme
from viz.robot import robot_card
from viz.robot.geometry import ACTUATOR_DRAWN_RADIUS, NODE_DRAWN_RADIUS, ROD_DRAWN_RADIUS, RobotGeometry
from viz.robot.skeleton import N_POINTS

STEP: Final = 1e-4
"""Metres between two values that a coordinate can take; more where the robot goes far."""
TENSION_LEVELS: Final = 31
"""Steps of a cable's colour."""
EVERY: Final = 2
"""One frame in so many is kept; the viewer interpolates."""
_LIMIT: Final = 32_000


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
    geometry = RobotGeometry(replay.morphology, replay.head.module)
    points, tension, heads = _sampled(replay, geometry)
    origin = (points.reshape(-1, 3).min(axis=0) + points.reshape(-1, 3).max(axis=0)) / 2
    step = max(STEP, float(np.abs(points - origin).max()) / _LIMIT)
    packed = pack(np.round((points - origin) / step).astype(np.int16).reshape(len(points), -1))
    packed += pack(np.round(tension * TENSION_LEVELS).astype(np.int16))
    facts = _facts(replay, geometry)
    number = replay.evaluation.solution.number
    title = f"Robot {number} of {run}"
    scene = {
        **facts,
        "frames": len(points),
        "step": step,
        "origin": origin.tolist(),
        "heads": np.round(heads, 4).tolist(),
        "levels": TENSION_LEVELS,
    }
    script, style = _data("standalone_replay.js"), _data("standalone_replay.css")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    card = robot_card.render(replay.config, replay.evaluation, where, entered)
    page = _data("standalone_replay.html")
    for name, text in {
        "policy": f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'",
        "title": html.escape(title),
        "source": html.escape(f"Run {run} · {replay.config.task}"),
        "trial": html.escape(_trial(replay)),
        "card": card,
        # no text of the scene can end the element that holds it
        "scene": json.dumps(scene, allow_nan=False).replace("<", "\\u003c"),
        "frames": base64.b64encode(zlib.compress(packed, 9)).decode(),
        "style": style,
        "script": script,
    }.items():
        page = page.replace(f"@{name}@", text)
    return page.encode()


def pack(values: np.ndarray) -> bytes:
    """Return (frames, n) int16 as bytes that compress well.

    The values of a column lie together as differences in time, modulo 2**16; first all low bytes, then
    all high ones.
    """
    first = np.zeros((1, values.shape[1]), dtype=np.int16)
    steps = np.diff(values.astype(np.uint16), axis=0, prepend=first.astype(np.uint16)).T.astype("<u2")
    return (steps & 0xFF).astype(np.uint8).tobytes() + (steps >> 8).astype(np.uint8).tobytes()


def _sampled(replay: Replay, geometry: RobotGeometry) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (frames, points, 3) positions, (frames, cables) tensions from 0 to 1, (frames, 2) heads."""
    frames = replay.frames[EVERY - 1 :: EVERY]
    drawings = [geometry.draw(f.pose, f.lengths) for f in frames]
    return (
        np.array([d.nodes for d in drawings], dtype=float),
        np.array([d.tension for d in drawings]),
        np.array([f.head for f in frames], dtype=float),
    )


def _facts(replay: Replay, geometry: RobotGeometry) -> dict[str, object]:
    """Return what the viewer draws besides the robot's motion."""
    assert replay.target is not None
    passive = [[a, b] for a, b in t.CABLES]
    # a module's thirteenth point is its actuator
    servo = [[len(t.NODES), n] for n in t.SERVO_NODES]
    return {
        "modules": replay.morphology.n_modules,
        "points": N_POINTS,
        "rods": [list(r) for r in t.RODS],
        "passive": passive,
        "servo": servo,
        "head": replay.head.module,
        "servoRod": t.SERVO_ROD,
        "period": EVERY * replay.frame_period,
        "start": replay.start_time,
        "target": replay.target.tolist(),
        "walls": [w.to_json() for w in replay.walls if not w.is_buried],
        "rodColors": geometry.rod_colors.tolist(),
        "radius": {"rod": ROD_DRAWN_RADIUS, "node": NODE_DRAWN_RADIUS, "servo": ACTUATOR_DRAWN_RADIUS},
        "colors": {
            "node": theme.NODE,
            "servo": theme.SERVO_ROD,
            "slack": theme.CABLE_SLACK,
            "taut": theme.CABLE_TAUT,
            "servoSlack": theme.SERVO_SLACK,
            "servoTaut": theme.SERVO_TAUT,
            "target": theme.TARGET,
            "trail": theme.TRAIL,
            "wall": theme.WALL,
        },
    }


def _trial(replay: Replay) -> str:
    """Say which trial it is and how it ended."""
    task = get_task(replay.config.task)
    score = "" if replay.score is None else f" · {task.score_name} {100 * replay.score:.2f} cm"
    noise = f"fresh noise {replay.fresh}" if replay.fresh else f"noise seed {replay.repeat + 1}"
    return f"Target {replay.target_name} · {noise}{score}"


def _data(name: str) -> str:
    return (importlib.resources.files("viz.recording") / name).read_text(encoding="utf-8")
