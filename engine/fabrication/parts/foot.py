"""A foot that grips one way: a flexible hood with scales, pressed on the knob of a cap. In mm.

The hood is a ball whose scales are rings around the direction in which it slides. So it does not matter how
far the rod end rolls about that direction: a ring always touches the ground, its gentle side forward, its
steep side backward. What differs from foot to foot is the angle between that direction and the rod, the
lean; the turn about the rod is chosen when the foot is put on.
"""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np
from manifold3d import CrossSection, Manifold

from engine.fabrication.dimensions.feet import TEST_FEET
from engine.fabrication.parts import solids
from engine.fabrication.parts.shapes import FOOT_LIP, HEAD, LINK_HOLE, NECK, POST_TOP, neck_height

RADIUS: Final = 3.4
"""Over the scales' edges, in mm."""
SCALE_HEIGHT: Final = 0.6
"""Of the steep side of a scale, in mm."""
SCALE_PITCH: Final = 1.05
"""From scale to scale, in mm."""
SCALES: Final = 4
NOTCH: Final = (1.0, 2.2)
"""The notch that shows the direction, in mm: its width, and how near it comes to the rod's axis."""
SLED: Final = (44.0, 30.0, 2.0)
"""Length, width and thickness of the friction test's sled, in mm."""


def foot(lean: float, *, scales: bool = True) -> Manifold:
    """Return a foot in the frame of its cap: z along the rod, the node's plane at 0, the notch towards x.

    Args:
        lean: angle in degrees between the way it slides and the rod's outward direction.
        scales: whether it has its scales, whose sharp edges are no walls.
    """
    angle = np.radians(lean)
    ahead = np.array([np.sin(angle), 0.0, np.cos(angle)])
    neck = POST_TOP + neck_height(footed=True)
    middle = neck + HEAD[1] / 2
    ball = solids.placed(_ball(scales=scales), solids.frame_along(ahead, np.eye(3)[1]), np.zeros(3))
    body = ball.translate((0.0, 0.0, middle))
    low = neck - FOOT_LIP
    body = body - solids.box((-9.0, -9.0, low - 9.0), (9.0, 9.0, low))
    body = body - solids.cylinder(LINK_HOLE / 2, low - 1.0, neck + 0.01)
    body = body - solids.cylinder(HEAD[0], neck, neck + HEAD[1] + 0.1)
    width, floor = NOTCH
    # as high as the ball, so that one sees it from outside, along the rod
    return body - solids.box((floor, -width / 2, low - 1.0), (RADIUS + 1.0, width / 2, middle + RADIUS))


def _ball(*, scales: bool) -> Manifold:
    """Return the ball about the origin, its scales open towards -z."""
    if not scales:
        return Manifold.sphere(RADIUS - SCALE_HEIGHT, solids.SEGMENTS)
    return CrossSection([ball_outline()]).revolve(solids.SEGMENTS)


def ball_outline() -> np.ndarray:
    """Return (n, 2) half the ball's section in mm: distance from its axis, place on it, rear end first."""
    inner = RADIUS - SCALE_HEIGHT
    edges = SCALE_PITCH * (np.arange(SCALES + 1) - SCALES / 2)
    below = np.linspace(-np.pi / 2, np.arcsin(edges[0] / inner), 9)
    above = np.linspace(np.arcsin(edges[-1] / inner), np.pi / 2, 9)
    outline = [(inner * np.cos(a), inner * np.sin(a)) for a in below]
    for low, high in itertools.pairwise(edges):
        outline += [(np.sqrt(RADIUS**2 - low**2), low), (np.sqrt(inner**2 - high**2), high)]
    outline += [(inner * np.cos(a), inner * np.sin(a)) for a in above[1:]]
    return np.array(outline)


def sled() -> Manifold:
    """Return the friction test's sled as it is printed: an arrow of plate with knobs for its feet."""
    length, width, thick = SLED
    outline = [(-length / 2, -width / 2), (length / 4, -width / 2), (length / 2, 0.0)]
    outline += [(length / 4, width / 2), (-length / 2, width / 2)]
    body = CrossSection([np.array(outline)]).extrude(thick)
    top = thick + POST_TOP + neck_height(footed=True)
    for x, y in _places():
        knob = solids.cylinder(NECK, 0.0, top) + solids.cylinder(HEAD[0], top, top + HEAD[1])
        body = body + knob.translate((x, y, 0.0))
    return body


def _places() -> list[tuple[float, float]]:
    """Return where the sled's feet are: one in front, the others behind, so that it stands on all of them."""
    length, width, _ = SLED
    behind = TEST_FEET - 1
    sides = np.linspace(-1.0, 1.0, behind) * (width / 2 - 5.0)
    return [(length / 4, 0.0), *((-length / 2 + 6.0, float(y)) for y in sides)]
