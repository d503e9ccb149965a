"""The shape of a foot: its scales let it slide one way, and it prints without support."""

import numpy as np
import pytest
from shapely.geometry import LineString, MultiPolygon, Polygon
from shapely.ops import unary_union

from engine.fabrication.parts import solids
from engine.fabrication.parts.foot import RADIUS, SCALE_HEIGHT, SCALES, foot, sled
from engine.fabrication.parts.shapes import FOOT_LIP, HEAD, LINK_THICKNESS, POST_TOP, neck_height

LAYER = 0.1
LEANS = range(0, 181, 30)


def section(solid, height):
    pieces = [piece.to_polygons() for piece in solid.slice(height).decompose()]
    return unary_union([Polygon(outer, holes) for outer, *holes in pieces])


@pytest.mark.parametrize("lean", LEANS)
def test_scales_are_steep_backward_and_gentle_forward(lean):
    vertices, faces = solids.triangles(foot(lean))
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a) / 2
    areas = np.linalg.norm(normals, axis=1)
    middle = np.array([0.0, 0.0, POST_TOP + neck_height(footed=True) + HEAD[1] / 2])
    outside = np.linalg.norm((a + b + c) / 3 - middle, axis=1) > RADIUS - SCALE_HEIGHT + 0.05
    ahead = np.array([np.sin(np.radians(lean)), 0.0, np.cos(np.radians(lean))])
    along = (normals @ ahead) / np.maximum(areas, 1e-12)
    backward, forward = (areas[outside & (sign * along > 0.98)].sum() for sign in (-1, 1))
    # nearly a whole ring for each scale: what the rim cuts off is missing
    assert backward > 0.4 * SCALES * 2 * np.pi * (RADIUS - SCALE_HEIGHT) * 0.5 * SCALE_HEIGHT
    assert forward < 0.05 * backward


@pytest.mark.parametrize("lean", LEANS)
def test_every_layer_lies_on_the_one_below(lean):
    body = foot(lean)
    low, high = body.bounding_box()[2], body.bounding_box()[5]
    before = section(body, low + LAYER / 2)
    for height in np.arange(low + 1.5 * LAYER, high, LAYER):
        layer = section(body, height)
        # scales lean out by little more than a nozzle's width
        assert layer.difference(before.convex_hull.buffer(0.65)).area < 1e-3, height
        # roofs over the knob and the notch are held on both sides, and are no wider than the knob
        air = layer.difference(before.buffer(0.65)).buffer(-0.05).buffer(0.05)
        for piece in air.geoms if isinstance(air, MultiPolygon) else [air]:
            assert piece.is_empty or max(np.ptp(np.array(piece.bounds).reshape(2, 2), axis=0)) < 2 * HEAD[0]
        before = layer


@pytest.mark.parametrize("lean", LEANS)
def test_the_notch_is_seen_from_outside(lean):
    """In the outline from above, towards x, and nowhere else as deep."""
    body = foot(lean)
    low, high = body.bounding_box()[2], body.bounding_box()[5]
    outline = unary_union([section(body, height) for height in np.arange(low + 0.1, high, 0.2)])
    reach = {a: reach_of(outline, a) for a in range(0, 360, 15)}
    assert reach[0] < RADIUS - SCALE_HEIGHT - 0.2
    assert all(reach[a] > reach[0] + 0.3 for a in reach if a not in (0, 15, 345))


def reach_of(outline, degrees):
    """Return how far an outline reaches from the origin in a direction."""
    way = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    inside = outline.intersection(LineString([(0, 0), 9 * way]))
    return max(point @ way for line in getattr(inside, "geoms", [inside]) for point in np.array(line.coords))


def test_foot_and_link_share_the_neck():
    rim = foot(90).bounding_box()[2]
    assert rim - POST_TOP >= LINK_THICKNESS
    assert POST_TOP + neck_height(footed=True) - rim == pytest.approx(FOOT_LIP)


def test_the_sled_stands_on_three_feet():
    body = sled()
    assert len(section(body, body.bounding_box()[5] - 0.1).geoms) == 3
