"""Pictures of some parts of a GLB scene: triangles painted from back to front, with no graphics card."""

from __future__ import annotations

import fnmatch
import io
from collections.abc import Iterable
from typing import Any, Final

import numpy as np
import trimesh
from PIL import Image, ImageDraw

from viz.build_sheet.scene import OrthographicCamera

LONGEST: Final = 0.012
"""Longest edge of a painted triangle, in m: larger ones are cut, so that middles tell what is behind."""
LINES: Final = "*_servo_*"
"""Names of the servo's lines, which are thinner than a picture can show."""
THICKER: Final = 4.0
"""Times that they are drawn thicker."""
WAYS: Final = "*_way_*"
"""Names of the lines' ways from the drum to the ball."""
SWOLLEN: Final = 0.0004
"""By which their surface is moved outwards in m, so that one sees them."""
LIGHT: Final = np.array([0.35, 0.5, 0.79])
"""Direction to the light in the picture: right, up, towards whoever looks."""
GHOST: Final = np.array([206.0, 212.0, 219.0])
"""Colour of what is there already."""
ENLARGED: Final = 2
"""Times that a picture is drawn larger than it is shown."""


class ScenePictures:
    """Draws a scene with one part or another in it.

    Args:
        glb: the scene, y up, in m; its nodes have names.
    """

    def __init__(self, glb: bytes) -> None:
        scene: Any = trimesh.load(io.BytesIO(glb), file_type="glb")
        self._parts: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        for name in sorted(scene.graph.nodes_geometry):
            place, geometry = scene.graph[name]
            if fnmatch.fnmatchcase(name, LINES):
                place = place @ np.diag([THICKER, THICKER, 1.0, 1.0])
            mesh = scene.geometry[geometry]
            vertices = mesh.vertices
            if fnmatch.fnmatchcase(name, WAYS):
                vertices = vertices + SWOLLEN * mesh.vertex_normals
            corners = trimesh.transform_points(vertices, place)[mesh.faces]
            # glTF has y up, pictures have z up
            corners = np.stack([corners[..., 0], -corners[..., 2], corners[..., 1]], axis=-1)
            color = np.array(mesh.visual.material.baseColorFactor[:3], dtype=float)
            self._parts[name] = (_divided(corners), color)

    @property
    def names(self) -> list[str]:
        """Of all parts."""
        return list(self._parts)

    def stand(self, turn: np.ndarray, shift: np.ndarray) -> None:
        """Turn everything by a (3, 3) rotation, then move it by (3,) in m."""
        self._parts = {
            name: (corners @ turn.T + shift, color) for name, (corners, color) in self._parts.items()
        }

    def add(self, name: str, vertices: np.ndarray, faces: np.ndarray, color: tuple[int, int, int]) -> None:
        """Add a part: (n, 3) corners in m, z up, (k, 3) triangles of them, and its colour."""
        self._parts[name] = (_divided(vertices[faces]), np.array(color, dtype=float))

    def matching(self, patterns: Iterable[str]) -> list[str]:
        """Return the parts whose names match one of some patterns, such as ``*_cap_3``."""
        return [name for name in self._parts if any(fnmatch.fnmatchcase(name, p) for p in patterns)]

    def middle(self, pattern: str) -> np.ndarray:
        """Return the (3,) middle of the box around the parts of a pattern, in m."""
        points = self.points(self.matching([pattern]))
        return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)

    def points(self, names: Iterable[str]) -> np.ndarray:
        """Return (n, 3) points of parts, z up, in m."""
        return np.concatenate([self._parts[name][0].reshape(-1, 3) for name in names])

    def picture(
        self,
        camera: OrthographicCamera,
        new: Iterable[str],
        there: Iterable[str],
        *,
        size: tuple[int, int],
        around: np.ndarray,
    ) -> Image.Image:
        """Draw parts.

        Args:
            camera: looks at them.
            new: names of those in their colours.
            there: names of those in grey.
            size: width and height in pixels.
            around: (n, 3) points that the picture fits, in m.
        """
        image = self._drawn(camera, new, there, tuple(ENLARGED * s for s in size), around)
        return image.reduce(ENLARGED)

    def seen(
        self, camera: OrthographicCamera, new: Iterable[str], there: Iterable[str], around: np.ndarray
    ) -> int:
        """Return on how much of a small picture one sees parts that are in colour, in pixels."""
        image = np.asarray(self._drawn(camera, new, there, (180, 150), around)).astype(int)
        return int((np.ptp(image, axis=2) > 40).sum())

    def _drawn(
        self,
        camera: OrthographicCamera,
        new: Iterable[str],
        there: Iterable[str],
        size: tuple[int, ...],
        around: np.ndarray,
    ) -> Image.Image:
        triangles, colors = [], []
        for names, grey in ((there, True), (new, False)):
            for name in names:
                corners, color = self._parts[name]
                triangles.append(corners)
                colors.append(np.broadcast_to(GHOST if grey else color, (len(corners), 3)))
        image = Image.new("RGB", (size[0], size[1]), "white")
        if triangles:
            self._paint(image, camera, np.concatenate(triangles), np.concatenate(colors), around)
        return image

    def _paint(
        self,
        image: Image.Image,
        camera: OrthographicCamera,
        triangles: np.ndarray,
        colors: np.ndarray,
        around: np.ndarray,
    ) -> None:
        towards = np.cross(camera.right, camera.up)
        axes = np.stack([camera.right, camera.up, towards])
        seen = triangles @ axes.T
        normals = np.cross(seen[:, 1] - seen[:, 0], seen[:, 2] - seen[:, 0])
        length = np.linalg.norm(normals, axis=1)
        front = normals[:, 2] > 1e-12
        seen, colors = seen[front], colors[front]
        normals = normals[front] / length[front, None]
        bright = 0.55 + 0.45 * np.clip(normals @ LIGHT, 0.0, 1.0)
        shades = np.rint(colors * bright[:, None]).astype(int)
        x, y = np.moveaxis(on_picture(camera, seen @ axes, around, image.size), -1, 0)
        y = image.height - y
        draw = ImageDraw.Draw(image)
        order = np.argsort(np.round(seen[..., 2].mean(axis=1), 7), kind="stable")
        for k in order:
            color = tuple(shades[k].tolist())
            draw.polygon(list(zip(x[k].tolist(), y[k].tolist(), strict=True)), fill=color, outline=color)


