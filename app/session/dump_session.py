"""One browser that looks at a failure dump."""

from __future__ import annotations

import viser

from app.gui.lanes import Lane
from app.session.lone_replay import LoneReplaySession
from engine.replay.dump import Dump
from engine.replay.dump_replay import DumpReplay
from viz.robot import robot_card

SLIDER_STEP = 0.01
"""Seconds: a simulation explodes within few control updates."""
SPEED = "⅒ ×"
"""Speed to begin with: every time step can be seen."""


class DumpSession(LoneReplaySession):
    """Shows a dump's card and plays it.

    Args:
        client: the browser.
        dump: what to show.
        simulating: lane of the browser for its replay.
    """

    def __init__(self, client: viser.ClientHandle, dump: Dump, simulating: Lane) -> None:
        card = robot_card.render_failure(dump)
        super().__init__(
            client,
            "Failed simulation",
            card,
            DumpReplay(dump),
            simulating,
            speed=SPEED,
            step=SLIDER_STEP,
        )
