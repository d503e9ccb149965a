from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.replay.ground_picker import ground_point
from engine.errors import InvalidData

near = st.floats(-5, 5)


@given(near, near, st.floats(0.1, 5), near, near)
def test_a_ray_towards_a_point_of_the_ground_meets_it(
    x: float, y: float, z: float, px: float, py: float
) -> None:
    origin, point = np.array([x, y, z]), np.array([px, py, 0.0])
    found = ground_point(tuple(origin), tuple((point - origin) / np.linalg.norm(point - origin)))
    assert found == pytest.approx(point[:2], abs=1e-6)


@pytest.mark.parametrize(
    "ray",
    [
        ((0, 0, 1), (0, 1, 0)),
        ((0, 0, 1), (0, 1, 0.2)),
        ((0, 0, 1), (0, 0, math.nan)),
        ((0, 0, math.inf), (0, 0, -1)),
        ((0, 0, 1), (0, 0)),
        ((0, 0, "high"), (0, 0, -1)),
        (None, None),
    ],
)
def test_what_is_not_the_ground_is_refused(ray: Any) -> None:
    with pytest.raises(InvalidData):
        ground_point(*ray)
