import itertools

import numpy as np
import pytest

from engine.body import servo
from engine.fabrication.materials import load_materials
from engine.fabrication.parts import cams, drum, solids

MOTOR = load_materials().servo


def test_the_table_of_the_drum_is_what_its_cams_wind():
    lengths = cams.wound_lengths(cams.moment_arms())
    np.testing.assert_allclose(lengths, servo.DRUM_LENGTHS, atol=1e-6)
    np.testing.assert_allclose(lengths[[0, -1]], servo.TARGET_LENGTHS[[0, -1]], atol=1e-9)


def test_cams_come_nearer_to_the_published_table_than_a_round_drum():
    part = np.linspace(0.0, 1.0, 181)[:, None]
    even = servo.TARGET_LENGTHS[0] + part * (servo.TARGET_LENGTHS[-1] - servo.TARGET_LENGTHS[0])
    errors = 1e3 * np.abs(even - servo.TARGET_LENGTHS).max(axis=0)
    assert (drum.drum_errors() < 0.5 * errors).all()
    assert drum.drum_errors().max() < 1.3


@pytest.mark.parametrize("place", range(5))
def test_a_line_that_runs_past_an_outline_is_wound_as_the_table_says(place):
    """Turn the printed outline, and measure the line from its end round the cam to the fairlead."""
    k = cams.ORDER[place]
    shape, lug = drum.outlines(180.0)[place]
    points = np.array(shape.exterior.coords)[:-1]
    clockwise = points[::-1] if shape.exterior.is_ccw else points
    anchor = cams.LUG_AT * np.array([np.cos(lug), np.sin(lug)])
    clockwise = np.roll(clockwise, -int(np.linalg.norm(clockwise - anchor, axis=1).argmin()), axis=0)
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(clockwise, axis=0), axis=1)))
    towards = np.subtract(drum.FAIRLEAD, drum.SERVO_AXIS)
    commands = np.arange(0, 181, 20)
    used = []
    for turn in np.radians(-commands):
        c, s = np.cos(turn), np.sin(turn)
        free = np.array([[c, -s], [s, c]]) @ towards - clockwise
        # a taut line leaves where all of the cam lies to its right
        to_all = points - clockwise[:, None]
        left = (free[:, None, 0] * to_all[..., 1] - free[:, None, 1] * to_all[..., 0]).max(axis=1)
        leaves = int(left.argmin())
        used.append(along[leaves] + np.linalg.norm(free[leaves]))
    wound = 1e3 * (servo.DRUM_LENGTHS[0, k] - servo.DRUM_LENGTHS[commands, k])
    np.testing.assert_allclose(np.subtract(used, used[0]), wound, atol=0.15)


def test_the_discs_fit_on_each_other():
    discs = drum.drum_discs(MOTOR)
    assert len(discs) == 6
    placed = [d.translate((0.0, 0.0, k * (drum.FLANGE + drum.GROOVE))) for k, d in enumerate(discs)]
    for below, above in itertools.pairwise(placed):
        assert (below ^ above).volume() < 1e-6
        # a peg reaches into the next disc
        assert solids.extent(below)[2] > drum.FLANGE + drum.GROOVE + 0.3
    assert all(len(d.decompose()) == 1 for d in discs)
    assert len(drum.servo_drum(MOTOR).decompose()) == 1


def test_no_disc_hangs_in_the_air():
    # the cam lies on its flange: there are only round holes to bridge, for a peg and for the shaft
    for disc in drum.drum_discs(MOTOR):
        low, high = disc.slice(0.4), disc.slice(1.2)
        assert (high - low).offset(-1.2).area() == 0.0
        assert (high - low).area() < 14.0
