"""Where a camera is put so that everything is seen."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from viz.robot.framing import NEAREST, Window, eye_showing

BOX = np.array(list(itertools.product((-1.0, 1.0), (-1.0, 1.0), (0.0, 1.0))))

lengths = st.floats(-2.0, 2.0)
points = st.lists(st.tuples(lengths, lengths, st.floats(0.0, 0.5)), min_size=1, max_size=12).map(np.array)
directions = st.tuples(lengths, lengths, st.floats(0.2, 2.0)).map(np.array)
windows = st.builds(
    Window,
    fov=st.floats(0.3, 2.0),
    width=st.floats(200, 2000),
    height=st.floats(400, 1200),
    top=st.floats(0, 100),
    bottom=st.floats(0, 250),
    sides=st.floats(0, 60),
    left=st.floats(0, 40),
)


def seen(eye: np.ndarray, focus: np.ndarray, window: Window, shown: np.ndarray) -> np.ndarray:
    """Return the (n, 2) pixels, from the upper left, of (n, 3) points for a camera with z up."""
    ahead = (focus - eye) / np.linalg.norm(focus - eye)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    x, y, z = np.stack([right, np.cross(right, ahead), ahead]) @ (shown - eye).T
    assert (z > 0.0).all()
    scale = window.height / 2 / math.tan(window.fov / 2)
    return np.stack([window.width / 2 + scale * x / z, window.height / 2 - scale * y / z], axis=1)


def roomy(shown: np.ndarray) -> np.ndarray:
    """Return points and some around them, so that the eye lies in none of them."""
    return (shown[:, None] + 0.1 * BOX).reshape(-1, 3)


@given(points, directions, windows)
def test_everything_is_seen_in_the_free_part_and_no_farther_away_than_it_need_be(
    shown: np.ndarray, towards: np.ndarray, window: Window
) -> None:
    shown = roomy(shown)
    *_, low, high = window.bounds
    assume(np.arctan2(towards[2], np.hypot(*towards[:2])) - np.arctan((low + high) / 2) > 0.1)
    eye, focus = eye_showing(shown, towards, window)
    assert focus[2] == pytest.approx(0.0, abs=1e-9)
    x, y = seen(eye, focus, window, shown).T
    left, right = x.min() - window.sides - window.left, window.width - window.sides - x.max()
    above, below = y.min() - window.top, window.height - window.bottom - y.max()
    assert min(left, right, above, below) > -1e-3
    # two opposite edges are touched, or the eye is as near as it may be
    near = ((shown - eye) @ (focus - eye)).min() / np.linalg.norm(focus - eye)
    size = np.linalg.norm(np.ptp(shown, axis=0))
    assert max(left, right) < 1e-3 or max(above, below) < 1e-3 or near == pytest.approx(NEAREST * size)
    assert near > (NEAREST - 1e-6) * size
    # what room there is lies on either side alike
    assert left == pytest.approx(right, abs=1e-3)
    assert above == pytest.approx(below, abs=1e-3)


@given(points, directions, windows)
def test_it_looks_from_the_direction_that_was_asked_for(
    shown: np.ndarray, towards: np.ndarray, window: Window
) -> None:
    eye, focus = eye_showing(roomy(shown), towards, window)
    assume(eye[2] > 0.01)
    expected = towards / np.linalg.norm(towards)
    out = (eye - focus) / np.linalg.norm(eye - focus)
    np.testing.assert_allclose(out, expected, atol=0.05 if expected[2] > 0.999 else 1e-6)


def test_a_window_that_is_all_covered_still_gives_a_view() -> None:
    window = Window(fov=1.3, width=300, height=400, top=250, bottom=350, sides=200)
    eye, focus = eye_showing(roomy(np.zeros((1, 3))), np.array([-1.0, -1.0, 1.0]), window)
    assert np.isfinite([eye, focus]).all()
    assert eye[2] > 0.0
