"""The passive cables of a module as one flat net, unfolded from the icosahedron.

Every one of the 24 cables is an edge of exactly one of the eight faces that can carry a joint, and
these eight triangles touch only at nodes, two at each. The other twelve faces of the icosahedron are
holes. So a net is eight equilateral triangles hung together at corners. At ten nodes of the strip both
triangles stay together; at the two others the net is cut: the node has two eyelets, ``a`` and ``b``,
which go on the same cap.

Seen from above the net shows the side that is outside on the module.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import RING_RADIUS, CableDesign, design_cables
from engine.fabrication.materials import Materials, Printer

EYELET_HOLE: Final = 0.0027
"""Diameter of a ring's hole, in m: it grips the cap's post of 3 mm."""


STRIP: Final[tuple[tuple[int, int, float], ...]] = (
    (1, 3, 0),
    (2, 7, 0),
    (3, 1, 0),
    (4, 6, 0),
    (7, 9, 60),
    (8, 8, 60),
    (5, 10, 60),
    (6, 11, 60),
)
"""A band round the module, cut open at nodes 2 and 3. Each entry: a face, the node by which it hangs on
the faces before it, the angle of its next side (counter-clockwise) from there in degrees."""

BLOCK: Final[tuple[tuple[int, int, float], ...]] = (
    (1, 3, 0),
    (2, 7, 0),
    (3, 1, 0),
    (7, 9, 60),
    (8, 8, 60),
    (5, 10, 60),
    (4, 6, 194),
    (6, 11, 150),
)
"""The same band with its last quarter hung below it: for beds that the strip is too long for."""

LAYOUTS: Final = {"strip": STRIP, "block": BLOCK}


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Eyelet:
    """A ring of the net.

    Attributes:
        label: the node's number, with a letter where the net is cut: ``5`` or ``3a``.
        node: the rod end whose cap it goes on.
        position: (x, y) of its middle, in m.
    """

    label: str
    node: int
    position: tuple[float, float]


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class NetCable:
    """A cable in the net.

    Attributes:
        nodes: as in ``module.CABLES``.
        eyelets: indices of the eyelets at these nodes.
    """

    nodes: tuple[int, int]
    eyelets: tuple[int, int]


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Net:
    """The flat net of a module.

    Attributes:
        layout: its name in ``LAYOUTS``.
        side: between the middles of two joined eyelets, in m: the cables' unstretched length and the
            radii of two rings.
        free: unstretched length of every cable from ring to ring, in m.
        eyelets, cables: in the order of nodes and of ``module.CABLES``.
        faces: for each face of the module its three eyelets, in the order of ``module.FACES``.
        cuts: for each node with two eyelets their labels.
        size: (x, y) that the net covers, rings included, in m.
        fits: whether that lies inside the printer's bed.
    """

    layout: str
    side: float
    free: float
    eyelets: tuple[Eyelet, ...]
    cables: tuple[NetCable, ...]
    faces: dict[int, tuple[int, int, int]]
    cuts: dict[int, tuple[str, ...]]
    size: tuple[float, float]
    fits: bool


SHEET_MARGIN: Final = 0.01
"""Of a sheet around its net, in m."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class SheetCut:
    """What is cut from sheets of one thickness.

    Attributes:
        thickness: in m.
        nets: how many.
        size: (x, y) that each of them takes, in m.
    """

    thickness: float
    nets: int
    size: tuple[float, float]

    @property
    def pieces(self) -> int:
        """How many pieces to buy: one for each net, and one for misses and the coupon."""
        return self.nets + 1

    @property
    def piece(self) -> tuple[float, float]:
        """Size (x, y) of such a piece, in m."""
        x, y = self.size
        return x + 2 * SHEET_MARGIN, y + 2 * SHEET_MARGIN


def sheet_cuts(morphology: Morphology, materials: Materials) -> tuple[SheetCut, ...]:
    """Return which nets are cut from which sheet, the thinnest first; none if they are printed."""
    if materials.cable.form == "printed":
        return ()
    found: dict[float, list[Net]] = {}
    for design in design_cables(morphology, materials):
        found.setdefault(design.section.thickness, []).append(module_net(design, materials.printer))
    return tuple(
        SheetCut(
            thickness=thickness,
            nets=len(nets),
            size=(max(n.size[0] for n in nets), max(n.size[1] for n in nets)),
        )
        for thickness, nets in sorted(found.items())
    )


