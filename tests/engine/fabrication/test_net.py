import dataclasses
import io
import itertools
import math
import xml.etree.ElementTree as ET

import ezdxf
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, Polygon
from svg.path import parse_path

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.materials import PRESETS, load_materials
from engine.fabrication.parts.net import EYELET_HOLE, EYELET_RADIUS, LAYOUTS, lay_out, module_net
from engine.fabrication.parts.net_files import SCALE_BAR, dxf_bytes, rest_lines, svg_bytes
from engine.fabrication.parts.shapes import net_outline

MATERIALS = load_materials()
PRINTER = MATERIALS.printer
SVG = "{http://www.w3.org/2000/svg}"


def design_of(level, name="tpu-85a"):
    return design_cables(Morphology(level, (1, 2)), load_materials(name))[0]


@pytest.fixture(params=LAYOUTS)
def net(request):
    return lay_out(request.param, design_of(5).path, PRINTER)


def points(net):
    return np.array([e.position for e in net.eyelets])


@given(path=st.floats(0.02, 0.08), layout=st.sampled_from(sorted(LAYOUTS)))
@settings(max_examples=25, deadline=None)
def test_every_cable_lies_once_at_its_rest_length(path, layout):
    net = lay_out(layout, path, PRINTER)
    assert tuple(c.nodes for c in net.cables) == t.CABLES
    for cable, (a, b) in zip(net.cables, rest_lines(net), strict=True):
        assert tuple(net.eyelets[i].node for i in cable.eyelets) == cable.nodes
        assert math.dist(a, b) == pytest.approx(1e3 * path)
    assert points(net).min() == pytest.approx(EYELET_RADIUS)
    assert (points(net).max(axis=0) + EYELET_RADIUS).tolist() == pytest.approx(net.size)


def test_no_two_cables_overlap_and_no_cable_meets_a_foreign_eyelet(net):
    lines = [LineString([net.eyelets[i].position for i in c.eyelets]) for c in net.cables]
    for (c, a), (d, b) in itertools.combinations(zip(net.cables, lines, strict=True), 2):
        shared = set(c.eyelets) & set(d.eyelets)
        if shared:
            (eyelet,) = shared
            # away from their common ring they are apart
            ring = Point(net.eyelets[eyelet].position).buffer(EYELET_RADIUS)
            assert a.difference(ring).distance(b.difference(ring)) > 0.0005
        else:
            assert a.distance(b) > 0.003
    for i, e in enumerate(net.eyelets):
        for c, line in zip(net.cables, lines, strict=True):
            if i not in c.eyelets:
                assert line.distance(Point(e.position)) > EYELET_RADIUS + 0.001
    for a, b in itertools.combinations(points(net), 2):
        assert math.dist(a, b) > 2 * EYELET_RADIUS


def test_folded_back_every_face_closes(net):
    """Turn every triangle rigidly onto its face of the icosahedron: eyelets of a node meet on its rod end."""
    scale = net.side / np.linalg.norm(t.NODES[0] - t.NODES[4])
    solid = scale * t.NODES
    for face, trio in net.faces.items():
        flat = points(net)[list(trio)]
        nodes = [net.eyelets[i].node for i in trio]
        assert nodes == list(t.FACES[face])
        corners = solid[nodes]
        # rigid: same sides
        for i, j in itertools.combinations(range(3), 2):
            assert math.dist(flat[i], flat[j]) == pytest.approx(math.dist(corners[i], corners[j]))
        # and not turned over: counter-clockwise on paper is counter-clockwise seen from outside
        (ax, ay), (bx, by) = flat[1] - flat[0], flat[2] - flat[0]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        assert ax * by - ay * bx > 0
        assert normal @ corners.mean(axis=0) > 0
    # every cable is a side of exactly one face; every node has two faces and all its eyelets hold them
    sides = [
        frozenset((t.FACES[f][i], t.FACES[f][j])) for f in net.faces for i, j in ((0, 1), (1, 2), (2, 0))
    ]
    assert sorted(map(sorted, sides)) == sorted(map(sorted, t.CABLES))
    for node in range(12):
        eyelets = [i for i, e in enumerate(net.eyelets) if e.node == node]
        faces = [f for f, trio in net.faces.items() if set(trio) & set(eyelets)]
        assert len(faces) == 2
        assert (len(eyelets) > 1) == (node in net.cuts)


def test_labels_are_unique_and_say_where_the_net_is_cut(net):
    labels = [e.label for e in net.eyelets]
    assert len(set(labels)) == len(labels)
    assert net.cuts == {n: (f"{n}a", f"{n}b") for n in net.cuts}
    assert len(net.cuts) == {"strip": 2, "block": 3}[net.layout]
    assert len(labels) == 12 + len(net.cuts)


