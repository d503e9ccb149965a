"""Turns as quaternions and as matrices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from engine.body.kinematics import points_on, rotation_rows


@pytest.fixture
def turns() -> Rotation:
    return Rotation.random(6, random_state=np.random.default_rng(1))


def test_rows_are_those_of_the_rotation_matrices(turns: Rotation) -> None:
    rows = np.array(rotation_rows(turns.as_quat(scalar_first=True)))
    np.testing.assert_allclose(np.moveaxis(rows, -1, 0), turns.as_matrix(), atol=1e-12)


@pytest.mark.parametrize(("kind", "exact"), [(np.float64, 1e-12), (np.float32, 1e-6)])
def test_points_move_with_their_bodies(turns: Rotation, kind: type, exact: float) -> None:
    rng = np.random.default_rng(2)
    positions, body, places = rng.normal(size=(6, 3)), np.array([0, 5, 2, 2]), rng.normal(size=(4, 3))
    pose = np.concatenate([positions, turns.as_quat(scalar_first=True)], axis=1).astype(kind)
    found = points_on(np.stack([pose, pose]), body, places.astype(kind))
    assert found.dtype == kind
    np.testing.assert_allclose(found[1], positions[body] + turns[body].apply(places), atol=exact)
    np.testing.assert_array_equal(found[0], found[1])
