"""The cut list of the rods."""

from __future__ import annotations

import dataclasses
import math
from typing import Literal

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.materials import CAP_TIP, Materials


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Rod:
    """One rod, a row of the cut list.

    Attributes:
        name: as in the simulation's model: ``m0_rod0``.
        module: index from 0.
        nodes: its two ends.
        kind: whether it carries the servo.
        length: from node to node, in m (simulated).
        cut: length to cut, in m: less, because the caps' solid tips reach the nodes.
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


def rods(morphology: Morphology, materials: Materials) -> tuple[Rod, ...]:
    """Return the rods of a robot: six per module, in the order of ``tensegrity.RODS``."""
    cut = t.ROD_LENGTH - 2 * CAP_TIP
    cut_mass = materials.rod.density * math.pi * t.ROD_RADIUS**2 * cut
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
