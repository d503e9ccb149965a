"""Lights up the module that a user points at, wherever it is drawn; tells the force in what is clicked."""

from __future__ import annotations

import re
import threading
import time
from typing import Final

import numpy as np
import viser

from app.gui.page_channel import SCRIPT, add_channel, page_file, run_script
from app.gui.viser_private import put_arrays, uuid_of
from app.gui.widgets import put_html
from app.pointing.picking import RobotPart, module_at, part_at
from app.replay.player import ReplayMoment
from app.replay.scene import Scene
from app.replay.scene_camera import SceneCamera
from app.replay.shapes import unit_tube
from engine.body import module as t
from engine.body.morphology import Morphology
from viz import theme
from viz.robot.geometry import ROD_DRAWN_RADIUS, Drawing

LIT_RADIUS: Final = 1.5 * ROD_DRAWN_RADIUS
"""Of a lit rod, in m: it lies around the plain one."""
PART_THICKNESS: Final = 0.0042
"""Of the line along the rod or cable that was clicked, in m."""
LABEL_LIFT: Final = 0.03
"""Metres from the middle of what was clicked up to its label."""
LABEL_INTERVAL: Final = 0.2
"""Seconds between two figures on the label."""
_REPORT: Final = re.compile(r"(?:none|module:(\d)|at:(\d{1,3}),(\d{1,3}))\|\d{1,16}")


class Pointing:
    """What a user points at in one browser's scene, network and servos.

    Args:
        client: the browser.
        scene: that shows the robot.
        camera: of the scene.
    """

    def __init__(self, client: viser.ClientHandle, scene: Scene, camera: SceneCamera) -> None:
        gui = client.gui
        self._client, self._scene, self._camera = client, scene, camera
        self._mutex = threading.RLock()
        self._body: Morphology | None = None
        self._moment: ReplayMoment | None = None
        self._hovered: int | None = None
        self._held: int | None = None
        self._part: RobotPart | None = None
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

    def show(self, moment: ReplayMoment) -> None:
        """Draw what is pointed at, once the scene shows a moment; another robot has nothing pointed at."""
        with self._mutex:
            if moment.replay.morphology != self._body:
                self._forget()
            self._moment, self._body = moment, moment.replay.morphology
            self._draw()

    def clear(self) -> None:
        """Light nothing: no robot that could be pointed at is shown."""
        with self._mutex:
            self._forget()
            self._moment = self._body = None
            self._draw()

    def _report(self, event: viser.GuiEvent, *, click: bool) -> None:
        """Take note of where the pointer is, as ``pointing.js`` says it."""
        found = _REPORT.fullmatch(str(event.target.value))
        if found is None:
            return
        module, x, y = (None if text is None else int(text) for text in found.groups())
        drawing = self._scene.drawing
        with self._mutex:
            part = None
            if x is not None and y is not None and drawing is not None:
                ray = self._camera.ray(x / 999, y / 999)
                part = part_at(ray, drawing) if click else None
                module = module_at(ray, drawing) if part is None else part.module
            if module is not None and (self._body is None or module >= self._body.n_modules):
                module = None
            if click:
                self._held, self._part, self._told_at = module, part, 0.0
            else:
                self._hovered = module
            self._draw()

    def _forget(self) -> None:
        self._hovered = self._held = self._part = None

    def _draw(self) -> None:
        lit = self._hovered if self._hovered is not None else self._held
        style = ""
        if lit is not None:
            color = theme.css(theme.LIT)
            style = (
                f'<style class="ta-lit">[data-m="{lit}"]>.ta-back{{fill:{color};fill-opacity:.35}}</style>'
            )
        put_html(self._style, style)
        drawing = self._scene.drawing
        moment = self._moment
        with self._client.atomic():
            self._light(None if drawing is None or moment is None else lit, drawing)
            self._mark(None if moment is None else self._part, drawing)

    def _light(self, module: int | None, drawing: Drawing | None) -> None:
        """Light up the rods of a module."""
        if module is None or drawing is None:
            if self._rods is not None:
                self._rods.visible = False
            return
        own = slice(module * len(t.RODS), (module + 1) * len(t.RODS))
        if self._rods is None:
            tube = unit_tube()
            self._rods = self._client.scene.add_batched_meshes_simple(
                "/pointed/lit",
                tube.vertices,
                tube.faces,
                batched_wxyzs=drawing.rod_turns[own],
                batched_positions=drawing.rod_positions[own],
                batched_scales=np.tile([LIT_RADIUS, LIT_RADIUS, t.ROD_LENGTH], (len(t.RODS), 1)),
                batched_colors=theme.linear(np.tile(np.array(theme.LIT, np.uint8), (len(t.RODS), 1))),
                lod="off",
                cast_shadow=False,
                receive_shadow=False,
            )
        put_arrays(
            self._rods,
            batched_positions=np.ascontiguousarray(drawing.rod_positions[own]),
            batched_wxyzs=np.ascontiguousarray(drawing.rod_turns[own]),
        )
        if not self._rods.visible:
            self._rods.visible = True

    def _mark(self, part: RobotPart | None, drawing: Drawing | None) -> None:
        """Draw a line along a rod or cable, and its name and force above it."""
        if part is None or drawing is None or self._moment is None:
            if self._line is not None:
                self._line.visible = False
            if self._label is not None:
                self._label.remove()
                self._label = None
            return
        ends = np.ascontiguousarray(part.ends(drawing)[None], dtype=np.float32)
        if self._line is None:
            self._line = self._client.scene.add_line_segments(
                "/pointed/part", ends, theme.PICKED, thickness=PART_THICKNESS
            )
        put_arrays(self._line, points=ends)
        if not self._line.visible:
            self._line.visible = True
        x, y, z = (float(v) for v in ends[0].mean(axis=0))
        now = time.monotonic()
        if self._label is None or now - self._told_at >= LABEL_INTERVAL or not self._moment.playing:
            self._told_at = now
            frame = self._moment.replay.frames[self._moment.index]
            text = f"{part.name}: {part.force(frame, self._moment.replay.morphology)}"
            if self._label is None:
                self._label = self._client.scene.add_label(
                    "/pointed/label", text, position=(x, y, z + LABEL_LIFT), anchor="bottom-center"
                )
            elif self._label.text != text:
                self._label.text = text
        self._label.position = (x, y, z + LABEL_LIFT)
