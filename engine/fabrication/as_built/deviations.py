"""Every difference between a built robot and the simulated one: how large, how uncertain, and how one knows.

``docs/as_built.md`` explains each of them. What is derived from the design is *computed*; what somebody
entered in the materials file after a measurement is *measured*; all else is *assumed*, and says from where.
"""

from __future__ import annotations

from collections.abc import Iterable

from engine.body.morphology import Morphology
from engine.fabrication.as_built import body, drive, surroundings
from engine.fabrication.as_built.deviation import Deviation
from engine.fabrication.dimensions.feet import Foot
from engine.fabrication.materials import Materials


def deviations(
    morphology: Morphology,
    materials: Materials,
    levels: Iterable[int] | None = None,
    feet: tuple[Foot, ...] = (),
) -> tuple[Deviation, ...]:
    """Return every difference between a robot as built of some materials and as simulated.

    Args:
        morphology: its body.
        materials: what it is built from.
        levels: stiffness levels for which the figures hold; by default the body's own. A search needs all,
            and takes masses and centre of mass of a typical body for those of every other.
        feet: that it wears, for their masses.
    """
    wanted = sorted(set(morphology.stiffness_levels if levels is None else levels))
    found = [
        body.masses(morphology, materials, feet),
        body.centre_of_mass(morphology, materials, feet),
        body.cables(wanted, materials),
        body.rest_length(),
        drive.line_elastic(materials),
        drive.line_limit(materials),
        drive.line_lengths(),
        drive.winding(),
        drive.servo(materials),
        surroundings.sensing(),
        surroundings.friction(),
    ]
    if not (materials.board.carried and materials.battery.carried):
        found.append(surroundings.tether(morphology, materials))
    if morphology.feet != "none":
        found.append(surroundings.feet(materials))
    return tuple(found)
