"""How a robot that is built differs from the published one: figures that any simulation can have.

``Built`` says what one robot is like, ``Spread`` how robots of one design differ from each other, and
``drawn`` picks one of these. Both are part of ``physics.Physics``; by default everything is as published.
``engine.fabrication.as_built`` works the figures out from what a robot is made of.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Final, Literal

import numpy as np

from engine.body import module as t
from engine.body import servo
from engine.errors import InvalidData

NO_LIMIT: Final = 1000.0
"""Tension in N that no line reaches."""
MOST_DELAYED: Final = 5.0
"""Largest delay of the senses, in s."""
_DRAWS: Final = 3
"""Even numbers that a deviation is the sum of: that sum is nearly Gaussian and never beyond 3."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Built:
    """What a robot is like where it may differ from the published one; lengths in m, angles in degrees.

    Raises:
        InvalidData: a figure that no robot can have.
    """

    plain_rod_mass: float = t.ROD_MASS
    """Of a rod without a servo, with its share of everything that hangs on it, in kg."""
    servo_rod_mass: float = t.SERVO_ROD_MASS
    """Of the rod with the servo, in kg."""
    centre_of_mass: tuple[float, ...] = t.SERVO_ROD_CENTRE_OF_MASS
    """From the servo rod's middle: to the module's middle, along the rod, across."""
    stiffness: tuple[float, ...] = ()
    """Factors on the stiffness of passive cables of the levels 1 to 10; none for 1."""
    module_stiffness: tuple[float, ...] = ()
    """Further factors for the first module, the second and so on; 1 for those that are not named."""
    rest_length: float = t.CABLE_REST_LENGTH
    """Of a passive cable."""
    line_stiffness: float = t.SERVO_GAIN
    """Of an internal cable, in N/m."""
    line_limit: float = t.SERVO_MAX_TENSION
    """Largest tension of an internal cable in N; 0 for none."""
    line_errors: tuple[float, ...] = ()
    """How much longer than commanded each internal cable is, five for each module; 0 for those not named."""
    winding: Literal["published", "even", "cams"] = "published"
    """How a servo winds its cables up: as the published table says, evenly, as a round drum does, or as the
    drum with cams that comes near to the table."""
    travel: float = 180.0
    """By how much a servo turns from command 0 to command 180."""
    servo_rate: float = 0.0
    """How fast a servo turns at most, per second; 0 for as fast as commanded."""
    dead_band: float = 0.0
    """How far a servo may be from its command without moving."""
    sensing_delay: float = 0.0
    """Seconds from where the head is to what the controller is told."""
    position_noise: float = 0.0
    """Standard deviation of every sensed distance."""
    heading_noise: float = 0.0
    """Standard deviation of every sensed bearing, in degrees."""
    feet_forward: float = 0.0
    """Friction coefficient of directional feet while they slide forward; 0 for the physics' own."""
    feet_backward: float = 0.0
    """The same while they do not; 0 for the physics' own."""
    tether_mass: float = 0.0
    """What a tether adds to the servo rod of every module, in kg; negative where it lifts the rod."""

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            numbers = value if isinstance(value, tuple) else () if isinstance(value, str) else (value,)
            if not all(map(math.isfinite, numbers)):
                raise InvalidData(f"built: {field.name} must be finite, not {value}")
        for name in ("plain_rod_mass", "servo_rod_mass", "rest_length", "line_stiffness", "travel"):
            if getattr(self, name) <= 0.0:
                raise InvalidData(f"built: {name} must be positive, not {getattr(self, name)}")
        if self.loaded_servo_rod <= 0.0:
            raise InvalidData(f"built: tether_mass must not lift the robot, as {self.tether_mass} kg does")
        feet = ("feet_forward", "feet_backward")
        for name in ("line_limit", "servo_rate", "dead_band", "position_noise", "heading_noise", *feet):
            if getattr(self, name) < 0.0:
                raise InvalidData(f"built: {name} must not be negative, not {getattr(self, name)}")
        if not 0.0 <= self.sensing_delay <= MOST_DELAYED:
            raise InvalidData(
                f"built: sensing_delay must be from 0 to {MOST_DELAYED:g} s, not {self.sensing_delay}"
            )
        for name, lengths in (
            ("centre_of_mass", (3,)),
            ("stiffness", (0, t.N_STIFFNESS_LEVELS)),
            ("module_stiffness", range(t.MAX_MODULES + 1)),
            ("line_errors", range(0, len(t.SERVO_NODES) * t.MAX_MODULES + 1, len(t.SERVO_NODES))),
        ):
            if len(getattr(self, name)) not in lengths:
                raise InvalidData(f"built: {name} must not have {len(getattr(self, name))} numbers")
        if min((*self.stiffness, *self.module_stiffness), default=1.0) <= 0.0:
            raise InvalidData("built: factors on the stiffness must be positive")
        if max(map(abs, self.centre_of_mass)) > t.ROD_LENGTH:
            raise InvalidData("built: centre_of_mass lies outside the module")

    @property
    def loaded_servo_rod(self) -> float:
        """Mass of a servo rod with what the tether adds, in kg."""
        return self.servo_rod_mass + self.tether_mass

    def stiffness_factor(self, level: int, module: int) -> float:
        """Return the factor on the stiffness of a module's passive cables.

        Args:
            level: the module's stiffness gene, 1 to 10.
            module: its index.
        """
        factor = self.stiffness[level - 1] if self.stiffness else 1.0
        return factor * self.module_factor(module)

    def module_factor(self, module: int) -> float:
        """Return the factor on the stiffness of a module's passive cables that its level does not decide."""
        return self.module_stiffness[module] if module < len(self.module_stiffness) else 1.0

    @property
    def largest_stiffness_factor(self) -> float:
        """The largest of all factors on the stiffness, at least 1."""
        return max((1.0, *self.stiffness)) * max((1.0, *self.module_stiffness))

    @property
    def tension_limit(self) -> float:
        """Largest tension of an internal cable, in N."""
        return self.line_limit or NO_LIMIT

    def errors_of(self, n_modules: int) -> np.ndarray:
        """Return the (modules, 5) errors of the internal cables' lengths, in m."""
        wanted = n_modules * len(t.SERVO_NODES)
        given = np.array(self.line_errors[:wanted])
        return np.concatenate([given, np.zeros(wanted - len(given))]).reshape(n_modules, -1)

    def target_lengths(self) -> np.ndarray:
        """Return the (181, 5) lengths of the internal cables in m at commands 0, 1, ... 180 degrees."""
        table = servo.DRUM_LENGTHS if self.winding == "cams" else servo.TARGET_LENGTHS
        if self.winding != "even" and self.travel == 180.0:
            return table
        turned = np.arange(len(table)) * (self.travel / 180.0)
        if self.winding == "even":
            return table[0] - turned[:, None] * ((table[0] - table[-1]) / 180.0)
        # beyond its end the table goes on as its last degree does
        below = np.minimum(turned.astype(int), len(table) - 2)
        part = (turned - below)[:, None]
        return table[below] + part * (table[below + 1] - table[below])


