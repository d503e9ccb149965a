"""How rubber pulls: the neo-Hookean law of Treloar, *The Physics of Rubber Elasticity* (1975), chapter 5.

A strip that is stretched to ``stretch`` times its length pulls, on its undeformed section, with the stress
``G (stretch - 1 / stretch^2)``, G being the shear modulus. Measured rubber follows it within some percent up
to twice its length and pulls up to a fifth less at three times; the pull test asks for the strain that the
cables have, so that they pull right there.
"""

from __future__ import annotations

from engine.fabrication.materials import CableMaterial


def pull(stretch: float) -> float:
    """Return the stress on the undeformed section, in parts of the shear modulus."""
    return float(stretch - stretch**-2)


def slope(stretch: float) -> float:
    """Return by how much ``pull`` grows with the stretch."""
    return float(1.0 + 2.0 * stretch**-3)


def fresh_shear_modulus(cable: CableMaterial) -> float:
    """Return the shear modulus in Pa of a cable when it is pulled first, from its secant modulus."""
    return cable.modulus * cable.modulus_strain / pull(1.0 + cable.modulus_strain)


def shear_modulus(cable: CableMaterial) -> float:
    """Return the shear modulus in Pa of a cable that is a day old."""
    return fresh_shear_modulus(cable) * (1.0 - cable.relaxation_after_a_day)


def stretch_of(reach: float, length: float) -> float:
    """Return the stretch at which a strip pulls like a spring, with its tension and its stiffness.

    At that stretch, tension over stiffness is ``reach``. So its tension is that of a linear spring which is
    longer than its rest length by ``reach``, and grows as that spring's does.

    Args:
        reach: tension over stiffness, in m.
        length: of the stretched strip, in m; longer than ``reach``.
    """
    q = reach / length
    return float(((1.0 - q) / (1.0 + 2.0 * q)) ** (-1.0 / 3.0))