def test_the_net_is_one_piece(net):
    outline = net_outline(net, design_of(5))
    assert isinstance(outline, Polygon)
    assert outline.is_valid
    holes = [h for h in outline.interiors if Polygon(h).area < 1e6 * EYELET_HOLE**2]
    assert len(holes) == len(net.eyelets)


def test_the_layout_that_fits_the_bed_is_taken():
    design = design_of(5)
    assert module_net(design, PRINTER).layout == "block"
    long = dataclasses.replace(PRINTER, bed_x=0.3)
    assert module_net(design, long).layout == "strip"
    small = dataclasses.replace(PRINTER, bed_x=0.1, bed_y=0.1)
    assert not module_net(design, small).fits


@pytest.mark.parametrize("name", PRESETS)
def test_svg_is_true_to_scale(name):
    design = design_of(6, name)
    net = module_net(design, PRINTER)
    root = ET.fromstring(svg_bytes(net, design))
    width, height = root.get("width"), root.get("height")
    assert width.endswith("mm")
    assert height.endswith("mm")
    box = list(map(float, root.get("viewBox").split()))
    assert box == [0, 0, float(width[:-2]), float(height[:-2])]  # one unit is one millimetre
    groups = {g.get("id"): g for g in root.iter(f"{SVG}g")}
    assert set(groups) == {"CUT", "REST", "ENGRAVE"}
    rest = {p.get("id"): parse_path(p.get("d")) for p in groups["REST"]}
    assert set(rest) == {f"cable_{a}_{b}" for a, b in t.CABLES}
    for path in rest.values():
        assert path.length() == pytest.approx(1e3 * design.path, abs=2e-3)
    (bar,) = [p for p in root.iter(f"{SVG}path") if p.get("id") == "scale_bar"]
    assert parse_path(bar.get("d")).length() == pytest.approx(SCALE_BAR)
    texts = {e.text for e in root.iter(f"{SVG}text")}
    assert {e.label for e in net.eyelets} | {f"face {f}" for f in t.FACES} <= texts
    everything = [
        x for p in root.iter(f"{SVG}path") for s in parse_path(p.get("d")) for x in (s.start, s.end)
    ]
    assert min(z.real for z in everything) > 0
    assert max(z.real for z in everything) < box[2]
    assert min(z.imag for z in everything) > 0
    assert max(z.imag for z in everything) < box[3]


@pytest.mark.parametrize("level", [3, 10])
def test_dxf_is_true_to_scale(level):
    design = design_of(level)
    net = module_net(design, PRINTER)
    content = dxf_bytes(net, design)
    document = ezdxf.read(io.StringIO(content.decode()))
    assert document.units == ezdxf.units.MM
    assert not document.audit().errors
    space = document.modelspace()
    lengths = [e.dxf.start.distance(e.dxf.end) for e in space.query('LINE[layer=="REST"]')]
    assert lengths == pytest.approx([1e3 * design.path] * 24)
    bars = [e.dxf.start.distance(e.dxf.end) for e in space.query('LINE[layer=="ENGRAVE"]')]
    assert SCALE_BAR in bars
    rings = [Polygon([p[:2] for p in e.get_points()]) for e in space.query('LWPOLYLINE[layer=="CUT"]')]
    assert all(e.closed for e in space.query("LWPOLYLINE"))
    outer = max(rings, key=lambda r: r.area)
    area = outer.area - sum(r.area for r in rings if r is not outer)
    assert area == pytest.approx(net_outline(net, design).area)
    x0, y0, x1, y1 = outer.bounds
    assert (x1 - x0, y1 - y0) == pytest.approx((1e3 * net.size[0], 1e3 * net.size[1]), abs=0.02)
    assert {e.label for e in net.eyelets} <= {e.dxf.text for e in space.query("TEXT")}


def test_drawings_hold_no_date_and_no_random_number():
    design = design_of(5)
    net = module_net(design, PRINTER)
    assert svg_bytes(net, design) == svg_bytes(net, design)
    content = dxf_bytes(net, design)
    assert content == dxf_bytes(net, design)
    # ezdxf keeps kinds of objects in a set, whose order differs from process to process
    document = ezdxf.read(io.StringIO(content.decode()))
    declared = [c.dxf.name for c in document.classes]
    used = [name for name in declared if name in document.entitydb.dxf_types_in_use()]
    assert len(used) > 1
    assert used == sorted(used)
    lines = content.decode().splitlines()
    values = {line: lines[i + 2] for i, line in enumerate(lines) if line.startswith("$")}
    assert {values[k] for k in ("$TDCREATE", "$TDUPDATE", "$TDUCREATE", "$TDUUPDATE")} == {"2451545.0"}
    assert set(values["$VERSIONGUID"]) | set(values["$FINGERPRINTGUID"]) <= set("{}-0")
    assert "2000-01-01" in content.decode()