PUBLISHED: Final = Built()
"""The published robot."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Standard deviations between robots of one design; of factors unless a unit is named.

    Raises:
        InvalidData: one is negative or not finite.
    """

    mass: float = 0.0
    """Of the plain rods together, and of the servo rod."""
    centre_of_mass: float = 0.0
    """Along each axis, in m."""
    stiffness: float = 0.0
    """Of all passive cables together: the material."""
    module_stiffness: float = 0.0
    """Of the passive cables of each module."""
    rest_length: float = 0.0
    """In m."""
    line_stiffness: float = 0.0
    """Of all internal cables together: the elastic."""
    line_limit: float = 0.0
    """Of the largest tension of all internal cables together: what gives way."""
    line_errors: float = 0.0
    """Of each internal cable, in m."""
    travel: float = 0.0
    """In degrees."""
    servo_rate: float = 0.0
    """Of all servos together."""
    sensing_delay: float = 0.0
    """In s."""
    sensing_noise: float = 0.0
    """Of what stands for both noises of the senses."""
    friction: float = 0.0
    """Of the coefficient of friction."""
    feet_forward: float = 0.0
    """Of the coefficient of directional feet while they slide forward."""
    feet_backward: float = 0.0
    """The same while they do not."""
    tether_mass: float = 0.0
    """Of what a tether adds to every servo rod, in kg."""

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            if not 0.0 <= getattr(self, field.name) < math.inf:
                raise InvalidData(f"spread: {field.name} must not be negative or infinite")

    def __bool__(self) -> bool:
        """Whether robots differ at all."""
        return self != NO_SPREAD


