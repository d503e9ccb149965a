import io

import numpy as np
import pytest
import trimesh

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.dimensions.feet import Foot
from engine.fabrication.materials import load_materials
from engine.fabrication.parts import assembly, shapes
from engine.fabrication.parts.assembly import robot_glb

BODY = Morphology((3, 9), (1, 2))
MATERIALS = load_materials("tpu-85a")


def test_the_scene_is_the_robot_in_metres():
    scene = trimesh.load(io.BytesIO(robot_glb(BODY, MATERIALS)), file_type="glb")
    names = set(scene.graph.nodes_geometry)
    assert {f"module{i}_rod{r}" for i in (1, 2) for r in range(6)} <= names
    assert {f"module{i}_cable_{a}_{b}" for i in (1, 2) for a, b in t.CABLES} <= names
    assert {"module1_servo", "module2_drum", "link1_3"} <= names
    assert 0.12 < max(scene.extents) < 0.2
    # a rod reaches from node to node but for its caps' tips
    matrix, geometry = scene.graph["module2_rod3"]
    rod = scene.geometry[geometry].copy().apply_transform(matrix)
    longest = np.linalg.norm(rod.vertices[:, None] - rod.vertices, axis=-1).max()
    assert longest == pytest.approx(0.079, abs=2e-4)
    # y is up, as glTF has it; in the simulation z is
    (_, _, points), *_ = assembly._rod_frames(BODY)
    for r, (a, _) in enumerate(t.RODS):
        x, y, z = scene.graph[f"module1_rod{r}"][0][:3, 3]
        assert 1e3 * np.array([x, -z, y]) == pytest.approx(points[a], abs=1e-3)
    # joined nodes are near each other
    for k in (1, 2, 3):
        matrix, _ = scene.graph[f"link1_{k}"]
        # the matrix stretches a cylinder of 1 mm
        assert 1e-3 * np.linalg.norm(matrix[:3, 2]) < 0.004


def test_feet_sit_on_their_rod_ends_and_point_where_they_slide():
    worn = Foot(number=1, module=1, node=6, lean=60, clock=130, share=1.0, forward=0.1, backward=0.0, off=0.0)
    scene = trimesh.load(io.BytesIO(robot_glb(BODY, MATERIALS, (worn,))), file_type="glb")
    assert [n for n in scene.graph.nodes_geometry if "foot" in n] == ["module2_foot_6"]
    cap, foot = (scene.graph[f"module2_{kind}_6"][0] for kind in ("cap", "foot"))
    # thick nets lie on a longer post, which lifts the foot
    higher = 1e-3 * (shapes.post_top(design_cables(BODY, MATERIALS)[1]) - shapes.POST_TOP)
    assert foot[:3, 3] - cap[:3, 3] == pytest.approx(higher * cap[:3, 2], abs=1e-9)
    # its notch lies towards x of its own, the slide above that by 90 degrees less the lean
    own = np.array([np.sin(np.radians(60)), 0.0, np.cos(np.radians(60))])
    assert foot[:3, :3] @ own == pytest.approx(cap[:3, :3] @ worn.direction, abs=1e-6)
