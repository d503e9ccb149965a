"""The physics that a run can set, and the time steps at which the integrator stays stable.

Friction, contact, inertia and noise are set here, in ``Physics``; ``model`` turns them into a MuJoCo model.

The integrator is explicit in the cables' forces. Two rates limit the time step: how fast the cables brake the
lightest bodies that they hold, and how fast these swing. Both rates fall as the scaled inertia grows; forces
are not scaled.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any, Final, Literal

from engine.body import module as t
from engine.errors import InvalidData
from engine.simulation.built import NO_SPREAD, Built, Spread, drawn

MOST_PARTS: Final = 100_000
"""Largest number of time steps in a control period, and of control periods in a second: run files may come
from strangers.
"""

AS_BUILT: Final = ("built", "spread")
"""Fields of ``Physics`` that are tables: what robots are like that differ from the published one."""
MOST_FRICTION: Final = 5.0
"""Largest friction coefficient of directional feet."""


Simulator = Literal["kernel", "mujoco"]


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Physics:
    """How the robot is simulated; part of a run's configuration.

    Friction is the published rod-on-ground coefficient. The contact's hardness, bounce and impedance ratio
    were chosen by robots that the published simulator replayed, among values whose results do not depend on
    the time step; ``docs/physics.md`` says where they match and where they do not.
    """

    simulator: Simulator = "kernel"
    """What simulates: the kernel, or MuJoCo with its Newton solver, the slow reference."""
    timestep: float = 0.0025
    """Step of the integrator, in s."""
    control_period: float = 0.02
    """Time between two controller updates, in s; a whole number of time steps."""
    inertia_scale: float = 10.0
    """Factor on every inertia (mass scaling), with gravity divided by it so that weights stay real."""
    rod_inertia: float = 3.0
    """Further factor on the rotational inertia of the plain rods (selective mass scaling): their turning is
    the fastest motion of a module and limits the time step.
    """
    friction: float = 0.5
    """Sliding friction coefficient of every contact, but of directional feet with the ground."""
    feet_forward: float = 0.3
    """Friction coefficient of directional feet with the ground while they slide forward; assumed."""
    feet_backward: float = 0.8
    """The same while they slide backward or across, or are still; assumed."""
    impratio: float = 100.0
    """MuJoCo's ratio of frictional to normal constraint impedance: higher slips less."""
    contact_time: float = 0.02
    """MuJoCo's time constant of every contact, in s: larger is softer."""
    contact_damping: float = 1.0
    """MuJoCo's damping ratio of every contact: 1 does not bounce."""
    servo_noise: float = t.SERVO_NOISE
    """Standard deviation of the noise on every commanded internal cable length, in m."""
    built: Built = Built()
    """What the robots are like where they differ from the published one."""
    spread: Spread = Spread()
    """How robots of that design differ from each other; every repeat of an evaluation has another."""

    def __post_init__(self) -> None:
        others = ("simulator", "servo_noise", *AS_BUILT)
        for name in (f.name for f in dataclasses.fields(self) if f.name not in others):
            if not 0.0 < getattr(self, name) < math.inf:
                raise InvalidData(f"physics: {name} must be positive, not {getattr(self, name)}")
        for forward, backward in ((self.feet_forward, self.feet_backward), self.feet_friction):
            if not 0.0 < forward <= backward <= MOST_FRICTION:
                raise InvalidData(
                    "physics: friction of feet must be above 0 and backward at least as large as forward, at"
                    f" most {MOST_FRICTION:g}; feet_forward is {forward:g}, feet_backward {backward:g}"
                )
        if not 1e-3 <= self.inertia_scale <= 1e3:
            raise InvalidData(f"physics: inertia_scale must be from 0.001 to 1000, not {self.inertia_scale}")
        if not 0.0 <= self.servo_noise < math.inf:
            raise InvalidData(f"physics: servo_noise must not be negative, not {self.servo_noise}")
        for what, ratio in (
            (
                "control_period must be a whole number of time steps",
                self.control_period / self.timestep,
            ),
            ("1 s must be a whole number of control periods", 1.0 / self.control_period),
        ):
            if not 1.0 <= ratio <= MOST_PARTS or abs(ratio - round(ratio)) > 1e-6:
                raise InvalidData(
                    f"physics: {what}, {MOST_PARTS} at most; timestep is {self.timestep:.9g} s,"
                    f" control_period {self.control_period:.9g} s"
                )

    def __str__(self) -> str:
        step = 1000 * self.timestep
        built = "" if self.built == Built() else ", as built"
        return f"{self.simulator}, inertia x {self.inertia_scale:g}, time step {step:.4g} ms{built}"

    @property
    def feet_friction(self) -> tuple[float, float]:
        """Friction of directional feet, forward and backward: that of robots as built, where it is known."""
        built = self.built
        return built.feet_forward or self.feet_forward, built.feet_backward or self.feet_backward

    @property
    def steps_per_control(self) -> int:
        """Time steps between two controller updates."""
        return round(self.control_period / self.timestep)


