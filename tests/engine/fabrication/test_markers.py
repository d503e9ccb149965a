"""The printed tags are those that OpenCV looks for."""

import numpy as np
import pytest

from engine.fabrication.markers import HEAD, N_CELLS, TARGET


@pytest.mark.parametrize("marker", [HEAD, TARGET])
def test_a_tag_is_the_familys(marker):
    cv2 = pytest.importorskip("cv2")
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    picture = cv2.aruco.generateImageMarker(family, marker.number, N_CELLS, borderBits=1)
    np.testing.assert_array_equal(marker.black(), picture == 0)


@pytest.mark.parametrize("marker", [HEAD, TARGET])
def test_a_tag_looks_different_from_every_side_and_has_a_black_rim(marker):
    black = marker.black()
    assert black.shape == (N_CELLS, N_CELLS)
    rim = np.ones_like(black)
    rim[1:-1, 1:-1] = False
    assert black[rim].all()
    assert len({np.rot90(black, k).tobytes() for k in range(4)}) == 4