def net_name(level: int) -> str:
    """Return what the files of a net are called, without ending, for a stiffness level from 1 to 10."""
    return f"net_stiffness_{level / t.N_STIFFNESS_LEVELS:.1f}"


def module_net(design: CableDesign, printer: Printer) -> Net:
    """Return a module's net in the first layout that fits the bed, or else in the smallest."""
    nets = [lay_out(name, design.free, printer) for name in LAYOUTS]
    return next((n for n in nets if n.fits), min(nets, key=lambda n: max(n.size)))


def lay_out(layout: str, free: float, printer: Printer) -> Net:
    """Return the net of a layout for cables of an unstretched length, its lower left corner at (0, 0)."""
    side = free + 2 * RING_RADIUS
    corners = _corners(LAYOUTS[layout])
    # the two triangles of a node share an eyelet if their corners coincide
    spots: list[tuple[int, np.ndarray]] = []
    faces: dict[int, tuple[int, int, int]] = {}
    for face in sorted(corners):
        here = []
        for node, point in zip(t.FACES[face], corners[face], strict=True):
            index = next(
                (i for i, (n, p) in enumerate(spots) if n == node and math.dist(p, point) < 1e-9), None
            )
            if index is None:
                index = len(spots)
                spots.append((node, point))
            here.append(index)
        faces[face] = (here[0], here[1], here[2])
    # by node, and from left to right where a node has two
    order = sorted(range(len(spots)), key=lambda i: (spots[i][0], *np.round(spots[i][1], 9)))
    rank = {old: new for new, old in enumerate(order)}
    faces = {f: (rank[a], rank[b], rank[c]) for f, (a, b, c) in faces.items()}
    points = np.array([spots[i][1] for i in order]) * side
    points += RING_RADIUS - points.min(axis=0)
    nodes = [spots[i][0] for i in order]
    eyelets = tuple(
        Eyelet(label=_label(nodes, i), node=node, position=(float(points[i, 0]), float(points[i, 1])))
        for i, node in enumerate(nodes)
    )
    size = points.max(axis=0) + RING_RADIUS
    return Net(
        layout=layout,
        side=side,
        free=free,
        eyelets=eyelets,
        cables=_cables(faces, nodes),
        faces=faces,
        cuts={
            n: tuple(e.label for e in eyelets if e.node == n)
            for n in range(len(t.NODES))
            if nodes.count(n) > 1
        },
        size=(float(size[0]), float(size[1])),
        fits=bool(size[0] <= printer.bed_x and size[1] <= printer.bed_y),
    )


def _corners(hung: Sequence[tuple[int, int, float]]) -> dict[int, np.ndarray]:
    """Return for each face its (3, 2) corners for sides of length 1, in the order of ``FACES``."""
    placed: dict[int, np.ndarray] = {}
    for face, node, angle in hung:
        nodes = t.FACES[face]
        at = nodes.index(node)
        start = next(
            (p[t.FACES[f].index(node)] for f, p in placed.items() if node in t.FACES[f]), np.zeros(2)
        )
        corners = np.zeros((3, 2))
        corners[at] = start
        for k in (1, 2):
            a = math.radians(angle + 60 * (k - 1))
            corners[(at + k) % 3] = start + np.array([math.cos(a), math.sin(a)])
        placed[face] = corners
    return placed


def _cables(faces: dict[int, tuple[int, int, int]], nodes: Sequence[int]) -> tuple[NetCable, ...]:
    found: dict[tuple[int, int], NetCable] = {}
    for trio in faces.values():
        for k in range(3):
            i, j = trio[k], trio[(k + 1) % 3]
            if (nodes[i], nodes[j]) not in t.CABLES:
                i, j = j, i
            ends = nodes[i], nodes[j]
            found[ends] = NetCable(nodes=ends, eyelets=(i, j))
    return tuple(found[c] for c in t.CABLES)


def _label(nodes: Sequence[int], i: int) -> str:
    node = nodes[i]
    if nodes.count(node) == 1:
        return str(node)
    return f"{node}{'abc'[nodes[:i].count(node)]}"
