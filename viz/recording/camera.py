"""A camera that looks at a point of the ground, for pictures drawn without a graphics card."""

from __future__ import annotations

import dataclasses

import numpy as np

NEAR = 0.03
"""Metres before the eye within which nothing is drawn."""


@dataclasses.dataclass(frozen=True, slots=True)
class Camera:
    """A perspective camera.

    Attributes:
        focus: (3,) what it looks at, in m.
        yaw: where the eye is, in rad about the vertical, counter-clockwise from the x axis.
        pitch: how far up the eye is, in rad.
        distance: from the focus to the eye, in m.
        size: width and height of the picture, in pixels.
    """

    focus: np.ndarray
    yaw: float
    pitch: float
    distance: float
    size: tuple[int, int]

    @property
    def axes(self) -> np.ndarray:
        """(3, 3) unit vectors to the right, up and ahead."""
        c, s = np.cos(self.pitch), np.sin(self.pitch)
        out = np.array([np.cos(self.yaw) * c, np.sin(self.yaw) * c, s])
        right = np.array([-np.sin(self.yaw), np.cos(self.yaw), 0.0])
        return np.stack([right, np.cross(out, right), -out])

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return where (n, 3) points are seen.

        Returns:
            (n, 2) pixels, (n,) distances ahead of the eye in m, (n,) pixels per metre there.
        """
        axes = self.axes
        eye = self.focus - self.distance * axes[2]
        seen = (points - eye) @ axes.T
        width, height = self.size
        scale = 1.25 * min(height, 1.1 * width) / np.maximum(seen[:, 2], 1e-3)
        pixels = np.stack([width / 2 + scale * seen[:, 0], height / 2 - scale * seen[:, 1]], axis=-1)
        return pixels, seen[:, 2], scale

    def showing(self, points: np.ndarray, margin: float = 0.12) -> Camera:
        """Return this camera moved until (n, 3) points lie within the picture, a margin around them."""
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        camera = dataclasses.replace(self, focus=np.array([middle[0], middle[1], 0.02]), distance=0.3)
        half = np.array(self.size) / 2
        while camera.distance < 20.0:
            pixels, ahead, _ = camera.project(points)
            if (ahead > 0.1).all() and (np.abs(pixels / half - 1.0) < 1.0 - margin).all():
                break
            camera = dataclasses.replace(camera, distance=1.04 * camera.distance)
        return camera
