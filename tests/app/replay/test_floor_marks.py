"""Flat marks as GLB files, read by another library."""

from __future__ import annotations

import io

import numpy as np
import trimesh

from app.replay.floor_marks import SIDES, disc_glb
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
