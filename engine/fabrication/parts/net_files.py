"""What is cut from a sheet, as a drawing at 1:1: nets and the coupon as DXF and SVG, in mm, with a scale bar.

Layer or group ``CUT`` is the net's outline with its holes; ``ENGRAVE`` holds the eyelets' labels, the
faces' numbers and the scale bar; ``REST`` one line per cable from ring to ring, which is its
unstretched length. Equal drawings give equal bytes.
"""

from __future__ import annotations

import dataclasses
import io
import math
from collections.abc import Iterator
from typing import Any, Final
from xml.sax.saxutils import escape

import ezdxf
import numpy as np
from ezdxf import units
from shapely.affinity import translate
from shapely.geometry import MultiPolygon, Polygon

from engine.fabrication.dimensions.cables import RING_RADIUS, CableDesign
from engine.fabrication.dimensions.pull_test import Coupon
from engine.fabrication.parts.net import Net
from engine.fabrication.parts.shapes import coupon_outline, net_outline

SCALE_BAR: Final = 50.0
"""Length of the scale bar, in mm."""
_MARGIN: Final = 10.0
_FOOT: Final = 16.0
"""Space below the net for the scale bar and a line of text, in mm."""
_TEXT: Final = 2.5
# no dates, no random identifiers: this program writes DXF nowhere else
ezdxf.options.write_fixed_meta_data_for_testing = True

_STYLE: Final = {"CUT": ("#d00000", 1), "ENGRAVE": ("#0000c0", 5), "REST": ("#707070", 8)}
"""Colour in SVG and colour index in DXF of each layer."""


Point2 = tuple[float, float]


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """What is cut from a sheet, in mm, its lower left corner at (0, 0).

    Attributes:
        outline: to cut.
        size: (x, y) that it covers.
        rests: name and ends of unstretched lengths.
        labels: text, middle (x, y) and height.
        foot: a line of text below it.
    """

    outline: Polygon | MultiPolygon
    size: Point2
    rests: tuple[tuple[str, Point2, Point2], ...]
    labels: tuple[tuple[str, float, float, float], ...]
    foot: str


def net_drawing(net: Net, design: CableDesign) -> Drawing:
    """Return the drawing of a net."""
    section = design.section
    size = f"{1e3 * section.width:.2f} x {1e3 * section.thickness:.2f} mm"
    lines = zip(net.cables, rest_lines(net), strict=True)
    return Drawing(
        outline=net_outline(net, design),
        size=(1e3 * net.size[0], 1e3 * net.size[1]),
        rests=tuple((f"cable_{c.nodes[0]}_{c.nodes[1]}", a, b) for c, (a, b) in lines),
        labels=tuple(_labels(net)),
        foot=f"net of a module, stiffness {design.level / 10:.1f}; outside up; cables {size}, unstretched"
        f" {1e3 * net.free:.2f} mm from ring to ring; 1:1, mm; this bar is {SCALE_BAR:g} mm",
    )


def coupon_drawing(c: Coupon) -> Drawing:
    """Return the drawing of the pull test's coupon, with its two marks."""
    outline = coupon_outline(c)
    x, y, x1, y1 = outline.bounds
    half, width = 500 * c.gauge_length, 500 * c.width
    marks = [((s * half - x, -width - y), (s * half - x, width - y)) for s in (-1, 1)]
    return Drawing(
        outline=translate(outline, -x, -y),
        size=(x1 - x, y1 - y),
        rests=tuple((f"mark_{k}", a, b) for k, (a, b) in enumerate(marks, start=1)),
        labels=(),
        foot=f"coupon of the pull test, {1e3 * c.width:.2f} x {1e3 * c.thickness:.2f} mm,"
        f" {1e3 * c.gauge_length:.0f} mm between its marks; 1:1, mm; this bar is {SCALE_BAR:g} mm",
    )


def rest_lines(net: Net) -> list[tuple[Point2, Point2]]:
    """Return a line in mm for each cable, from the edge of one ring to the other's."""
    lines = []
    for cable in net.cables:
        a, b = (1e3 * np.array(net.eyelets[i].position) for i in cable.eyelets)
        step = (b - a) / np.linalg.norm(b - a) * 1e3 * RING_RADIUS
        lines.append(
            ((float(a[0] + step[0]), float(a[1] + step[1])), (float(b[0] - step[0]), float(b[1] - step[1])))
        )
    return lines


