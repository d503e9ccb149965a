"""Which part of a robot a pointer means."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.pointing.picking import RobotPart, module_at, part_at
from app.replay.scene_camera import Ray
from engine.body import module as t
from engine.body.morphology import Morphology
from engine.replay.recording import ReplayFrame
from engine.simulation.model import module_placements
from viz.robot.geometry import RobotGeometry

BODY = Morphology((4, 9, 2), (1, 2, 5))
POSE = np.array(
    [
        [[*(centre + turn.apply(m)), *turn.as_quat(scalar_first=True)] for m in t.ROD_MIDDLES]
        for turn, centre in module_placements(BODY)
    ]
)
DRAWING = RobotGeometry(BODY, 2).draw(POSE, np.full((3, 5), 0.03))
EYE = np.array([0.3, -1.0, 0.6])


def towards(point):
    way = np.asarray(point, dtype=float) - EYE
    return Ray(EYE, way / np.linalg.norm(way), 0.001)


@given(st.sampled_from(["rod", "cable"]), st.integers(0, 2), st.integers(0, 28), st.floats(0.3, 0.7))
def test_what_is_pointed_at_exactly_lies_under_the_pointer(kind, module, index, part):
    wanted = RobotPart(kind, module, index % (len(t.RODS) if kind == "rod" else t.N_CABLES))
    a, b = wanted.ends(DRAWING).astype(float)
    found = part_at(towards(a + part * (b - a)), DRAWING)
    assert found is not None
    # it, or what lies in front of it
    p, q = found.ends(DRAWING).astype(float)
    samples = p + np.linspace(0.0, 1.0, 400)[:, None] * (q - p)
    ray = towards(a + part * (b - a))
    depth = (samples - EYE) @ ray.direction
    off = np.linalg.norm(samples - EYE - depth[:, None] * ray.direction, axis=1)
    assert (off / depth).min() < 0.008
    assert found == wanted or depth.min() <= np.linalg.norm(a + part * (b - a) - EYE) + 0.003


def test_a_module_is_meant_between_its_rods_and_the_nearest_of_two_in_a_row():
    for m, (_, centre) in enumerate(module_placements(BODY)):
        assert module_at(towards(centre), DRAWING) == m
    along = Ray(np.array([-1.0, 0.0, DRAWING.centres[0, 2]]), np.array([1.0, 0.0, 0.0]), 0.001)
    assert module_at(along, DRAWING) == 0
    backwards = dataclasses.replace(along, direction=-along.direction)
    assert module_at(backwards, DRAWING) is None
    assert part_at(backwards, DRAWING) is None
    assert module_at(towards([0.0, 1.0, 0.0]), DRAWING) is None
    assert part_at(towards([0.0, 1.0, 0.0]), DRAWING) is None


def test_parts_are_called_as_on_the_build_sheet_and_say_what_they_bear():
    frame = ReplayFrame(0.0, POSE, np.full((3, 5), 1.0), np.zeros(2), lambda: np.zeros((0, 3)))
    cable, line, rod = RobotPart("cable", 1, 0), RobotPart("cable", 0, 24), RobotPart("rod", 2, 3)
    assert cable.name == "cable 0–4 of module 2"
    assert line.name == f"internal cable to node {t.SERVO_NODES[0]} of module 1"
    assert rod.name == "rod 3 of module 3"
    assert RobotPart("rod", 0, t.SERVO_ROD).name == "servo rod of module 1"
    # as built every passive cable is as long as any other
    length = np.linalg.norm(np.diff(cable.ends(DRAWING), axis=0))
    pull = t.CABLE_STIFFNESS * 0.9 * (length - t.CABLE_REST_LENGTH)
    assert cable.force(frame, BODY) == f"{pull:.2f} N"
    assert line.force(frame, BODY) == "slack"
    assert rod.force(frame, BODY).startswith("pressed with ")
    assert float(rod.force(frame, BODY).split()[2]) == pytest.approx(
        float(RobotPart("rod", 1, 3).force(frame, BODY).split()[2]) * 2 / 9, abs=0.01
    )
