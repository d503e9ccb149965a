"""The drawings of modules that a browser puts together."""

from __future__ import annotations

import json
import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.simulation.model import module_placements
from viz.robot import body_drawing
from viz.robot.skeleton import Skeleton

DATA = json.loads(re.search(r"const data = (\{.*\});", body_drawing.script())[1])  # type: ignore[index]


def segments(path: str) -> np.ndarray:
    return np.array(re.findall(r"-?[\d.]+", path), dtype=float).reshape(-1, 2, 2)


@given(st.lists(st.integers(1, 8), min_size=2, max_size=10))
def test_the_modules_stand_where_the_body_has_them(faces: list[int]) -> None:
    body = Morphology(stiffness_level=5, faces=tuple(faces))
    assert body_drawing.code(body) == "".join(map(str, faces))
    built = Skeleton.placed(module_placements(body))
    drawn = (
        np.stack([built.rods @ body_drawing.RIGHT, -(built.rods @ body_drawing.UP)], -1) / body_drawing.UNIT
    )
    drawn -= drawn[0].mean(axis=(0, 1))
    for i, face in enumerate(faces):
        module = DATA["modules"][i % 2][face - 1]
        rods = np.insert(segments(module["rods"]), t.SERVO_ROD, segments(module["servo"]), axis=0)
        middle = rods.mean(axis=(0, 1))
        assert np.allclose(rods - middle + np.multiply(i, DATA["step"]), drawn[i], atol=0.2)
        assert len(segments(module["cables"])) == len(t.CABLES)


@given(st.lists(st.integers(1, 8), min_size=2, max_size=10), st.data())
def test_the_drawing_of_the_app_is_made_of_the_same_modules(faces: list[int], data: st.DataObject) -> None:
    head = data.draw(st.integers(0, len(faces) - 1))
    drawn = body_drawing.svg(Morphology(stiffness_level=5, faces=tuple(faces)), head)
    uses = re.findall(
        r'<use href="#([\w-]+)" x="([-\d.]+)" y="([-\d.]+)" style="[^"]*--ta-rod:([^"]+)"', drawn
    )
    assert [f"ta-module-{i % 2}-{face}" for i, face in enumerate(faces)] == [use[0] for use in uses]
    for i, (name, x, y, color) in enumerate(uses):
        assert np.allclose([float(x), float(y)], np.multiply(i, DATA["step"]), atol=0.2)
        assert (color == DATA["colors"]["head"]) == (i == head)
        odd, face = map(int, name.split("-")[2:])
        symbol = re.search(rf'<symbol id="{name}"[^>]*>(.*?)</symbol>', body_drawing.symbols())
        assert symbol is not None
        assert all(DATA["modules"][odd][face - 1][part] in symbol[1] for part in ("rods", "servo", "cables"))
    assert f"margin = {body_drawing.MARGIN}" in body_drawing.script()
