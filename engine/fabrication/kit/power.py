"""Wire, connector, fuse and supply for so many servos.

Copper has 0.0172 ohm mm2/m. A wire is thick enough if it loses at most 0.25 V on its way there and back while
all servos are blocked: a servo of 5 V then still has what its data sheet names. Ratings of connectors are
those of their data sheets (pin headers of 2.54 mm: 3 A; JST VH: 10 A; XT30: 15 A, XT60: 30 A continuously).
"""

from __future__ import annotations

import dataclasses
import math
from typing import Final

from engine.fabrication.materials import ServoMotor

RESISTIVITY: Final = 0.0172
"""Of copper, in ohm mm2/m."""
LARGEST_DROP: Final = 0.25
"""Volts that the wires may lose."""
WIRES: Final = (
    (28, 0.081),
    (26, 0.129),
    (24, 0.205),
    (22, 0.326),
    (20, 0.518),
    (18, 0.823),
    (16, 1.31),
    (14, 2.08),
    (12, 3.31),
)
"""AWG and section in mm2."""
TETHER: Final = 1.5
"""Length of the wires to a robot, in m."""
COPPER: Final = 8960.0
"""Its density, in kg/m3."""
INSULATED: Final = 1.5
"""Mass of a thin stranded wire over that of its copper; assumed."""
SIGNAL: Final = 28
"""AWG of the wire for a servo's signal."""
_CONNECTORS: Final = (
    (3.0, "pin header of 2.54 mm"),
    (10.0, "JST VH"),
    (15.0, "XT30"),
    (30.0, "XT60"),
)
_FUSES: Final = (1.0, 2.0, 3.0, 4.0, 5.0, 7.5, 10.0, 15.0)
"""Amperes of car fuses (ATO, mini)."""
_SUPPLIES: Final = (2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0)
"""Amperes of supplies that shops have."""


@dataclasses.dataclass(frozen=True, slots=True)
class Power:
    """What feeds the servos of a robot.

    Attributes:
        servos: how many.
        current: in A, of all of them blocked.
        awg: number of the wire from the supply to the robot.
        section: of that wire, in mm2.
        drop: what that wire loses, there and back, in V.
        connector: on it.
        fuse: in A.
        supply: in A.
    """

    servos: int
    current: float
    awg: int
    section: float
    drop: float
    connector: str
    fuse: float
    supply: float


def tether_density(servos: int, servo: ServoMotor) -> float:
    """Return the mass of a metre of a robot's tether in kg: plus, minus, and a signal for each servo."""
    found = power(servos, servo, TETHER)
    section = WIRES[-1][1] if found is None else found.section
    return COPPER * INSULATED * 1e-6 * (2 * section + servos * dict(WIRES)[SIGNAL])


def power(servos: int, servo: ServoMotor, length: float) -> Power | None:
    """Return what feeds so many servos, or None if no wire of the list is thick enough.

    Args:
        servos: how many.
        servo: what they are.
        length: of the tether, in m.
    """
    current = servos * servo.stall_current
    drops = [2.0 * length * RESISTIVITY / section * current for _, section in WIRES]
    wire = next((k for k, drop in enumerate(drops) if drop <= LARGEST_DROP), None)
    if wire is None:
        return None
    connector = next((name for most, name in _CONNECTORS if current <= most), "two XT60")
    # a fuse guards the wire: it must bear all servos blocked, and no more than is needed
    fuse = next((f for f in _FUSES if f >= current), math.ceil(current))
    supply = next((s for s in _SUPPLIES if s >= current), math.ceil(current))
    return Power(servos, current, *WIRES[wire], drops[wire], connector, float(fuse), float(supply))
