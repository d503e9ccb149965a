"""What limits the tension of an internal cable, as the simulated servo does.

The simulated pull grows by 61.3 N/m up to 0.654 N and stays there. The built cable has an elastic of that
stiffness; behind it, inside the tube of the rod that it pulls, lies a long thin elastic thread, stretched
to 0.654 N from the start. A bead on the cap keeps it stretched. Nothing moves below that tension; above it
the bead lifts off and the thread gives way, and it draws the bead back when the tension falls.

The thread is so long that its pull hardly grows: 0.654 N at three times its length, so 14 N/m. Friction
where the cable bends into the cap, by 100 to 130 degrees, lets it lift off at more and return at less; it
is adjusted with a weight that hangs in the cable's direction, so that friction counts.
"""

from __future__ import annotations

from typing import Final

from engine.body import module as t
from engine.fabrication.materials import CAP_TIP, Materials

LEAST_BORE: Final = 0.0015
"""Bore of a tube, in m, that the thread and its knot go through."""
STRETCHED: Final = 3.0
"""The thread's length in its rod over its own."""
THREAD: Final = t.ROD_LENGTH - 2 * CAP_TIP - 0.008
"""Length of the stretched thread, in m: the rod's, less a knot at each end."""
GROWTH: Final = t.SERVO_MAX_TENSION / (THREAD * (1.0 - 1.0 / STRETCHED))
"""By how much the pull grows once the bead has lifted off, in N/m."""
SPREAD: Final = 0.12
"""Standard deviation of the limit, in parts of it: 7 % of growth over the 3 to 9 mm by which stiff modules
exceed it, and 10 % that friction at the cap leaves uncertain; assumed."""
HOLE: Final = 1.0
"""Diameter of the hole in a cap that the line goes through, in mm."""


def has_limiter(materials: Materials) -> bool:
    """Return whether the rods are tubes that a limiter fits into."""
    return (materials.rod.bore or 0.0) >= LEAST_BORE


def line_limit(materials: Materials) -> float:
    """Return the largest tension of an internal cable in N; 0 for none."""
    return t.SERVO_MAX_TENSION if has_limiter(materials) else 0.0
