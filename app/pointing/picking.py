"""Which part of a robot lies under the pointer, and what it is called."""

from __future__ import annotations

import dataclasses
from typing import Final, Literal

import numpy as np

from app.replay.scene_camera import Ray
from engine.body import module as t
from engine.body.forces import cable_tensions, rod_compressions
from engine.body.morphology import Morphology
from engine.replay.recording import ReplayFrame
from viz.robot.geometry import CABLE_DRAWN_RADIUS, ROD_DRAWN_RADIUS, Drawing

REACH: Final = 7.0
"""Pixels from the pointer within which a rod or a cable is meant."""
AROUND: Final = 0.045
"""Metres from a module's centre to its nodes, about: what a ray must pass to point at the module."""
DEPTH_COUNTS: Final = 0.05
"""How many metres beside a module's centre weigh as much as a metre behind another one."""


@dataclasses.dataclass(frozen=True, slots=True)
class RobotPart:
    """A rod or a cable of a robot.

    Attributes:
        kind: which of the two.
        module: its index.
        index: in the module: of the rods, or of the passive cables and then the internal ones.
    """

    kind: Literal["rod", "cable"]
    module: int
    index: int

    @property
    def name(self) -> str:
        """As the build sheet calls it."""
        where = f"of module {t.module_number(self.module)}"
        if self.kind == "rod":
            return f"{'servo rod' if self.index == t.SERVO_ROD else f'rod {self.index}'} {where}"
        if self.index < len(t.CABLES):
            a, b = t.CABLES[self.index]
            return f"cable {a}–{b} {where}"
        return f"internal cable to node {t.SERVO_NODES[self.index - len(t.CABLES)]} {where}"

    def force(self, frame: ReplayFrame, body: Morphology) -> str:
        """Return what the part bears at a moment, in words."""
        m = slice(self.module, self.module + 1)
        given = frame.pose[m], frame.lengths[m], np.array(body.stiffnesses[m])
        if self.kind == "cable":
            pull = float(cable_tensions(*given)[0, self.index])
            return f"{pull:.2f} N" if pull > 0.0 else "slack"
        press = float(rod_compressions(*given)[0, self.index])
        return f"{'pressed' if press >= 0.0 else 'pulled'} with {abs(press):.2f} N"

    def ends(self, drawing: Drawing) -> np.ndarray:
        """Return its (2, 3) ends in a drawing, in m."""
        if self.kind == "rod":
            return drawing.rods[self.module * len(t.RODS) + self.index]
        return drawing.cables[self.module * t.N_CABLES + self.index]


def module_at(ray: Ray, drawing: Drawing) -> int | None:
    """Return the index of the module that a ray passes through, None for none.

    Of several it is the one whose centre the ray passes nearest to; behind each other, the one in front.
    """
    way = drawing.centres - ray.origin
    depth = way @ ray.direction
    off = np.linalg.norm(way - depth[:, None] * ray.direction, axis=1)
    met = (off < AROUND) & (depth > 0.0)
    return int(np.argmin(np.where(met, off + DEPTH_COUNTS * depth, np.inf))) if met.any() else None


def part_at(ray: Ray, drawing: Drawing) -> RobotPart | None:
    """Return the rod or cable that a ray means, None for none: of those as near to it, what is in front."""
    rods, cables = drawing.rods, drawing.cables
    segments = np.concatenate([rods, cables]).astype(float)
    radius = np.repeat([ROD_DRAWN_RADIUS, CABLE_DRAWN_RADIUS], [len(rods), len(cables)])
    start, along = segments[:, 0] - ray.origin, segments[:, 1] - segments[:, 0]
    # seen along the ray, so that a segment's nearest point to it is that nearest to the origin
    flat_start, flat_along = (v - (v @ ray.direction)[:, None] * ray.direction for v in (start, along))
    part = -(flat_start * flat_along).sum(axis=1) / np.maximum((flat_along**2).sum(axis=1), 1e-12)
    part = np.clip(part, 0.0, 1.0)[:, None]
    depth = (start + part * along) @ ray.direction
    off = np.linalg.norm(flat_start + part * flat_along, axis=1)
    pixels = np.maximum(off - radius, 0.0) / np.maximum(depth, 1e-6) / ray.pixel
    meant = (depth > 0.0) & (pixels <= REACH)
    if not meant.any():
        return None
    order = np.lexsort((depth, np.floor(pixels / 2.0), ~meant))
    k = int(order[0])
    if k < len(rods):
        return RobotPart("rod", *divmod(k, len(t.RODS)))
    return RobotPart("cable", *divmod(k - len(rods), t.N_CABLES))
