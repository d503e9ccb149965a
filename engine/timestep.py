"""Which time steps the integrator survives.

Cables and contacts push as hard whatever the rods weigh, so the fastest oscillation, and with it the
largest stable step, goes with the square root of the inertia.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Final

from engine.errors import InvalidData
from engine.robot import Physics

LARGEST_TIMESTEP: Final = 0.0016
"""Largest stable time step at the real inertia, in s.

Found by trial, over robots of 2 to 10 modules at relative stiffness 0.1 to 1.0: with ``inertia_scale`` 1
steps of 1.82 ms hold and 2 ms diverge; with 10, 5 ms hold and 6.7 ms diverge. This keeps some margin.
"""


def largest_timestep(inertia_scale: float) -> float:
    """Return the largest stable time step in s for a factor on every inertia."""
    return LARGEST_TIMESTEP * math.sqrt(inertia_scale)


def check_timestep(physics: Physics) -> None:
    """Refuse a time step at which robots would fly apart.

    Raises:
        InvalidData: the time step is larger than the inertia allows; names one that is not.
    """
    if physics.timestep > largest_timestep(physics.inertia_scale) * (1.0 + 1e-6):
        fitting = _whole_fraction(physics, largest_timestep(physics.inertia_scale))
        raise InvalidData(
            f"physics: timestep {physics.timestep:g} s is too large for inertia_scale"
            f" {physics.inertia_scale:g}, robots would fly apart; the largest that fits is {fitting:.9g}"
        )


def with_inertia(physics: Physics, inertia_scale: float) -> Physics:
    """Return a physics with another inertia, as far from instability as it was.

    The time step goes with the square root of the inertia, down to the next whole fraction of the
    control period.

    Raises:
        InvalidData: the scale is out of range.
    """
    if not inertia_scale > 0.0:
        raise InvalidData(f"physics: inertia_scale must be positive, not {inertia_scale}")
    ratio = math.sqrt(inertia_scale / physics.inertia_scale)
    wanted = min(physics.timestep * ratio, largest_timestep(inertia_scale))
    step = _whole_fraction(physics, wanted)
    return dataclasses.replace(physics, inertia_scale=inertia_scale, timestep=step)


def _whole_fraction(physics: Physics, largest: float) -> float:
    """Return the largest whole fraction of the control period up to a limit, in s."""
    return physics.control_period / max(1, math.ceil(physics.control_period / largest - 1e-6))
