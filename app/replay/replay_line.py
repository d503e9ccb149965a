"""The line below a replay: which moment it shows, and how the trial ended."""

from __future__ import annotations

import html

import numpy as np

from app.replay.player import Player, current_frame
from engine.replay.dump_replay import DumpReplay
from engine.replay.replay import Replay
from engine.replay.what_if import WhatIfReplay
from engine.tasks import get_task, remaining_distance


def describe(player: Player) -> str:
    """Return one line about the moment that a player shows."""
    replay = player.replay
    if replay is None:
        return ""
    moment = player.time
    if isinstance(replay, DumpReplay):
        return _describe_dump(replay, moment)
    if replay.failure:
        return f"The simulation failed: {replay.failure}"
    if moment < 0:
        return f"{moment:.1f} s · the robot settles, its servos off"
    parts = [f"{moment:.1f} s"]
    frame = current_frame(player)
    if replay.target is not None and frame is not None:
        gap = float(np.linalg.norm(frame.head - replay.target))
        parts.append(f"head {100 * gap:.1f} cm from the target")
    if isinstance(replay, WhatIfReplay):
        parts.insert(0, "what if, a robot of no archive")
    if not isinstance(replay, Replay):
        return " · ".join(parts)
    if replay.fresh:
        parts.insert(1, f"fresh noise {replay.fresh}")
    if replay.aim is not None:
        parts.insert(1, "a target of your own")
    if replay.score is not None:
        stored = float(replay.evaluation.distances[replay.target_index, replay.repeat])
        if replay.aim is not None:
            same = "never evaluated"
        elif replay.fresh:
            same = f"with the evaluated noise {100 * stored:.2f} cm"
        elif replay.score == stored:
            same = "exactly as evaluated"
        else:
            same = f"evaluated elsewhere as {100 * stored:.2f} cm"
        what = "" if get_task(replay.config.task).score is remaining_distance else "scores "
        parts.append(f"{what}{100 * replay.score:.2f} cm at {replay.trial_time:.0f} s, {same}")
    elif replay.frames and replay.frames[-1].time < replay.trial_time - 0.1:
        parts.append(f"simulated to {max(replay.frames[-1].time, 0):.0f} s")
    return " · ".join(parts)


def _describe_dump(replay: DumpReplay, moment: float) -> str:
    parts = [f"{abs(min(moment, 0.0)):.2f} s before the simulation was stopped"]
    if replay.reproduced is False:
        simulated = replay.dump.versions.get("mujoco", "?")
        parts.append(f"it does not fail here; what failed was simulated with MuJoCo {html.escape(simulated)}")
    return " · ".join(parts)