def _labels(net: Net) -> Iterator[tuple[str, float, float, float]]:
    """Yield text, middle (x, y) and height in mm."""
    offset = 1e3 * RING_RADIUS + 0.8 * _TEXT
    directions = [np.array([math.sin(a), math.cos(a)]) for a in np.radians(np.arange(0, 360, 30))]
    for i, e in enumerate(net.eyelets):
        here = np.array(e.position)
        cables = [
            _unit(np.array(net.eyelets[k].position) - here)
            for c in net.cables
            if i in c.eyelets
            for k in c.eyelets
            if k != i
        ]
        # beside the ring, where cables leave the most room; above it if two sides are as good
        away = min(directions, key=lambda d: round(max(float(d @ c) for c in cables), 6))
        x, y = 1e3 * here + offset * away
        yield e.label, float(x), float(y), _TEXT
    for face, trio in net.faces.items():
        x, y = 1e3 * np.mean([net.eyelets[i].position for i in trio], axis=0)
        yield f"face {face}", float(x), float(y), _TEXT


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _rings(drawing: Drawing) -> list[list[Point2]]:
    shape = drawing.outline
    polygons = [shape] if isinstance(shape, Polygon) else list(shape.geoms)
    return [list(ring.coords)[:-1] for p in polygons for ring in (p.exterior, *p.interiors)]


def svg_bytes(drawing: Drawing) -> bytes:
    """Return the drawing as SVG; one user unit is 1 mm."""
    width, height = (s + 2 * _MARGIN for s in drawing.size)
    height += _FOOT

    def at(x: float, y: float) -> str:
        return f"{_MARGIN + x:.4f},{_MARGIN + drawing.size[1] - y:.4f}"

    outline = "".join("M" + "L".join(at(x, y) for x, y in ring) + "Z" for ring in _rings(drawing))
    rest = "".join(f'<path id="{name}" d="M{at(*a)}L{at(*b)}"/>' for name, a, b in drawing.rests)
    texts = "".join(_svg_text(text, at(x, y), size) for text, x, y, size in drawing.labels)
    bar = -_MARGIN - 2
    ticks = "".join(f"M{at(x, bar)}L{at(x, bar + 3)}" for x in (0.0, SCALE_BAR))
    foot = (
        f'<text x="{_MARGIN:.4f}" y="{height - 5:.4f}" font-size="2.5" fill="#0000c0" stroke="none">'
        f"{escape(drawing.foot)}</text>"
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.4f}mm" height="{height:.4f}mm"'
        f' viewBox="0 0 {width:.4f} {height:.4f}" font-family="Helvetica,Arial,sans-serif">\n'
        f"<title>{escape(drawing.foot)}</title>\n"
        f'<g id="CUT" fill="none" stroke="{_STYLE["CUT"][0]}" stroke-width="0.1"><path d="{outline}"/></g>\n'
        f'<g id="REST" fill="none" stroke="{_STYLE["REST"][0]}" stroke-width="0.1">{rest}</g>\n'
        f'<g id="ENGRAVE" fill="none" stroke="{_STYLE["ENGRAVE"][0]}" stroke-width="0.2">{texts}'
        f'<path id="scale_bar" d="M{at(0, bar)}L{at(SCALE_BAR, bar)}"/><path d="{ticks}"/>{foot}</g>\n'
        "</svg>\n"
    ).encode()


def _svg_text(text: str, point: str, size: float) -> str:
    x, y = point.split(",")
    return (
        f'<text x="{x}" y="{float(y) + 0.36 * size:.4f}" font-size="{size:g}" text-anchor="middle"'
        f' fill="{_STYLE["ENGRAVE"][0]}" stroke="none">{escape(text)}</text>'
    )


def dxf_bytes(drawing: Drawing) -> bytes:
    """Return the drawing as DXF R2010, its unit set to mm."""
    document = ezdxf.new("R2010", setup=False, units=units.MM)
    document.header["$MEASUREMENT"] = 1
    for name, (_, colour) in _STYLE.items():
        document.layers.add(name, color=colour)
    space = document.modelspace()
    # the header's unit is the document's; some programs look at the drawing's own
    space.units = units.InsertUnits.Millimeters
    for ring in _rings(drawing):
        space.add_lwpolyline(ring, close=True, dxfattribs={"layer": "CUT"})
    for _, a, b in drawing.rests:
        space.add_line(a, b, dxfattribs={"layer": "REST"})
    for text, x, y, size in drawing.labels:
        _dxf_text(space, text, x, y, size)
    bar = -_MARGIN
    space.add_line((0, bar), (SCALE_BAR, bar), dxfattribs={"layer": "ENGRAVE"})
    for x in (0.0, SCALE_BAR):
        space.add_line((x, bar), (x, bar + 3), dxfattribs={"layer": "ENGRAVE"})
    space.add_text(drawing.foot, height=_TEXT, dxfattribs={"layer": "ENGRAVE", "insert": (0, bar - 5)})
    # ezdxf would declare the kinds of objects in the order of a set, which differs from process to process
    document.commit_pending_changes()
    for kind in sorted(document.entitydb.dxf_types_in_use()):
        document.classes.add_class(kind)
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue().encode()


def _dxf_text(space: Any, text: str, x: float, y: float, size: float) -> None:
    entity = space.add_text(text, height=size, dxfattribs={"layer": "ENGRAVE"})
    entity.set_placement((x, y), align=ezdxf.enums.TextEntityAlignment.MIDDLE_CENTER)
