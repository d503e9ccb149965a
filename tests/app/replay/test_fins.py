"""Feet in the scene: they point along the chain, module by module."""

from __future__ import annotations

import numpy as np
import pytest

from app.replay.shapes import Fins, headings
from engine.body.morphology import Morphology
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics
from viz.robot.geometry import Drawing, RobotGeometry

CORNER = np.array([[0.0, 0.0, 0.04], [0.1, 0.0, 0.05], [0.1, 0.1, 0.03]])
"""A chain that runs along x and then along y."""


def test_they_point_along_the_chain() -> None:
    quarter = np.pi / 4
    np.testing.assert_allclose(headings(CORNER, 1.0), [0.0, quarter, 2 * quarter], atol=1e-12)
    turned = headings(CORNER, -1.0) - headings(CORNER, 1.0)
    np.testing.assert_allclose(np.abs(turned), np.pi)


class Scene:
    """Stands for a viser scene: remembers what was added."""

    def add_batched_meshes_simple(self, name: str, *_: object, **arrays: np.ndarray) -> Scene:
        self.name, self.arrays = name, arrays
        return self

    def remove(self) -> None:
        self.name = ""


def drawing_of(body: Morphology) -> Drawing:
    pose = build_robot(body, Physics()).model.qpos0.reshape(body.n_modules, 6, 7)
    return RobotGeometry(body, 0).draw(pose, np.ones((body.n_modules, 5)))


@pytest.mark.parametrize(("feet", "heading"), [("end", 0.0), ("start", np.pi)])
def test_every_node_has_one(feet: str, heading: float) -> None:
    body = Morphology(5, (1, 2, 3))
    scene, drawing = Scene(), drawing_of(body)
    fins = Fins(scene, "/robot/feet", feet, drawing)  # type: ignore[arg-type]
    turns = scene.arrays["batched_wxyzs"]
    assert scene.arrays["batched_positions"].shape == (36, 3)
    assert turns.shape == (36, 4)
    # a robot as built lies along x
    turned = 2 * np.arctan2(turns[:, 3], turns[:, 0])
    np.testing.assert_allclose(np.abs(turned), heading, atol=1e-5)
    ends = drawing.rods.reshape(-1, 3)
    assert {tuple(p) for p in scene.arrays["batched_positions"].tolist()} == {tuple(p) for p in ends.tolist()}
    fins.remove()
    assert scene.name == ""
