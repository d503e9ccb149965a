"""The net of a module: node and face numbers, and for every module the faces that join its neighbours."""

from __future__ import annotations

import numpy as np
from reportlab.lib.colors import Color, HexColor, white
from reportlab.platypus import Flowable

from engine.body import module as t
from engine.fabrication.dimensions.cables import RING_RADIUS, design_cables
from engine.fabrication.materials import Materials
from engine.fabrication.parts.net import Net, lay_out, module_net
from viz.build_sheet import blocks, style
from viz.build_sheet.facts import Facts
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.style import Paper

NEXT, BEFORE, FREE = HexColor("#e3d4f0"), HexColor("#d0ece8"), HexColor("#fbe3cc")
SMALL_HEIGHT = 104.0


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    width = paper.inner_width
    design = design_cables(facts.morphology, materials)[0]
    net = module_net(design, materials.printer)
    printed = materials.cable.form == "printed"
    height = min(250.0, (width - 20) * net.size[1] / net.size[0] + 24)
    cuts = " and ".join(f"node {n} ({' and '.join(labels)})" for n, labels in net.cuts.items())
    size = f"{1000 * net.size[0]:.0f} × {1000 * net.size[1]:.0f} mm"
    if printed:
        fits = "" if net.fits else " (<b>larger than the stated print bed</b>: use a larger printer)"
        how = f"Printed flat, {size}{fits}; the folders net (DXF, SVG) and parts (STL, 3MF) have it at 1:1."
    else:
        how = f"Cut in one piece from a sheet, {size}; the folder net (DXF, SVG) has it at 1:1."
    how += (
        f" From middle to middle of two joined rings: {1000 * net.side:.2f} mm, {1000 * net.free:.2f} mm that"
        f" stretch, and two rings of {1000 * RING_RADIUS:.1f} mm, from their middle, which lie on the caps."
    )
    # the strip is the clearest, whatever layout is made
    scheme = lay_out("strip", design.free, materials.printer)
    small = [_small(facts, scheme, i, width / 2 - 6) for i in range(facts.morphology.n_modules)]
    return [
        blocks.heading("The net of a module: nodes and faces"),
        blocks.body(
            f"All {len(t.CABLES)} cables of a module in one plane, seen from outside. Small numbers at the"
            " rings are <b>nodes</b>; large ones in the triangles are <b>faces</b>, which can join another"
            f" module. The net is cut open at {cuts}: both rings of such a node go on the same cap. {how}"
        ),
        Picture(width, height, lambda pen: _draw_net(pen, net, {}), "net"),
        blocks.together(
            [
                blocks.subheading("Neighbours of every node"),
                neighbours(width),
            ]
        ),
        blocks.subheading("Faces that join, module by module"),
        blocks.note(
            "Violet: joins the next module. Green: joins the module before. Orange: free end of the chain."
            " The three nodes of a coloured face are the ones to tie; which to which is in the orientation"
            " table. Here the net is drawn as one band, not always as it is made."
        ),
        blocks.in_pairs(small, width, 4),
    ]


def neighbours(width: float) -> Flowable:
    """Return the table of which nodes each node is joined to."""
    cells = []
    for n in range(len(t.NODES)):
        others = sorted(b if a == n else a for a, b in t.CABLES if n in (a, b))
        inner = "yes" if n in t.SERVO_NODES else ""
        cells.append([str(n), str(n ^ 1), ", ".join(map(str, others)), inner])
    half = len(cells) // 2
    rows = [[*a, *b] for a, b in zip(cells[:half], cells[half:], strict=True)]
    header = ("node", "rod to", "cables to", "internal cable") * 2
    return blocks.grid(header, rows, blocks.columns(width, 9, 9, 19, 13, 9, 9, 19, 13))


def _small(facts: Facts, net: Net, i: int, width: float) -> Picture:
    n = facts.morphology.n_modules
    face = facts.morphology.faces[i]
    rear = t.OPPOSITE_FACE[face]
    marks = {
        face: NEXT if i < n - 1 else FREE,
        rear: BEFORE if i > 0 else FREE,
    }
    ahead = f"face {face} to module {t.module_number(i + 1)}" if i < n - 1 else f"face {face} free"
    behind = f"face {rear} to module {t.module_number(i - 1)}" if i > 0 else f"face {rear} free"

    def draw(pen: Pen) -> None:
        pen.box(0.5, 0.5, pen.width - 1, pen.height - 1, stroke=style.RULE, radius=4)
        pen.text(8, pen.height - 13, f"Module {facts.module_name(i)}", bold=True, size=9)
        pen.text(pen.width - 8, pen.height - 13, f"{behind} · {ahead}", align="right", size=8)
        _draw_net(pen, net, marks, top=18, small=True)

    return Picture(width, SMALL_HEIGHT, draw, f"net of module {t.module_number(i)}")


def _draw_net(pen: Pen, net: Net, marks: dict[int, Color], *, top: float = 0.0, small: bool = False) -> None:
    margin = 12.0 if small else 16.0
    size = np.array(net.size)
    room = np.array([pen.width - 2 * margin, pen.height - top - 2 * margin])
    scale = float((room / size).min())
    shift = margin + (room - scale * size) / 2
    places = [shift + scale * np.array(e.position) for e in net.eyelets]
    for face, corners in net.faces.items():
        points = [places[k] for k in corners]
        pen.path(points, stroke=None, fill=marks.get(face, style.BAND), close=True)
    for cable in net.cables:
        a, b = (places[k] for k in cable.eyelets)
        pen.line(tuple(a), tuple(b), color=style.CABLE, width=1.0 if small else 1.8)
    for face, corners in net.faces.items():
        x, y = np.mean([places[k] for k in corners], axis=0)
        bold = face in marks or not small
        pen.text(x, y - (3 if small else 5), str(face), align="centre", size=9 if small else 15, bold=bold)
    for k, (eyelet, place) in enumerate(zip(net.eyelets, places, strict=True)):
        if small:
            if any(k in net.faces[f] for f in marks):
                pen.disc(tuple(place), 5.6, fill=style.INK)
                pen.text(
                    place[0], place[1] - 2.5, str(eyelet.node), align="centre", size=7, bold=True, color=white
                )
            else:
                pen.disc(tuple(place), 1.8, fill=style.CABLE)
            continue
        pen.disc(tuple(place), 8.5, fill=white, stroke=style.CABLE, width=1.4)
        pen.text(place[0], place[1] - 2.9, eyelet.label, align="centre", size=8, bold=True)