ROD_BRAKING_RATE: Final = 12_700.0
"""Largest rate in 1/s at which the cables brake a turning rod, at real inertia."""
MODULE_BRAKING_RATE: Final = 5_100.0
"""The same, when the rods' rotational inertia is so large that other motions of a module are the fastest."""
SWINGING_RATE: Final = 1265.0
"""Largest angular frequency in rad/s of a module, at relative stiffness 1.0 and real inertia.

The three are the extreme eigenvalues of settled modules, released and contracted, linearised with the
damping and the stiffness of all their cables; rounded up.
"""


def largest_timestep(physics: Physics) -> float:
    """Return the largest stable time step in s for the inertia of a physics.

    Semi-implicit Euler holds a mode that is braked at rate c and swings at w while c h + (w h)^2 / 2 < 2.
    Robots that are lighter than the published one, or stiffer, do either faster.
    """
    built = physics.built
    lighter = min(1.0, built.plain_rod_mass / t.ROD_MASS, built.loaded_servo_rod / t.SERVO_ROD_MASS)
    scale = physics.inertia_scale * lighter
    c = max(ROD_BRAKING_RATE / physics.rod_inertia, MODULE_BRAKING_RATE) / scale
    half = SWINGING_RATE**2 * built.largest_stiffness_factor / scale / 2.0
    return (math.sqrt(c * c + 8.0 * half) - c) / (2.0 * half)


def check_timestep(physics: Physics) -> None:
    """Refuse a time step at which robots would fly apart or gain energy from contacts.

    Raises:
        InvalidData: the time step is larger than the inertia or the contacts allow; the message names one
            that fits.
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
    """Return a physics with another inertia and the same margin of stability.

    A scale of 1 is the real inertia, of the rods too: ``rod_inertia`` becomes 1. The time step follows the
    largest stable one, rounded down to a whole fraction of the control period.

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


def as_built(physics: Physics, built: Built, spread: Spread = NO_SPREAD) -> Physics:
    """Return a physics with other robots; its time step is made smaller if they need that to stay stable."""
    changed = dataclasses.replace(physics, built=built, spread=spread)
    limit = largest_timestep(changed)
    if physics.timestep <= limit:
        return changed
    return dataclasses.replace(changed, timestep=_whole_fraction(physics, limit))


def one_of(physics: Physics, seed: tuple[int, ...]) -> Physics:
    """Return the physics of one of the robots that a physics with a spread stands for.

    Args:
        physics: the design and how its robots differ.
        seed: whole numbers that name the robot.
    """
    built, friction, feet = drawn(physics.built, physics.spread, seed)
    if any((physics.spread.feet_forward, physics.spread.feet_backward)):
        forward, backward = (
            min(own * factor, MOST_FRICTION) for own, factor in zip(physics.feet_friction, feet, strict=True)
        )
        # what grips less backward than forward is no foot, and feet are no brakes
        built = dataclasses.replace(built, feet_forward=forward, feet_backward=max(forward, backward))
    changed = dataclasses.replace(physics, friction=physics.friction * friction)
    return as_built(changed, built)


def physics_to_json(physics: Physics) -> dict[str, Any]:
    """Return a physics as JSON-ready values; what robots are like only if it is not as published."""
    found = dataclasses.asdict(physics)
    for name, usual in (("built", Built()), ("spread", NO_SPREAD)):
        if getattr(physics, name) == usual:
            # older files and hashes of robots stay what they are
            del found[name]
        else:
            for own in ("feet_forward", "feet_backward", "tether_mass"):
                if not found[name][own]:
                    del found[name][own]
    return found


def _contact_limit(physics: Physics) -> float:
    """Return the largest step in s that resolves a contact: its oscillation's period over 4 pi."""
    return physics.contact_time * physics.contact_damping / 2.0


def _whole_fraction(physics: Physics, largest: float) -> float:
    """Return the largest whole fraction of the control period up to a limit, in s."""
    return physics.control_period / max(1, math.ceil(physics.control_period / largest - 1e-6))
