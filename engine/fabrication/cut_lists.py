"""Every passive cable of a robot one by one: the rows of the cut list."""

from __future__ import annotations

import dataclasses

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.cables import KNOT_ALLOWANCE, design_cables
from engine.fabrication.floating_module import CONTRACTED, floating_module
from engine.fabrication.materials import Materials


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Cable:
    """One passive cable, a row of the cut list. Lengths in m.

    Attributes:
        name: as in the simulation's model: ``m0_cable_0_4``.
        module: index from 0.
        nodes: its two end nodes.
        assembled: length between its anchors in the assembled module, servo off (simulated).
        contracted: the same at full contraction (simulated).
        rest: length between the anchors at which it pulls nothing (simulated).
        cut: length to cut from cord, knots included; None if it is printed.
        pretension: tension in the assembled module, servo off, in N.
        stiffness: in N/m.
        strain_assembled, strain_contracted: of the material.
        area, square_side, round_diameter: of the section that the stiffness asks for.
        producible: whether that section can be printed or bought.
    """

    name: str
    module: int
    nodes: tuple[int, int]
    assembled: float
    contracted: float
    rest: float
    cut: float | None
    pretension: float
    stiffness: float
    strain_assembled: float
    strain_contracted: float
    area: float
    square_side: float
    round_diameter: float
    producible: bool


def cables(morphology: Morphology, materials: Materials) -> tuple[Cable, ...]:
    """Return every passive cable of a robot: 24 per module, in the order of ``tensegrity.CABLES``."""
    rows = []
    for d in design_cables(morphology, materials):
        assembled = floating_module(d.level, None).cables
        contracted = floating_module(d.level, CONTRACTED).cables
        for k, nodes in enumerate(t.CABLES):
            stretch = float(assembled[k]) - d.rest
            rows.append(
                Cable(
                    name=f"m{d.module}_cable_{nodes[0]}_{nodes[1]}",
                    module=d.module,
                    nodes=nodes,
                    assembled=float(assembled[k]),
                    contracted=float(contracted[k]),
                    rest=d.rest,
                    cut=d.path + 2 * KNOT_ALLOWANCE if materials.cable.form == "cord" else None,
                    pretension=d.stiffness * stretch,
                    stiffness=d.stiffness,
                    strain_assembled=stretch / d.free,
                    strain_contracted=max(0.0, float(contracted[k]) - d.rest) / d.free,
                    area=d.area,
                    square_side=d.square_side,
                    round_diameter=d.round_diameter,
                    producible=d.producible,
                )
            )
    return tuple(rows)
