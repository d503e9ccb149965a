"""What a materials file says about each material and each bought part, in SI units.

Every class but ``Materials`` is a table of the file. ``number`` marks a field whose key carries a unit:
``modulus: float = number("mpa")`` is the key ``modulus_mpa``, held here in Pa.
"""

from __future__ import annotations

import dataclasses
import math
import statistics
from typing import Final, Literal

from engine.fabrication.materials.sources import Source
from engine.fabrication.materials.toml_table import number

CAP_SLEEVE: Final = 0.006
"""Length of a cap from the node's plane to the end of its sleeve on the rod, in m."""
CAP_TIP: Final = 0.0015
"""Solid end of a cap between the end of its rod and the node's plane, in m."""

CableForm = Literal["sheet", "printed"]
"""One net per module: cut from a sheet of rubber, or printed flat."""
RELAXATION: Final[dict[CableForm, float]] = {"sheet": 0.05, "printed": 0.15}
"""How much less cables pull after a day: 1 to 2 % a decade of time from a minute on for vulcanised rubber,
3 to 4 % for thermoplastic polyurethane; assumed."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class CableMaterial:
    """``[cable]``: what the 24 passive cables of a module are made of.

    Attributes:
        material: its name, for people.
        form: net cut from a sheet, or printed.
        modulus: secant modulus, in Pa: stress on the undeformed section over strain.
        modulus_strain: the strain that it holds at.
        density: in kg/m3.
        max_strain: the largest strain at which it springs back.
        stock_thicknesses: of the sheets that can be bought, in m, increasing; empty if printed.
        k_ref: measured stiffness of the cables of relative stiffness 1.0 in N/m; None: the simulation's.
        relaxation: how much less it pulls after a day at its strain; None: ``RELAXATION`` of its form.
        source: where modulus and strain come from, such as a data sheet's name; None if nobody says.
    """

    material: str
    form: CableForm
    modulus: float = number("mpa", within=(0.05, 1000))
    modulus_strain: float = number("percent", within=(1, 1000))
    density: float = number("kg_m3", within=(100, 5000))
    max_strain: float = number("percent", within=(1, 2000))
    stock_thicknesses: tuple[float, ...] = number("mm", within=(0.05, 5))
    k_ref: float | None = number("n_per_m", optional=True)
    relaxation: float | None = number("percent", zero=True, optional=True, within=(0, 80))
    source: str | None = None

    @property
    def relaxation_after_a_day(self) -> float:
        """How much less a cable pulls after a day than when it was made, in parts."""
        return RELAXATION[self.form] if self.relaxation is None else self.relaxation


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Printer:
    """``[printer]``.

    Attributes:
        nozzle: diameter and least width of a printed line, in m.
        layer: height of a layer, in m.
        min_layers: fewest layers of a cable.
        min_wall: least thickness of a rigid part's walls, in m.
        bed_x, bed_y, bed_z: the space that a part must fit, in m.
        clearance: between a hole and what is put into it, on the diameter, in m.
    """

    nozzle: float = number("mm", within=(0.1, 1.5))
    layer: float = number("mm", within=(0.02, 1))
    min_layers: int = number(within=(1, 50))
    min_wall: float = number("mm", within=(0.2, 3))
    bed_x: float = number("mm", within=(30, 5000))
    bed_y: float = number("mm", within=(30, 5000))
    bed_z: float = number("mm", within=(30, 5000))
    clearance: float = number("mm", zero=True, within=(0, 1))

    @property
    def least_area(self) -> float:
        """Section of the thinnest cable that it prints, in m2: one line wide, ``min_layers`` high."""
        return self.nozzle * self.layer * self.min_layers


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class RodStock:
    """``[rod]``: the stock that rods are cut from; the diameter is the simulation's.

    Attributes:
        material: its name.
        density: in kg/m3.
        stock_length: of a bought rod, in m.
        kerf: width of a saw cut, in m.
        bore: inner diameter of a tube, in m; None for a solid rod.
    """

    material: str
    density: float = number("kg_m3", within=(100, 20000))
    stock_length: float = number("mm", within=(1, 20000))
    kerf: float = number("mm", zero=True, within=(0, 20))
    bore: float | None = number("mm", zero=True, optional=True)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Plastic:
    """``[plastic]``: of the rigid printed parts (caps, mounts, drums).

    Attributes:
        material: its name.
        density: of a solid print, in kg/m3.
    """

    material: str
    density: float = number("kg_m3", within=(100, 10000))


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class ServoMotor:
    """``[servo]``: the bought servomotor, with the dimensions that its mount needs; its ears are cut off.

    Attributes:
        model: its name.
        mass: with horn screw and 25 cm of cable, in kg.
        body_length, body_width, body_height: of the case without ears and shaft, in m.
        ear_height: from the case's bottom to the ears' underside, in m.
        shaft_offset: from the middle of the case to the shaft, along its length, in m.
        shaft_diameter: over the splines, in m.
        shaft_height: from the ears' underside to the shaft's end, in m.
        torque: at the working voltage, in N m.
        voltage: in V.
        stall_current: in A.
        travel: in degrees.
        pulse_min, pulse_max: of the control signal at 0 degrees and at full travel, in microseconds.
    """

    model: str
    mass: float = number("g", within=(1, 20))
    body_length: float = number("mm", within=(10, 30))
    body_width: float = number("mm", within=(4, 16))
    body_height: float = number("mm", within=(8, 35))
    ear_height: float = number("mm", within=(2, 35))
    shaft_offset: float = number("mm", zero=True, within=(0, 15))
    shaft_diameter: float = number("mm", within=(2, 8))
    shaft_height: float = number("mm", within=(2, 25))
    torque: float = number("n_m", within=(0.001, 10))
    voltage: float = number("v", within=(1, 24))
    stall_current: float = number("a", within=(0.01, 10))
    travel: float = number("degrees", within=(120, 360))
    pulse_min: float = number("us", within=(100, 5000))
    pulse_max: float = number("us", within=(100, 5000))


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """``[line]``: the braided line of the internal cables and of the links.

    Attributes:
        material: its name.
        diameter: in m.
        linear_density: in kg/m.
        elastic: what gives an internal cable its elasticity.
    """

    material: str
    elastic: str
    diameter: float = number("mm", within=(0.05, 1))
    linear_density: float = number("kg_m", within=(1e-06, 0.01))


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class BoughtPart:
    """``[board]``, ``[battery]``: a bought part.

    Attributes:
        model: its name.
        mass: in kg.
        carried: whether the robot carries it; otherwise it stays beside the robot, on a tether.
        note: what to know about it.
    """

    model: str
    carried: bool
    note: str
    mass: float = number("g", within=(0.01, 10000))


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Fastener:
    """``[[fastener]]``: a bought small part.

    Attributes:
        model: its name.
        per_module: how many a module needs.
        mass: of one, in kg.
        use: what it holds.
    """

    model: str
    use: str
    per_module: int = number(within=(1, 1000))
    mass: float = number("g", zero=True, within=(0, 100))


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class PullTest:
    """``[pull_test]``: what was measured on the exported coupon.

    Attributes:
        length: free length before pulling, in m.
        area: cross-section before pulling, in m2.
        force: that held the specimen at the extension, in N.
        extension: in m.
        max_strain: the largest strain from which the specimen sprang back.
    """

    length: float = number("mm", within=(1, 5000))
    area: float = number("mm2", within=(0.001, 100))
    force: float = number("n", within=(0.001, 1000))
    extension: float = number("mm", within=(0.01, 5000))
    max_strain: float = number("percent", within=(1, 2000))

    @property
    def strain(self) -> float:
        """The strain that it was pulled to."""
        return self.extension / self.length

    @property
    def modulus(self) -> float:
        """Secant modulus in Pa: (force / area) / strain."""
        return (self.force / self.area) / self.strain


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class FeetTest:
    """``[feet_test]``: at which angles of a tilting board the sled on its feet kept sliding.

    Attributes:
        forward: angles in degrees with the sled's point downhill, at least two.
        backward: the same with its point uphill.
    """

    forward: tuple[float, ...] = number("degrees")
    backward: tuple[float, ...] = number("degrees")

    @property
    def friction(self) -> tuple[float, float]:
        """Mean coefficients of friction forward and backward: an angle's tangent each."""
        return statistics.fmean(_tangents(self.forward)), statistics.fmean(_tangents(self.backward))

    @property
    def spread(self) -> tuple[float, float]:
        """Standard deviations of both coefficients, in parts of them."""
        forward, backward = self.friction
        return (
            statistics.stdev(_tangents(self.forward)) / forward,
            statistics.stdev(_tangents(self.backward)) / backward,
        )


def _tangents(degrees: tuple[float, ...]) -> list[float]:
    return [math.tan(math.radians(angle)) for angle in degrees]


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Materials:
    """Everything that a robot is built from.

    Attributes:
        name: of the set, for the title block.
        file: where it was read from: a preset's name or a path.
        cable: as used: with the pull test's modulus and strain if there is one.
        pull_test: None if nothing was measured.
        feet_test: None if no friction of feet was measured.
        instead: sentences that say why this is taken and not what was asked for; empty if it was asked for.
    """

    name: str
    file: str
    cable: CableMaterial
    printer: Printer
    rod: RodStock
    plastic: Plastic
    servo: ServoMotor
    line: Line
    board: BoughtPart
    battery: BoughtPart
    fasteners: tuple[Fastener, ...]
    pull_test: PullTest | None
    feet_test: FeetTest | None = None
    instead: str = ""

    @property
    def cable_source(self) -> Source:
        """Where modulus and allowed strain come from."""
        return Source.MEASURED if self.pull_test else Source.ASSUMED
