import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, Polygon

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import RING_RADIUS, design_cables
from engine.fabrication.materials import load_materials
from engine.fabrication.parts.net import EYELET_HOLE, LAYOUTS, lay_out, module_net, sheet_cuts
from engine.fabrication.parts.net_files import rest_lines
from engine.fabrication.parts.shapes import net_outline

MATERIALS = load_materials("tpu-85a")
PRINTER = MATERIALS.printer


def design_of(level, name="tpu-85a"):
    return design_cables(Morphology(level, (1, 2)), load_materials(name))[0]


@pytest.fixture(params=LAYOUTS)
def net(request):
    return lay_out(request.param, design_of(5).free, PRINTER)


def points(net):
    return np.array([e.position for e in net.eyelets])


@given(free=st.floats(0.02, 0.08), layout=st.sampled_from(sorted(LAYOUTS)))
@settings(max_examples=25, deadline=None)
def test_every_cable_lies_once_at_its_rest_length(free, layout):
    net = lay_out(layout, free, PRINTER)
    assert tuple(c.nodes for c in net.cables) == t.CABLES
    for cable, (a, b) in zip(net.cables, rest_lines(net), strict=True):
        assert tuple(net.eyelets[i].node for i in cable.eyelets) == cable.nodes
        assert math.dist(a, b) == pytest.approx(1e3 * free)
    assert points(net).min() == pytest.approx(RING_RADIUS)
    assert (points(net).max(axis=0) + RING_RADIUS).tolist() == pytest.approx(net.size)


def test_no_two_cables_overlap_and_no_cable_meets_a_foreign_eyelet(net):
    lines = [LineString([net.eyelets[i].position for i in c.eyelets]) for c in net.cables]
    for (c, a), (d, b) in itertools.combinations(zip(net.cables, lines, strict=True), 2):
        shared = set(c.eyelets) & set(d.eyelets)
        if shared:
            (eyelet,) = shared
            # away from their common ring they are apart
            ring = Point(net.eyelets[eyelet].position).buffer(RING_RADIUS)
            assert a.difference(ring).distance(b.difference(ring)) > 0.0005
        else:
            assert a.distance(b) > 0.003
    for i, e in enumerate(net.eyelets):
        for c, line in zip(net.cables, lines, strict=True):
            if i not in c.eyelets:
                assert line.distance(Point(e.position)) > RING_RADIUS + 0.001
    for a, b in itertools.combinations(points(net), 2):
        assert math.dist(a, b) > 2 * RING_RADIUS


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
    assert module_net(design, PRINTER).layout == "strip"
    short = dataclasses.replace(PRINTER, bed_x=0.13)
    assert module_net(design, short).layout == "block"
    small = dataclasses.replace(PRINTER, bed_x=0.05, bed_y=0.05)
    assert not module_net(design, small).fits


def test_nets_are_cut_from_as_many_sheets_as_there_are_thicknesses():
    body, latex = Morphology((1, 3, 1, 9), (1, 2, 3, 4)), load_materials("latex-sheet")
    cuts = sheet_cuts(body, latex)
    assert [(round(1e3 * c.thickness, 2), c.nets) for c in cuts] == [(0.25, 2), (0.5, 1), (1.3, 1)]
    assert cuts[0].size == module_net(design_of(1, "latex-sheet"), latex.printer).size
    assert sheet_cuts(body, MATERIALS) == ()
