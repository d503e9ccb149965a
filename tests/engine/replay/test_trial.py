from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.errors import InvalidData
from engine.replay.trial import FARTHEST, NEAREST, Aim

aims = st.builds(Aim, st.integers(-179, 180), st.integers(NEAREST, FARTHEST))


@given(aims)
def test_an_aim_is_found_again_from_where_it_points(aim: Aim) -> None:
    assert Aim.at(aim.offset) == aim
    assert np.hypot(*aim.offset) == pytest.approx(aim.distance / 100)


def test_a_hand_case() -> None:
    assert Aim.at(np.array([0.3, 0.3])) == Aim(45, 42)
    assert Aim.at(np.array([0.0, -0.5])) == Aim(-90, 50)
    assert Aim(-90, 50).offset == pytest.approx([0.0, -0.5])
    assert Aim(-90, 50).name == "90° right, 50 cm"
    assert Aim(0, 7).name == "straight ahead, 7 cm"


@given(st.floats(-math.pi, math.pi), st.floats(0.06, 2.9))
def test_it_is_as_near_to_the_point_as_whole_numbers_are(angle: float, distance: float) -> None:
    point = distance * np.array([math.cos(angle), math.sin(angle)])
    off = np.linalg.norm(Aim.at(point).offset - point)
    assert off <= math.hypot(0.005, math.radians(0.5) * distance) * 1.01


@pytest.mark.parametrize(
    ("bearing", "distance", "reason"),
    [(181, 50, "bearing"), (-181, 50, "bearing"), (0, 4, "5 to 300 cm"), (0, 301, "5 to 300 cm")],
)
def test_what_is_out_of_reach_is_refused(bearing: int, distance: int, reason: str) -> None:
    with pytest.raises(InvalidData, match=reason):
        Aim(bearing, distance)
