"""Forces of the ground on rod ends, as replays show them: they carry the robot and obey Coulomb."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from engine.body import module as t
from engine.body.kinematics import points_on
from engine.body.morphology import Morphology
from engine.simulation.kernel.loop.trials import Trials
from tests.support.kernel_driven import MORPHOLOGY, PHYSICS, driven, trials, trials_of

RECORD = frozenset({"poses", "forces"})
UPDATES = 150
RODS = np.arange(len(t.NODES)) // 2
WEIGHT = 9.81 * 2 * (t.SERVO_ROD_MASS + 5 * t.ROD_MASS)


def heights(poses: np.ndarray) -> np.ndarray:
    """Return the (updates, T, modules, 12) heights of the lowest points of rod ends, in m."""
    ends = (1 - 2 * t.ROD_END_CUT / t.ROD_LENGTH) * (t.NODES - t.ROD_MIDDLES[RODS])
    return points_on(poses, RODS, ends)[..., 2] - t.ROD_RADIUS


@pytest.mark.parametrize("feet", ["none", "end"])
def test_the_ground_carries_the_robot_where_it_touches(feet: str) -> None:
    robot = driven(morphology=dataclasses.replace(MORPHOLOGY, feet=feet))
    motion = trials(robot, which=range(2)).run(UPDATES, RECORD)
    assert motion.forces.shape == (UPDATES, 2, 2, 12, 3)
    level, upright = np.linalg.norm(motion.forces[..., :2], axis=-1), motion.forces[..., 2]
    assert upright.sum(axis=(2, 3)).mean() == pytest.approx(WEIGHT, rel=0.1)
    assert upright.min() >= 0.0
    most = PHYSICS.friction if feet == "none" else PHYSICS.feet_backward
    assert (level <= 1.01 * most * upright + 1e-6).all()
    assert level.max() > 0.01
    # forces are those of the last step, poses those after it
    assert np.abs(heights(motion.poses)[upright > 0.02]).max() < 0.001


def test_each_robot_of_a_vector_has_its_own_ends() -> None:
    one, other = driven(), driven(morphology=Morphology((2, 2), (8, 1)))

    def forces(of: Trials) -> np.ndarray:
        return of.run(40, RECORD).forces

    both = forces(trials_of([one, other], range(2), 8, PHYSICS, one.task))
    alone = [
        forces(trials_of([r, r], range(2), 8, PHYSICS, r.task))[:, k] for k, r in enumerate((one, other))
    ]
    np.testing.assert_array_equal(both, np.stack(alone, axis=1))
