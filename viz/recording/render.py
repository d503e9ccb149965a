"""Pictures of a replay drawn in software: no display, no graphics card.

Painter's algorithm: everything is a line, a disc or a face of a wall, drawn from the farthest to the nearest,
larger than it is shown and scaled down, which smooths the edges. What does not move is drawn once; of every
frame only the part with the robot and its trail is drawn anew.
"""

from __future__ import annotations

import functools
import io
import itertools
from typing import Final

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from engine.body import module as t
from engine.errors import ExportError
from engine.replay.recording import frame_at
from engine.replay.replay import Replay
from viz import theme
from viz.recording.primitives import (
    NEAR,
    PaintedPart,
    PerspectiveCamera,
    ReplayLook,
    draw_ball,
    draw_rod,
    mix,
    paint_all,
    parts_of,
    shade,
    wall_faces,
)
from viz.robot.geometry import ROD_DRAWN_RADIUS, TARGET_HEIGHT, TARGET_RADIUS, Drawing, RobotGeometry

SUPERSAMPLING: Final = 2
CABLE_DRAWN_WIDTH: Final = 0.0013
GRID: Final = 0.05
GRID_STRONG: Final = 0.25
"""Metres between the lines of the ground, and between the bright ones."""
YAW, PITCH = -2.1, 0.62
PITCH_AMONG_WALLS: Final = 0.85


