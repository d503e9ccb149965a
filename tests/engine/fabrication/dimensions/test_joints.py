import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.joints import joints, orientations
from engine.simulation.model import build_spec, module_placements
from engine.simulation.physics import Physics


@given(faces=st.lists(st.integers(1, 8), min_size=2, max_size=5).map(tuple))
@settings(max_examples=12, deadline=None)
def test_the_orientation_table_is_that_of_the_model(faces):
    body = Morphology(5, faces)
    model = build_spec(body, physics=Physics()).compile()
    table = joints(body)
    assert len(table) == len(faces) - 1
    placements = module_placements(body)
    for j in table:
        assert {a for a, _ in j.node_pairs} == set(t.FACES[j.face])
        assert {b for _, b in j.node_pairs} == set(t.FACES[j.next_face])
        for k, (a, b) in enumerate(j.node_pairs):
            # the model's link k ends on the rods of these nodes
            tendon = model.tendon(f"link{j.module}_{k}")
            first = model.tendon_adr[tendon.id]
            bodies = [model.body(model.site_bodyid[model.wrap_objid[first + i]]).name for i in (0, 1)]
            assert bodies == [f"m{j.module}_rod{a // 2}", f"m{j.module + 1}_rod{b // 2}"]
    before = None
    for o, (turn, centre) in zip(orientations(body), placements, strict=True):
        servo = turn.apply(t.NODES[[0, 1]].mean(axis=0))
        # looking along +x with z up, clockwise: the right hand is -y
        angle = math.radians(o.servo_angle)
        across = math.hypot(servo[1], servo[2])
        assert -servo[1] / across == pytest.approx(math.sin(angle), abs=1e-6)
        assert servo[2] / across == pytest.approx(math.cos(angle), abs=1e-6)
        assert o.centre == pytest.approx(centre)
        if before is None:
            assert o.turn is None
        else:
            assert (before + o.turn - o.servo_angle) % 360 == pytest.approx(0, abs=1e-5)
        before = o.servo_angle
