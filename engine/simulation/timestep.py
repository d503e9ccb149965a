"""Which time steps the integrator survives.

The integrator is explicit in the cables' forces, so the step is limited by how fast they brake and how
fast they swing the lightest bodies that they hold. Both go with the inertia, which is scaled; the forces
are not.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Final

from engine.errors import InvalidData
from engine.simulation.model import MOST_PARTS, Physics

ROD_BRAKING_RATE: Final = 12_700.0
"""Largest rate in 1/s at which the cables brake a turning rod, all inertia real."""
MODULE_BRAKING_RATE: Final = 5_100.0
"""The same where rods turn so heavily that other motions of a module are the fastest."""
SWINGING_RATE: Final = 1265.0
"""Largest angular frequency in rad/s of a module, at relative stiffness 1.0, all inertia real.

The three are the extreme eigenvalues of settled modules, released and contracted, linearised with the
damping and the stiffness of all their cables; rounded up.
"""


def largest_timestep(physics: Physics) -> float:
    """Return the largest stable time step in s for the inertia of a physics.

    Semi-implicit Euler holds a mode that is braked at rate c and swings at w while c h + (w h)^2 / 2 < 2.
    """
    scale = physics.inertia_scale
    c = max(ROD_BRAKING_RATE / physics.rod_inertia, MODULE_BRAKING_RATE) / scale
    half = SWINGING_RATE**2 / scale / 2.0
    return (math.sqrt(c * c + 8.0 * half) - c) / (2.0 * half)


def check_timestep(physics: Physics) -> None:
    """Refuse a time step at which robots would fly apart or bounce on energy out of nothing.

    Raises:
        InvalidData: the time step is larger than the inertia or the contacts allow; names one that is not.
    """
    for limit, what in (
        (largest_timestep(physics), f"inertia_scale {physics.inertia_scale:g}, robots would fly apart"),
        (
            _contact_limit(physics),
            f"contact_time {physics.contact_time:g} and contact_damping {physics.contact_damping:g},"
            " contacts would not be resolved",
        ),
    ):
        if physics.timestep > limit * (1.0 + 1e-6):
            raise InvalidData(
                f"physics: timestep {physics.timestep:g} s is too large for {what};"
                f" the largest that fits is {_whole_fraction(physics, limit):.9g}"
            )


def with_inertia(physics: Physics, inertia_scale: float) -> Physics:
    """Return a physics with another inertia, as far from instability as it was.

    A scale of 1 is the real inertia: then the rods' is real too, ``rod_inertia`` is 1. The time step follows
    what is stable, down to the next whole fraction of the control period.

    Raises:
        InvalidData: the scale is out of range, or so small that a control period would need too many steps.
    """
    if not inertia_scale > 0.0:
        raise InvalidData(f"physics: inertia_scale must be positive, not {inertia_scale}")
    rod_inertia = 1.0 if inertia_scale == 1.0 else physics.rod_inertia
    changed = dataclasses.replace(physics, inertia_scale=inertia_scale, rod_inertia=rod_inertia)
    wanted = min(1.0, physics.timestep / largest_timestep(physics)) * largest_timestep(changed)
    timestep = _whole_fraction(physics, min(wanted, _contact_limit(physics)))
    if physics.control_period / timestep > MOST_PARTS:
        raise InvalidData(
            f"physics: inertia_scale {inertia_scale:g} would need a time step of {timestep:.3g} s, more than"
            f" {MOST_PARTS} in a control period; choose a larger scale"
        )
    return dataclasses.replace(changed, timestep=timestep)


def _contact_limit(physics: Physics) -> float:
    """Return the largest step in s that resolves a contact: its oscillation's period over 4 pi."""
    return physics.contact_time * physics.contact_damping / 2.0


def _whole_fraction(physics: Physics, largest: float) -> float:
    """Return the largest whole fraction of the control period up to a limit, in s."""
    return physics.control_period / max(1, math.ceil(physics.control_period / largest - 1e-6))
