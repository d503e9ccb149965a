"""Lights up the module that a user points at, wherever it is drawn; tells the force in what is clicked."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
import viser

from app.gui.page_channel import SCRIPT, add_channel, page_file, run_script
from app.gui.viser_private import put_arrays, uuid_of
from app.gui.widgets import put_html
from app.pointing.picking import RobotPart
from app.pointing.seen import SeenRobot, module_under, part_under
from app.replay.scene_camera import SceneCamera
from app.replay.shapes import unit_tube
from engine.body import module as t
from viz import theme
from viz.robot.geometry import ROD_DRAWN_RADIUS

LIT_RADIUS: Final = 1.5 * ROD_DRAWN_RADIUS
"""Of a lit rod, in m: it lies around the plain one."""
PART_THICKNESS: Final = 0.0042
"""Of the line along the rod or cable that was clicked, in m."""
LABEL_LIFT: Final = 0.03
"""Metres from the middle of what was clicked up to its label."""
LABEL_INTERVAL: Final = 0.2
"""Seconds between two figures on the label."""
ASIDE: Final = 0.4
"""Part of the way from the middle of the scene to its edge beyond which a label grows towards the middle."""
_INWARDS: Final[tuple[Literal["bottom-left", "bottom-center", "bottom-right"], ...]] = (
    "bottom-left",
    "bottom-center",
    "bottom-right",
)
_REPORT: Final = re.compile(r"(?:none|module:(\d)|at:(\d{1,3}),(\d{1,3}))\|\d{1,16}")


class Pointing:
    """What a user points at in one browser's scene, network and servos.

    Args:
        client: the browser.
        camera: of its scene.
    """

    def __init__(self, client: viser.ClientHandle, camera: SceneCamera) -> None:
        gui = client.gui
        self._client, self._camera = client, camera
        self._mutex = threading.RLock()
        self._robots: list[SeenRobot] = []
        self._playing = False
        # indices of a robot of the scene, None if it is not there, and of a module
        self._hovered: tuple[int | None, int] | None = None
        self._held: tuple[int | None, int] | None = None
        self._part: tuple[int, RobotPart] | None = None
        self._told_at = 0.0
        self._rods: viser.BatchedMeshHandle | None = None
        self._line: viser.LineSegmentsHandle | None = None
        self._label: viser.LabelHandle | None = None
        pointed, picked = add_channel(gui, "pointed"), add_channel(gui, "picked")
        gui.add_html(
            run_script(
                f"{SCRIPT}{page_file('pointing.js', __package__)}taPointing.report("
                + ",".join(f"what=>taSend('{uuid_of(c)}',()=>what)" for c in (pointed, picked))
                + ")"
            )
        )
        self._style = gui.add_html("")
        pointed.on_update(lambda event: self._report(event, click=False))
        picked.on_update(lambda event: self._report(event, click=True))

    def show(self, robots: Sequence[SeenRobot], *, playing: bool) -> None:
        """Draw what is pointed at, once the scene shows robots; other robots have nothing pointed at.

        Args:
            robots: of the scene; none that could be pointed at if it is empty.
            playing: whether another moment follows at once.
        """
        with self._mutex:
            if [r.body for r in robots] != [r.body for r in self._robots]:
                self._forget()
            self._robots, self._playing = list(robots), playing
            self._draw()

    def clear(self) -> None:
        """Light nothing: no robot that could be pointed at is shown."""
        self.show([], playing=False)

    def _report(self, event: viser.GuiEvent, *, click: bool) -> None:
        """Take note of where the pointer is, as ``pointing.js`` says it."""
        found = _REPORT.fullmatch(str(event.target.value))
        if found is None:
            return
        module, x, y = (None if text is None else int(text) for text in found.groups())
        with self._mutex:
            part: tuple[int, RobotPart] | None = None
            lit: tuple[int | None, int] | None = None
            if x is not None and y is not None and self._robots:
                ray = self._camera.ray(x / 999, y / 999)
                part = part_under(ray, self._robots) if click else None
                lit = module_under(ray, self._robots) if part is None else (part[0], part[1].module)
            elif module is not None:
                lit = self._on_card(module)
            if click:
                self._held, self._part, self._told_at = lit, part, 0.0
            else:
                self._hovered = lit
            self._draw()

    def _on_card(self, module: int) -> tuple[int | None, int] | None:
        """Return robot and module that a module of the network or the servos stands for.

        The robot of the card need not be in the scene; then it is lit up on the card alone.
        """
        robot = next((k for k, r in enumerate(self._robots) if r.on_card), None)
        if not self._robots or (robot is not None and module >= self._robots[robot].body.n_modules):
            return None
        return robot, module

    def _forget(self) -> None:
        self._hovered = self._held = self._part = None

    def _draw(self) -> None:
        robot, module = self._hovered or self._held or (None, None)
        style = ""
        if module is not None and (robot is None or self._robots[robot].on_card):
            color = theme.css(theme.LIT)
            style = (
                f'<style class="ta-lit">[data-m="{module}"]>.ta-back{{fill:{color};fill-opacity:.35}}</style>'
            )
        put_html(self._style, style)
        with self._client.atomic():
            self._light(None if robot is None else self._robots[robot], module)
            self._mark(self._part)

    def _light(self, robot: SeenRobot | None, module: int | None) -> None:
        """Light up the rods of a module."""
        if robot is None or module is None:
            if self._rods is not None:
                self._rods.visible = False
            return
        own = slice(module * len(t.RODS), (module + 1) * len(t.RODS))
        places = robot.places(robot.drawing.rod_positions[own])
        turns = robot.turns(robot.drawing.rod_turns[own])
        if self._rods is None:
            tube = unit_tube()
            self._rods = self._client.scene.add_batched_meshes_simple(
                "/pointed/lit",
                tube.vertices,
                tube.faces,
                batched_wxyzs=turns,
                batched_positions=places,
                batched_scales=np.tile([LIT_RADIUS, LIT_RADIUS, t.ROD_LENGTH], (len(t.RODS), 1)),
                batched_colors=theme.linear(np.tile(np.array(theme.LIT, np.uint8), (len(t.RODS), 1))),
                lod="off",
                cast_shadow=False,
                receive_shadow=False,
            )
        put_arrays(self._rods, batched_positions=places, batched_wxyzs=turns)
        if not self._rods.visible:
            self._rods.visible = True

    def _mark(self, picked: tuple[int, RobotPart] | None) -> None:
        """Draw a line along a rod or cable, and its name and force above it."""
        if picked is None:
            if self._line is not None:
                self._line.visible = False
            if self._label is not None:
                self._label.remove()
                self._label = None
            return
        robot, part = self._robots[picked[0]], picked[1]
        ends = robot.places(part.ends(robot.drawing))[None]
        if self._line is None:
            self._line = self._client.scene.add_line_segments(
                "/pointed/part", ends, theme.PICKED, thickness=PART_THICKNESS
            )
        put_arrays(self._line, points=ends)
        if not self._line.visible:
            self._line.visible = True
        x, y, z = (float(v) for v in ends[0].mean(axis=0))
        now = time.monotonic()
        if self._label is None or now - self._told_at >= LABEL_INTERVAL or not self._playing:
            self._told_at = now
            text = f"{part.name}: {part.force(robot.frame, robot.body)}"
            across = self._camera.across(ends[0].mean(axis=0))
            anchor = _INWARDS[(across > -ASIDE) + (across > ASIDE)]
            if self._label is None:
                self._label = self._client.scene.add_label(
                    "/pointed/label", text, position=(x, y, z + LABEL_LIFT), anchor=anchor
                )
            if self._label.text != text:
                self._label.text = text
            if self._label.anchor != anchor:
                self._label.anchor = anchor
        self._label.position = (x, y, z + LABEL_LIFT)
