"""Flat marks as GLB files, read by another library."""

from __future__ import annotations

import io
import json

import numpy as np
import trimesh

from app.replay import stage
from app.replay.shapes import SIDES, disc_glb
from app.replay.target_mark import DASH, dashes


def test_a_disc_is_flat_round_and_fades_to_its_edge() -> None:
    glb = disc_glb(((0, 0, 0, 200), (0, 0, 0, 100), (0, 0, 0, 0)))
    scene = trimesh.load(io.BytesIO(glb), file_type="glb")
    (mesh,) = scene.geometry.values()
    radius = np.linalg.norm(mesh.vertices[:, :2], axis=1)
    assert np.allclose(mesh.vertices[:, 2], 0.0)
    assert radius.max() == np.float32(1.0)
    # a polygon of so many sides fills the circle almost
    assert mesh.area > 0.99 * np.pi * (SIDES / np.pi) * np.sin(np.pi / SIDES) * np.cos(np.pi / SIDES)


def test_the_line_to_a_target_is_eaten_up_from_the_heads_end() -> None:
    target = np.array([0.3, 0.4])
    far, near = dashes(np.zeros(2), target), dashes(np.array([0.15, 0.2]), target)
    assert far.shape[1:] == near.shape[1:] == (2, 3)
    assert len(far) == np.ceil(0.5 / DASH)
    assert np.allclose(near, far[: len(near)], atol=1e-6) or np.allclose(near[:-1], far[: len(near) - 1])
    assert np.linalg.norm(far[..., :2] - target, axis=-1).max() <= 0.5 + 1e-6
    assert len(dashes(target, target)) == 1


def test_the_floor_has_a_line_every_25_cm_and_fades_to_its_horizon() -> None:
    glb = stage._lines_glb()
    (mesh,) = trimesh.load(io.BytesIO(glb), file_type="glb").geometry.values()
    assert np.linalg.norm(mesh.vertices[:, :2], axis=1).max() < stage.HORIZON + 0.05
    # where the lines of one direction cross a ray along the other one
    crossing = np.linspace(0.9, 1.1, 2001)
    ray = np.column_stack([crossing, np.full(2001, 0.1)])
    triangles = mesh.triangles[:, :, :2]
    hit = np.array([_inside(triangles, point).any() for point in ray])
    middles = crossing[hit]
    assert middles.size
    assert np.abs(middles - 1.0).max() < stage.LINE_WIDTH * (1 + stage.LINE_GROWTH)
    document = json.loads(glb[20 : 20 + int.from_bytes(glb[12:16], "little")])
    colors = np.frombuffer(glb[28 + int.from_bytes(glb[12:16], "little") :], dtype=np.uint8)
    view = document["bufferViews"][1]
    cover = colors[view["byteOffset"] : view["byteOffset"] + view["byteLength"]].reshape(-1, 4)[:, 3]
    assert cover.max() == stage.STRONG
    assert cover.min() == 0


def _inside(triangles: np.ndarray, point: np.ndarray) -> np.ndarray:
    sides = np.roll(triangles, -1, axis=1) - triangles
    towards = point - triangles
    turns = np.sign(sides[..., 0] * towards[..., 1] - sides[..., 1] * towards[..., 0])
    return np.abs(turns.sum(axis=1)) == 3