def on_picture(
    camera: OrthographicCamera, points: np.ndarray, around: np.ndarray, size: tuple[float, float]
) -> np.ndarray:
    """Return (..., 2) where points (..., 3) appear on a picture of a size, from its lower left corner.

    Args:
        camera: looks at them.
        points: in m.
        around: (n, 3) points that the picture fits, in m.
        size: width and height, in any unit.
    """
    flat = camera.flat(around)
    low, high = flat.min(axis=0), flat.max(axis=0)
    room = np.array(size)
    scale = float((0.92 * room / np.maximum(high - low, 1e-6)).min())
    return np.asarray((camera.flat(points) - (low + high) / 2) * scale + room / 2)


def _divided(triangles: np.ndarray) -> np.ndarray:
    """Return (n, 3, 3) triangles with no edge longer than ``LONGEST``, longer ones cut in two."""
    while True:
        edges = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
        long = edges.max(axis=1) > LONGEST
        if not long.any():
            return triangles
        cut = triangles[long]
        # the longest edge goes first
        first = edges[long].argmax(axis=1)
        cut = np.take_along_axis(cut, ((first[:, None] + np.arange(3)) % 3)[..., None], axis=1)
        middle = (cut[:, 0] + cut[:, 1]) / 2
        halves = [
            np.stack([cut[:, 0], middle, cut[:, 2]], axis=1),
            np.stack([middle, cut[:, 1], cut[:, 2]], axis=1),
        ]
        triangles = np.concatenate([triangles[~long], *halves])
