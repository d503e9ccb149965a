"""What carries the tag by which a camera sees the head: a clip on a rod, a wire, and a plate for the tag.

The simulated head is a point between rods, the mean of the middles of three of them, so nothing can be
fixed to it. The tag hangs above it: a clip snaps on a rod of the head, a steel wire of 1 mm goes from it to
the plate, and is bent until the plate lies level with its middle above the point while the robot rests.
Shapes in mm.
"""

from __future__ import annotations

from typing import Final

from manifold3d import Manifold

from engine.body import module as t
from engine.fabrication.materials import Printer
from engine.fabrication.parts import solids

PLATE: Final = 24.0
"""Side of the plate; the tag's card may be larger."""
THICK: Final = 0.8
"""Its thickness."""
WIRE: Final = 1.0
"""Diameter of the wire between clip and plate."""
WIRE_LENGTH: Final = 40.0
"""Length of the wire, to be bent."""
BOSS: Final = (2.2, 6.0)
"""Radius and height of what the wire is glued into."""
CLIP: Final = 8.0
"""Length of the clip along its rod."""
OPENING: Final = 2.5
"""Width of the clip's mouth: the rod, 3 mm, snaps in."""


def tag_plate() -> Manifold:
    """Return the plate, its upper side down as it is printed, with the boss for the wire."""
    plate = solids.box((-PLATE / 2, -PLATE / 2, 0.0), (PLATE / 2, PLATE / 2, THICK))
    boss = solids.cylinder(BOSS[0], 0.0, THICK + BOSS[1])
    return plate + boss - solids.cylinder(WIRE / 2 + 0.05, THICK, THICK + BOSS[1] + 1.0, segments=16)


def tag_clip(printer: Printer) -> Manifold:
    """Return the clip, standing on its end: the rod lies along z, its mouth opens to -x."""
    inner = 1e3 * (t.ROD_RADIUS + printer.clearance / 2)
    outer = inner + 1.6
    ring = solids.cylinder(outer, 0.0, CLIP) - solids.cylinder(inner, -1.0, CLIP + 1.0)
    ring = ring - solids.box((-outer - 1.0, -OPENING / 2, -1.0), (0.0, OPENING / 2, CLIP + 1.0))
    half = BOSS[0]
    boss = solids.box((inner + 0.6, -half, CLIP / 2 - half), (outer + BOSS[1], half, CLIP / 2 + half))
    hole = solids.bar((outer + 0.5, 0.0, CLIP / 2), (outer + 10.0, 0.0, CLIP / 2), WIRE / 2 + 0.05)
    return ring + boss - hole