class Renderer:
    """Draws the frames of one simulated trial, from a place that shows its whole path.

    Args:
        replay: simulated as far as it is to be drawn.
        look: size and colours.
        run: name of the run, for the caption.

    Raises:
        ExportError: there is nothing to draw: the simulation failed or has not begun.
    """

    def __init__(self, replay: Replay, look: ReplayLook | None = None, *, run: str = "") -> None:
        if replay.failure is not None or not replay.frames or replay.target is None:
            raise ExportError(f"there is no replay to draw: {replay.failure or 'nothing was simulated'}")
        self._replay, self._look = replay, look or ReplayLook()
        self._geometry = RobotGeometry(replay.morphology, replay.head.module)
        self._target = np.array([*replay.target, 0.0])
        self._walls = [w for w in replay.walls if not w.is_buried]
        width, height = self._look.size
        self._big = (SUPERSAMPLING * width, SUPERSAMPLING * height)
        self._camera = self._place_camera()
        self._unit = self._big[1] / 720.0
        """Pixels to draw for one of a picture 720 pixels high, at least."""
        self._font_size = max(11, round(height / 42))
        self._font = ImageFont.load_default(size=self._font_size)
        self._line = (run and f"{run} · ") + self._describe()
        self._backgrounds = {begun: self._background(begun) for begun in (False, True)}
        self._rod_layers = [
            (shade(c, 0.5), shade(c, 0.86), mix(c, (255, 255, 255), 0.45))
            for c in self._geometry.rod_colors.tolist()
        ]
        self._node_shades = [(shade(c, 0.62), shade(c, 1.0)) for c in self._geometry.node_colors.tolist()]
        heads = np.array([f.head for f in replay.frames])
        self._heads = np.column_stack([heads, np.full(len(heads), 0.002)])
        self._trail_start = max(round(-replay.start_time / replay.frame_period) - 1, 0)

    def picture(self, moment: float) -> Image.Image:
        """Return the picture of a time of the trial's clock, in s.

        Between frames it interpolates; outside of what was simulated it shows the start or the end.
        """
        replay = self._replay
        moment = min(max(moment, replay.start_time), replay.frames[-1].time)
        index = max(int((moment - replay.start_time) / replay.frame_period - 1.0), 0)
        frame = frame_at(replay, moment)
        drawing = self._geometry.draw(frame.pose, frame.lengths)
        begun = moment >= 0.0
        bare, full = self._backgrounds[begun]
        points = np.concatenate([drawing.nodes, drawing.nodes * [1, 1, 0]])
        trail = self._camera.project(self._heads[self._trail_start : index + 1])[0]
        region = self._region([self._camera.project(points)[0], trail])
        corner = np.array(region[:2])
        crop = bare.crop(region)
        draw = ImageDraw.Draw(crop, "RGBA")
        if len(trail) > 1:
            self._draw_trail(draw, trail - corner)
        self._draw_shadows(draw, drawing, corner)
        self._draw_parts(draw, drawing, corner, begun=begun)
        image = full.copy()
        image.paste(crop.reduce(SUPERSAMPLING), (region[0] // SUPERSAMPLING, region[1] // SUPERSAMPLING))
        if self._look.caption:
            self._write(image, moment)
        return image

    def png(self, moment: float) -> bytes:
        """Return the picture of a moment as a PNG file."""
        file = io.BytesIO()
        self.picture(moment).save(file, "PNG", optimize=True)
        return file.getvalue()

    def _place_camera(self) -> PerspectiveCamera:
        frames = self._replay.frames
        first = self._geometry.draw(frames[0].pose, frames[0].lengths).nodes
        last = self._geometry.draw(frames[-1].pose, frames[-1].lengths).nodes
        way = np.array([[*f.head, z] for f in frames[::10] for z in (0.0, 0.1)])
        post = self._post()
        yaw, pitch = YAW, PITCH
        if self._walls:
            back = first[:, :2].mean(axis=0) - self._target[:2]
            yaw, pitch = float(np.arctan2(back[1], back[0])) + 0.4, PITCH_AMONG_WALLS
        camera = PerspectiveCamera(np.zeros(3), yaw, pitch, 1.0, self._big)
        return camera.showing(np.concatenate([first, last, way, post]))

    def _background(self, begun: bool) -> tuple[Image.Image, Image.Image]:
        """Return what does not move: enlarged without walls and target, and as shown with them."""
        bare = Image.new("RGB", self._big, self._look.ground)
        draw = ImageDraw.Draw(bare, "RGBA")
        self._draw_ground(draw)
        if begun:
            self._draw_disc(draw)
        full = bare.copy()
        if begun:
            everything = ImageDraw.Draw(full, "RGBA")
            paint_all(self._standing(everything, np.zeros(2)))
        return bare, full.reduce(SUPERSAMPLING)

    def _region(self, pixels: list[np.ndarray]) -> tuple[int, int, int, int]:
        """Return the part of the enlarged picture that holds points, a margin around them."""
        found = np.concatenate(pixels)
        margin = 24 * self._unit
        low = np.floor((found.min(axis=0) - margin) / SUPERSAMPLING).astype(int) * SUPERSAMPLING
        high = np.ceil((found.max(axis=0) + margin) / SUPERSAMPLING).astype(int) * SUPERSAMPLING
        # never empty, even for a robot out of sight
        low = np.clip(low, 0, np.array(self._big) - SUPERSAMPLING)
        high = np.clip(high, low + SUPERSAMPLING, self._big)
        return int(low[0]), int(low[1]), int(high[0]), int(high[1])

    def _draw_ground(self, draw: ImageDraw.ImageDraw) -> None:
        """Draw the lines of the ground, fading with the distance."""
        reach = float(np.clip(1.5 * self._camera.distance, 0.6, 4.0))
        pitch = GRID_STRONG if reach > 2.5 else GRID
        centre = np.round(self._camera.focus[:2] / GRID_STRONG) * GRID_STRONG
        n, steps = int(np.ceil(reach / pitch)), 16
        for k, across in itertools.product(range(-n, n + 1), (0, 1)):
            side = np.sqrt(max(0.0, reach**2 - (k * pitch) ** 2))
            along = np.linspace(-side, side, steps + 1)
            points = np.zeros((steps + 1, 3))
            points[:, across], points[:, 1 - across] = centre[across] + k * pitch, centre[1 - across] + along
            pixels, ahead, _ = self._camera.project(points)
            strong = abs((centre[across] + k * pitch) / GRID_STRONG % 1.0 - 0.5) > 0.499
            for i in range(steps):
                if min(ahead[i], ahead[i + 1]) < NEAR:
                    continue
                far = np.hypot((along[i] + along[i + 1]) / 2, k * pitch) / reach
                alpha = int(255 * (1.0 - far) * (0.42 if strong else 0.17))
                if alpha > 2:
                    width = round((2.0 if strong else 1.0) * self._unit / SUPERSAMPLING)
                    draw.line([*pixels[i], *pixels[i + 1]], (*self._look.text, alpha), max(width, 1))

    def _draw_disc(self, draw: ImageDraw.ImageDraw) -> None:
        angle = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
        ring = self._target + TARGET_RADIUS * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
        pixels = [tuple(p) for p in self._camera.project(ring)[0]]
        draw.polygon(pixels, (*theme.TARGET, 64), (*theme.TARGET, 230), max(1, round(2 * self._unit)))

    def _draw_trail(self, draw: ImageDraw.ImageDraw, pixels: np.ndarray) -> None:
        width = max(2, round(2.4 * self._unit))
        draw.line([tuple(p) for p in pixels], theme.TRAIL, width, joint="curve")

    def _draw_shadows(self, draw: ImageDraw.ImageDraw, drawing: Drawing, corner: np.ndarray) -> None:
        ends = drawing.rods.reshape(-1, 3) * [1, 1, 0]
        pixels, _, scale = self._camera.project(ends)
        color = (30, 40, 55, 34) if self._look.light else (0, 0, 0, 96)
        for (a, b), s in zip((pixels - corner).reshape(-1, 2, 2), scale[::2], strict=True):
            draw.line([*a, *b], color, max(2, round(3.4 * ROD_DRAWN_RADIUS * s)))

    def _draw_parts(
        self, draw: ImageDraw.ImageDraw, drawing: Drawing, corner: np.ndarray, *, begun: bool
    ) -> None:
        parts = [*self._rods(draw, drawing, corner), *self._cables(draw, drawing, corner)]
        parts += self._nodes(draw, drawing, corner)
        if begun:
            parts += self._standing(draw, corner)
        paint_all(parts)

    def _rods(self, draw: ImageDraw.ImageDraw, drawing: Drawing, corner: np.ndarray) -> list[PaintedPart]:
        pixels, ahead, scale = self._camera.project(drawing.rods.reshape(-1, 3))
        widths = 2.0 * ROD_DRAWN_RADIUS * scale.reshape(-1, 2).mean(axis=1)
        paint = functools.partial(draw_rod, draw)
        ends = (pixels - corner).reshape(-1, 2, 2)
        return parts_of(paint, ahead.reshape(-1, 2).mean(axis=1), ends, widths.tolist(), self._rod_layers)

    def _cables(self, draw: ImageDraw.ImageDraw, drawing: Drawing, corner: np.ndarray) -> list[PaintedPart]:
        pixels, ahead, scale = self._camera.project(drawing.cables.reshape(-1, 3))
        widths = np.maximum(CABLE_DRAWN_WIDTH * scale[::2], 1.1 * self._unit).round().astype(int)
        ends, colors = (pixels - corner).reshape(-1, 4), map(tuple, self._cable_colors(drawing))
        return parts_of(draw.line, ahead.reshape(-1, 2).mean(axis=1), ends.tolist(), colors, widths.tolist())

    def _nodes(self, draw: ImageDraw.ImageDraw, drawing: Drawing, corner: np.ndarray) -> list[PaintedPart]:
        pixels, ahead, scale = self._camera.project(drawing.nodes)
        radii = self._geometry.node_radii * scale
        paint = functools.partial(draw_ball, draw)
        # a little before the rods and cables that end there
        return parts_of(
            paint, ahead, (pixels - corner).tolist(), radii.tolist(), self._node_shades, lift=0.002
        )

    def _cable_colors(self, drawing: Drawing) -> list:
        if not self._look.light:
            return drawing.cable_colors[:, 0].tolist()
        part = drawing.tension.reshape(self._geometry.n_modules, -1, 1)
        n = len(t.CABLES)
        passive = np.array((168, 184, 204)) * (1 - part[:, :n]) + np.array((28, 92, 170)) * part[:, :n]
        servo = np.array(theme.SERVO_SLACK) * (1 - part[:, n:]) + np.array((214, 110, 20)) * part[:, n:]
        return np.concatenate([passive, servo], axis=1).reshape(-1, 3).astype(int).tolist()

    def _post(self) -> np.ndarray:
        """Return the (2, 3) foot and top of the target's post."""
        x, y, _ = self._target
        return np.array([[x, y, 0.001], [x, y, TARGET_HEIGHT]])

    def _standing(self, draw: ImageDraw.ImageDraw, corner: np.ndarray) -> list[PaintedPart]:
        """Return the target's post and the walls."""
        pixels, ahead, scale = self._camera.project(self._post())
        parts: list[PaintedPart] = []
        if ahead.min() > NEAR:
            width = max(2, round(0.016 * scale[0]))
            line = [tuple(p) for p in pixels - corner]
            parts.append((ahead.mean(), lambda: draw.line(line, (*theme.TARGET, 217), width)))
        for face in itertools.chain.from_iterable(map(wall_faces, self._walls)):
            pixels, ahead, _ = self._camera.project(face)
            if ahead.min() < NEAR:
                continue
            ring = [tuple(p) for p in pixels - corner]
            # large faces reach far: what is near counts more than their middle
            depth = (ahead.min() + ahead.mean()) / 2
            parts.append((depth, functools.partial(self._draw_face, draw, ring)))
        return parts

    def _draw_face(self, draw: ImageDraw.ImageDraw, ring: list) -> None:
        fill, edge = (
            (theme.WALL, theme.WALL_EDGE) if not self._look.light else ((105, 125, 150), (90, 107, 128))
        )
        draw.polygon(ring, (*fill, 33))
        draw.line([*ring, ring[0]], (*edge, 140), max(1, round(self._unit)))

    def _describe(self) -> str:
        replay = self._replay
        n = replay.morphology.n_modules
        return f"robot {replay.evaluation.solution.number} · {n} modules · target {replay.target_name}"

    def _write(self, image: Image.Image, moment: float) -> None:
        draw = ImageDraw.Draw(image)
        width, height = self._look.size
        edge = self._font_size
        draw.text((edge, height - edge), self._line, self._look.text, self._font, "ls")
        shown = f"{moment:.1f} s" if moment >= 0.0 else "settling"
        draw.text((width - edge, height - edge), shown, self._look.text, self._font, "rs")
