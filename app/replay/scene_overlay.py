"""What lies over a browser's 3D scene: ways to look at it, a line, a drawn still until the robot is there."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Final

import viser

from app.gui.page_channel import SCRIPT, add_channel, page_file, run_script
from app.gui.viser_private import uuid_of
from app.gui.widgets import put_html
from engine.body.morphology import Morphology
from viz.robot import body_drawing

TOUCHED: Final = "touched"
"""The user has taken the camera."""
CALM: Final = "calm"
"""The user wants nothing to move by itself."""
_REPORT: Final = re.compile(r"([a-z]{1,10})\|\d{1,16}")


class SceneOverlay:
    """Draws over the scene and reports what is done there.

    Args:
        gui: of one client, at a place that is always on the page.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        self._done: Callable[[str], None] = lambda _what: None
        channel = add_channel(gui, "scene")
        gui.add_html(
            f"<style>{page_file('scene_overlay.css', __package__)}</style>"
            + run_script(
                f"{SCRIPT}{body_drawing.script()}{page_file('scene_overlay.js', __package__)}"
                f"taOver.report(what=>taSend('{uuid_of(channel)}',()=>what))"
            )
        )
        self._lines = [gui.add_html("") for _ in range(4)]
        self._n_calls = 0

        @channel.on_update
        def _(event: viser.GuiEvent) -> None:
            found = _REPORT.fullmatch(str(event.target.value))
            if found:
                self._done(found[1])

    def on_do(self, done: Callable[[str], None]) -> None:
        """Call a function with a view that is asked for, or one of the above; it must drop anything else."""
        self._done = done

    def show_still(self, morphology: Morphology, head: int) -> None:
        """Draw a robot where it is about to appear."""
        self._call(0, f"taOver.still({json.dumps(body_drawing.code(morphology))},{head})")

    def show_no_still(self) -> None:
        """Take it away at once."""
        self._call(0, "taOver.still('',0)")

    def robot_is_there(self) -> None:
        """Take it away once the browser has drawn the scene."""
        # a line of its own: a slow browser sees only the last that a line has said, and first comes the still
        self._call(1, "taOver.there()")

    def say(self, text: str) -> None:
        """Put a line under the robot; empty for none."""
        self._call(2, f"taOver.say({json.dumps(text)})")

    def show_chip(self, text: str) -> None:
        """Put a small chip at the scene's edge; empty for none."""
        self._call(3, f"taOver.chip({json.dumps(text)})")

    def _call(self, line: int, code: str) -> None:
        # equal code must run again
        self._n_calls += 1
        later = f"(function go(){{if(window.taOver){{{code}}}else setTimeout(go,30)}})()"
        put_html(self._lines[line], run_script(f"/*{self._n_calls}*/{later}"))
