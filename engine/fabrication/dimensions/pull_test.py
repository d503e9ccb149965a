"""The coupon for a pull test, whose result goes into the table ``[pull_test]`` of the materials file."""

from __future__ import annotations

import dataclasses
from typing import Final

from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.dimensions.rubber import fresh_shear_modulus, pull
from engine.fabrication.materials import Materials

GAUGE_LENGTH: Final = 0.060
"""Free length of the coupon, in m."""
_SECTION_FACTOR: Final = 4.0
"""The coupon is this many times as wide as a cable, so that a scale reads its force better."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Coupon:
    """A dog bone to print with the net's settings, or to cut from its sheet, and to pull.

    Attributes:
        gauge_length: free length between the marks, in m.
        width, thickness: of the free length, in m.
        area: in m2.
        grip_length, grip_width: of the plates at its ends, in m.
        extension: to pull it to, in m: the strain that the cables have in the assembled module.
        expected_force: at that extension if the modulus of the materials file is right, in N.
        expected_mass: that hangs from it then, in kg: expected_force / 9.81 m/s2.
    """

    gauge_length: float
    width: float
    thickness: float
    area: float
    grip_length: float
    grip_width: float
    extension: float
    expected_force: float

    @property
    def expected_mass(self) -> float:
        """The mass in kg whose weight is the expected force."""
        return self.expected_force / 9.81


def coupon(morphology: Morphology, materials: Materials) -> Coupon:
    """Return the coupon for a robot's cables: as thick as the thinnest module's, several times as wide."""
    design = min(design_cables(morphology, materials), key=lambda d: d.area)
    section = design.section
    width = _SECTION_FACTOR * section.width
    area = width * section.thickness
    return Coupon(
        gauge_length=GAUGE_LENGTH,
        width=width,
        thickness=section.thickness,
        area=area,
        grip_length=0.020,
        grip_width=max(0.015, 1.3 * width),
        extension=GAUGE_LENGTH * design.strain_assembled,
        expected_force=area * fresh_shear_modulus(materials.cable) * pull(1.0 + design.strain_assembled),
    )
