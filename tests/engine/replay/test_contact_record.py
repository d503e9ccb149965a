"""What rod ends did on the ground, of robots that are moved by hand."""

import numpy as np
import pytest

from engine.body import module as t
from engine.body.kinematics import points_on
from engine.body.morphology import Morphology
from engine.replay.contact_record import contact_record
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics

BODY = Morphology(5, (1, 2, 3))
"""As built it lies along x."""
STEP = 0.001


@pytest.fixture(scope="module")
def pose():
    """The robot as built, set down so that its lowest rod end is pressed into the ground a little."""
    flat = build_robot(BODY, Physics()).model.qpos0.reshape(BODY.n_modules, 6, 7)
    lowest = nodes_of(flat)[..., 2].min()
    return flat - np.array([0.0, 0.0, lowest - 0.0002, 0.0, 0.0, 0.0, 0.0])


def nodes_of(pose):
    rods = np.arange(12) // 2
    return points_on(pose, rods, t.NODES - t.ROD_MIDDLES[rods])


def moved(pose, *steps):
    """Return the poses of a robot that goes by each step (3,) from frame to frame."""
    way = np.cumsum([np.zeros(3), *steps], axis=0)
    return pose + np.pad(way, ((0, 0), (0, 4)))[:, None, None]


def test_sliding_is_told_by_the_way_that_feet_point(pose):
    ahead, back, aside = np.diag([STEP, STEP, STEP])[[0, 0, 1]] * np.array([[1], [-1], [-1]])
    trial = moved(pose, ahead, ahead, ahead, back, aside, aside)
    record = contact_record([trial], "end")
    down = record.share > 0
    assert down.any()
    assert not down.all()
    assert record.share[down] == pytest.approx(1.0)
    assert (record.resting == down).all()
    assert record.forward[down] == pytest.approx(3 * STEP)
    assert record.backward[down] == pytest.approx(STEP)
    assert record.across[down] == pytest.approx(2 * STEP)
    assert not record.forward[~down].any()
    turned = contact_record([trial], "start")
    assert turned.forward[down] == pytest.approx(STEP)
    assert turned.facing == pytest.approx(-record.facing)


def test_trials_are_averaged_and_what_is_lifted_does_not_slide(pose):
    up, ahead = np.array([0.0, 0.0, 0.1]), np.array([STEP, 0.0, 0.0])
    flies = moved(pose, up, ahead, ahead)
    record = contact_record([moved(pose, ahead, ahead, ahead), flies], "end")
    down = record.share > 0
    assert record.share[down] == pytest.approx(5 / 8)
    assert record.forward[down] == pytest.approx(3 * STEP / 2)


def test_facing_is_the_way_ahead_seen_from_the_rod_end(pose):
    record = contact_record([moved(pose)], "end")
    nodes = nodes_of(pose)
    for module, node in np.argwhere(record.resting):
        z = nodes[module, node] - nodes[module, node ^ 1]
        z = z / np.linalg.norm(z)
        facing = record.facing[module, node]
        # the robot lies along x, and the angle to the rod needs no frame
        assert facing[2] == pytest.approx(z[0], abs=1e-3)
        assert np.linalg.norm(facing) == pytest.approx(1.0)
        inwards = nodes[module].mean(axis=0) - nodes[module, [node, node ^ 1]].mean(axis=0)
        x = inwards - z * (inwards @ z)
        assert facing[0] == pytest.approx(x[0] / np.linalg.norm(x), abs=2e-3)
