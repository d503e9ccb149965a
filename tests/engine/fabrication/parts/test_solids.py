import pytest

from engine.fabrication.parts import solids


def test_thin_walls_are_measured():
    plate = solids.box((0, 0, 0), (10, 10, 2)) - solids.box((1, 1, -1), (9, 4.2, 3))
    plate = plate - solids.box((1, 4.7, -1), (9, 9, 3))
    # a bar of 8 x 0.5 mm is left standing between the two windows
    assert solids.thin_area(plate, 0.4) < 0.02
    assert solids.thin_area(plate, 0.8) == pytest.approx(8 * 0.5, rel=0.15)
