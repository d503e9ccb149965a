"""What is drawn besides a robot's body."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np

from app.replay.overlays import OverlayLayer, Overlays
from engine.body.morphology import Morphology
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics

BODY = Morphology(5, (1, 2))
FACING = np.eye(3)[:2]


def test_friction_is_shown_with_contacts_where_it_is_known() -> None:
    pose = build_robot(BODY, Physics()).model.qpos0.reshape(2, 6, 7)
    pushed = np.zeros((2, 12, 3), np.float16)
    pushed[0, 3], pushed[1, 4] = (0.05, 0.0, 0.2), (0.0, 0.05, 0.2)
    frames = [
        SimpleNamespace(pose=pose, forces=forces, contacts=np.zeros((0, 3)), head=np.zeros(2))
        for forces in (pushed, None, np.zeros_like(pushed))
    ]
    drawn: dict[str, Any] = {}

    def add(name: str, *_arrays: object, visible: bool = True, **_options: object) -> SimpleNamespace:
        drawn[name] = SimpleNamespace(visible=visible, points=None, remove=lambda: drawn.pop(name))
        return drawn[name]

    scene, replay = MagicMock(), MagicMock()
    scene.add_line_segments = add
    replay.frames, replay.morphology, replay.head.module = frames, BODY, 0
    replay.start_time, replay.frame_period = -0.04, 0.04
    layer, centres = OverlayLayer(scene, replay), np.zeros((2, 3))
    plain = Overlays(numbers=False)
    layer.show(0, centres, plain, FACING)
    assert drawn["/friction"].visible
    assert drawn["/friction"].points.shape == (2 * 3, 2, 3)
    for index, overlays in ((1, plain), (2, plain), (0, Overlays(numbers=False, contacts=False))):
        layer.show(index, centres, overlays, FACING)
        assert not drawn["/friction"].visible
        layer.show(0, centres, plain, FACING)
        assert drawn["/friction"].visible
    layer.remove()
    assert drawn == {}
