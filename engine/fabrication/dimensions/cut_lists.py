"""What to cut: every passive cable and every rod of a robot, one a row, and how many rods to buy."""

from __future__ import annotations

import dataclasses
import math
from typing import Literal

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import design_cables, spans
from engine.fabrication.dimensions.floating_module import CONTRACTED, floating_module
from engine.fabrication.materials import CAP_TIP, Materials


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Cable:
    """One passive cable, a row of the cut list. Lengths in m.

    Attributes:
        name: as in the simulation's model: ``m0_cable_0_4``.
        module: index from 0.
        nodes: its two end nodes.
        assembled: length between its anchors in the assembled module, servo off (simulated).
        contracted: the same at full contraction (simulated).
        rest: rest length between the anchors (simulated).
        free: unstretched length of the strip from ring to ring.
        pretension: tension in the assembled module, servo off, in N.
        stiffness: in N/m.
        strain_assembled, strain_contracted: of the material.
        area, square_side: of the section that the stiffness asks for.
        producible: whether that section can be printed, or cut from a sheet that can be bought.
    """

    name: str
    module: int
    nodes: tuple[int, int]
    assembled: float
    contracted: float
    rest: float
    free: float
    pretension: float
    stiffness: float
    strain_assembled: float
    strain_contracted: float
    area: float
    square_side: float
    producible: bool


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Rod:
    """One rod, a row of the cut list.

    Attributes:
        name: as in the simulation's model: ``m0_rod0``.
        module: index from 0.
        nodes: its two ends.
        kind: whether it carries the servo.
        length: from node to node, in m (simulated).
        cut: length to cut, in m: less, because the caps' solid tips reach the nodes. A servo rod is cut
            again, into two pieces with the servo's mount between them (``parts.servo_parts.half_rods``).
        diameter: in m (simulated).
        simulated_mass: in kg, with servo and arm on the servo rod.
        cut_mass: of the bare piece of stock, in kg (from the assumed density).
    """

    name: str
    module: int
    nodes: tuple[int, int]
    kind: Literal["plain", "servo"]
    length: float
    cut: float
    diameter: float
    simulated_mass: float
    cut_mass: float


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class StockPlan:
    """How many rods to buy.

    Attributes:
        pieces: to cut in all.
        pieces_per_stock: that one bought rod yields, saw cuts included.
        stock_rods: to buy.
        stock_length: of each, in m.
    """

    pieces: int
    pieces_per_stock: int
    stock_rods: int
    stock_length: float


def cables(morphology: Morphology, materials: Materials) -> tuple[Cable, ...]:
    """Return every passive cable of a robot: 24 per module, in the order of ``module.CABLES``."""
    rows = []
    for d in design_cables(morphology, materials):
        assembled, contracted = (floating_module(d.level, c).cables for c in (None, CONTRACTED))
        strips, short = (spans(d.level, c) for c in (None, CONTRACTED))
        for k, nodes in enumerate(t.CABLES):
            rows.append(
                Cable(
                    name=f"m{d.module}_cable_{nodes[0]}_{nodes[1]}",
                    module=d.module,
                    nodes=nodes,
                    assembled=float(assembled[k]),
                    contracted=float(contracted[k]),
                    rest=t.CABLE_REST_LENGTH,
                    free=d.free,
                    pretension=d.stiffness * (float(assembled[k]) - t.CABLE_REST_LENGTH),
                    stiffness=d.stiffness,
                    strain_assembled=float(strips[k]) / d.free - 1.0,
                    strain_contracted=max(0.0, float(short[k]) / d.free - 1.0),
                    area=d.area,
                    square_side=d.square_side,
                    producible=d.producible,
                )
            )
    return tuple(rows)


def rods(morphology: Morphology, materials: Materials) -> tuple[Rod, ...]:
    """Return the rods of a robot: six per module, in the order of ``module.RODS``."""
    cut = t.ROD_LENGTH - 2 * CAP_TIP
    bore = (materials.rod.bore or 0.0) / 2
    cut_mass = materials.rod.density * math.pi * (t.ROD_RADIUS**2 - bore**2) * cut
    return tuple(
        Rod(
            name=f"m{i}_rod{r}",
            module=i,
            nodes=nodes,
            kind="servo" if r == t.SERVO_ROD else "plain",
            length=t.ROD_LENGTH,
            cut=cut,
            diameter=2 * t.ROD_RADIUS,
            simulated_mass=t.SERVO_ROD_MASS if r == t.SERVO_ROD else t.ROD_MASS,
            cut_mass=cut_mass,
        )
        for i in range(morphology.n_modules)
        for r, nodes in enumerate(t.RODS)
    )


def stock_plan(morphology: Morphology, materials: Materials) -> StockPlan:
    """Return how many rods to buy."""
    stock, cut = materials.rod, t.ROD_LENGTH - 2 * CAP_TIP
    pieces = len(t.RODS) * morphology.n_modules
    # the last piece needs no cut behind it
    each = math.floor((stock.stock_length + stock.kerf) / (cut + stock.kerf) + 1e-9)
    return StockPlan(
        pieces=pieces,
        pieces_per_stock=each,
        stock_rods=math.ceil(pieces / each),
        stock_length=stock.stock_length,
    )
