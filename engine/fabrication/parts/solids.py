"""Solid bodies in mm, manifold by construction, and the checks that a printed part must pass."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import manifold3d
import numpy as np
from manifold3d import CrossSection, Manifold
from shapely.geometry import MultiPolygon, Polygon
from shapely.ops import unary_union

SEGMENTS: Final = 48
"""Sides of a circle."""
_GRID: Final = 1e-4


def cylinder(radius: float, low: float, high: float, *, segments: int = SEGMENTS) -> Manifold:
    """Return a cylinder along z from ``low`` to ``high``, in mm."""
    return Manifold.cylinder(high - low, radius, radius, segments).translate((0.0, 0.0, low))


def box(low: Sequence[float], high: Sequence[float]) -> Manifold:
    """Return a box from its lowest to its highest corner, in mm."""
    size = tuple(float(b - a) for a, b in zip(low, high, strict=True))
    return Manifold.cube((size[0], size[1], size[2])).translate((float(low[0]), float(low[1]), float(low[2])))


def bar(
    a: Sequence[float] | np.ndarray, b: Sequence[float] | np.ndarray, radius: float, *, segments: int = 16
) -> Manifold:
    """Return a round bar from a point to another, in mm."""
    start, axis = np.asarray(a, float), np.subtract(b, a).astype(float)
    length = float(np.linalg.norm(axis))
    return placed(Manifold.cylinder(length, radius, radius, segments), frame_along(axis), start)


def frame_along(axis: np.ndarray, towards: np.ndarray | None = None) -> np.ndarray:
    """Return a (3, 3) rotation whose z column is the axis and whose x column leans to ``towards``."""
    z = axis / np.linalg.norm(axis)
    if towards is None:
        towards = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = towards - z * (towards @ z)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def turn_about_z(degrees: float) -> np.ndarray:
    """Return the (3, 3) rotation about z, counter-clockwise seen from above."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def placed(solid: Manifold, rotation: np.ndarray, position: np.ndarray) -> Manifold:
    """Return a solid turned and moved, in mm."""
    return solid.transform(np.column_stack([rotation, position]))


def extruded(shape: Polygon | MultiPolygon, height: float) -> Manifold:
    """Return a flat shape (mm) raised from 0 to a height."""
    return CrossSection(_rings(shape), manifold3d.FillRule.EvenOdd).extrude(height)


def _rings(shape: Polygon | MultiPolygon) -> list[np.ndarray]:
    polygons = shape.geoms if isinstance(shape, MultiPolygon) else [shape]
    return [np.array(ring.coords)[:-1] for p in polygons for ring in (p.exterior, *p.interiors)]


def triangles(solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Return (V, 3) vertices in mm and (T, 3) triangles of a closed surface, as files hold them.

    Vertices lie on a grid of 0.1 um, which single precision still tells apart on the largest bed. Details
    finer than ten times that are removed first, because coinciding vertices would tear the surface.
    """
    mesh = solid.simplify(10 * _GRID).to_mesh64()
    vertices = np.round(np.asarray(mesh.vert_properties, float)[:, :3] / _GRID) * _GRID + 0.0
    faces = np.asarray(mesh.tri_verts, np.int64)
    # a sliver narrower than the grid is a line by now
    vertices, index = np.unique(vertices.astype(np.float32), axis=0, return_inverse=True)
    faces = index.reshape(-1)[faces]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return vertices.astype(float), faces[whole]


def thin_area(solid: Manifold, wall: float) -> float:
    """Return the largest area in mm2, over slices about 1 mm apart, that is thinner than a wall.

    Thin is what a disc with the wall's thickness as diameter cannot reach (morphological opening of the
    slice). Corners and crescents that only the disc's roundness leaves over, less than a sixth of the wall
    deep, do not count.
    """
    low, high = solid.bounding_box()[2], solid.bounding_box()[5]
    slices = int(np.clip(high - low, 2, 24))
    worst = 0.0
    for k in range(slices):
        section = _flat(solid.slice(low + (high - low) * (k + 0.5) / slices))
        opened = _buffered(_buffered(section, -0.495 * wall), 0.495 * wall)
        left = _buffered(_buffered(section.difference(opened), -wall / 12), wall / 12)
        pieces = left.geoms if isinstance(left, MultiPolygon) else [left]
        worst = max(worst, *(piece.area for piece in pieces), 0.0)
    return worst


def _flat(section: CrossSection) -> Polygon | MultiPolygon:
    pieces = [piece.to_polygons() for piece in section.decompose()]
    return unary_union([Polygon(outer, holes) for outer, *holes in pieces])


def _buffered(shape: Polygon | MultiPolygon, distance: float) -> Polygon | MultiPolygon:
    return shape.buffer(distance, quad_segs=4)


def extent(solid: Manifold) -> tuple[float, float, float]:
    """Return the size in x, y and z, in mm."""
    b = solid.bounding_box()
    return b[3] - b[0], b[4] - b[1], b[5] - b[2]


def centroid(solid: Manifold) -> np.ndarray:
    """Return the (3,) centre of a solid's volume, in mm: tetrahedra from the origin to its triangles."""
    vertices, faces = triangles(solid)
    corners = vertices[faces]
    volumes = np.linalg.det(corners) / 6
    return volumes @ corners.sum(axis=1) / (4 * volumes.sum())