NO_SPREAD: Final = Spread()
"""Robots of a design are alike."""


class Deviates:
    """Deviations of one robot, of mean 0 and standard deviation 1, never beyond 3.

    Sums of even numbers need no transcendental function: they are the same bits on every computer.

    Args:
        seed: whole numbers that name the robot.
    """

    def __init__(self, seed: tuple[int, ...]) -> None:
        self._stream = np.random.default_rng(list(seed))

    def next(self, n: int) -> np.ndarray:
        """Return (n,) of them."""
        return np.asarray((2.0 * self._stream.random((n, _DRAWS)) - 1.0).sum(axis=1))

    def factor(self, deviation: float) -> float:
        """Return a factor of mean 1, never below a tenth."""
        return float(max(0.1, 1.0 + deviation * self.next(1)[0]))


def drawn(built: Built, spread: Spread, seed: tuple[int, ...]) -> tuple[Built, float, tuple[float, float]]:
    """Return one of the robots of a design, and factors on its friction and on that of its feet.

    Every figure has a place of its own among the draws, so that one of them may be left out of the spread
    without a change of the others.

    Args:
        built: the design.
        spread: how its robots differ.
        seed: whole numbers that name the robot.
    """
    by = Deviates(seed)
    plain, heavy = by.factor(spread.mass), by.factor(spread.mass)
    middle = np.array(built.centre_of_mass) + spread.centre_of_mass * by.next(3)
    stiffness = by.factor(spread.stiffness)
    modules = [stiffness * by.factor(spread.module_stiffness) for _ in range(t.MAX_MODULES)]
    rest = built.rest_length + spread.rest_length * by.next(1)[0]
    elastic = by.factor(spread.line_stiffness)
    lines = by.next(t.MAX_MODULES * len(t.SERVO_NODES))
    errors = built.errors_of(t.MAX_MODULES).ravel() + spread.line_errors * lines
    travel = built.travel + spread.travel * by.next(1)[0]
    rate = built.servo_rate * by.factor(spread.servo_rate)
    delay = built.sensing_delay + spread.sensing_delay * by.next(1)[0]
    senses = by.factor(spread.sensing_noise)
    friction = by.factor(spread.friction)
    feet = by.factor(spread.feet_forward), by.factor(spread.feet_backward)
    limit = built.line_limit * by.factor(spread.line_limit)
    servo_rod = built.servo_rod_mass * heavy
    # a tether lifts no robot off the ground
    tether = max(built.tether_mass + spread.tether_mass * by.next(1)[0], -0.9 * servo_rod)
    changed = dataclasses.replace(
        built,
        plain_rod_mass=built.plain_rod_mass * plain,
        servo_rod_mass=servo_rod,
        tether_mass=float(tether),
        centre_of_mass=tuple(map(float, middle)),
        module_stiffness=_unless_all(1.0, [f * built.module_factor(m) for m, f in enumerate(modules)]),
        rest_length=float(rest),
        line_stiffness=built.line_stiffness * elastic,
        line_limit=limit,
        line_errors=_unless_all(0.0, errors),
        travel=float(travel),
        servo_rate=rate,
        sensing_delay=float(min(max(delay, 0.0), MOST_DELAYED)),
        position_noise=built.position_noise * senses,
        heading_noise=built.heading_noise * senses,
    )
    return changed, friction, feet


def _unless_all(usual: float, numbers: Sequence[float] | np.ndarray) -> tuple[float, ...]:
    """Return numbers as a tuple, or none if all are as usual."""
    return tuple(map(float, numbers)) if any(n != usual for n in numbers) else ()
