"""What a batch says of its simulations, and of those that diverge."""

from __future__ import annotations

import numpy as np
import pytest

from engine.body.morphology import Morphology
from engine.simulation.divergence import BLOCK
from engine.simulation.kernel.batch import KernelBatch, widest, width_for
from engine.simulation.kernel.lanes import simd
from engine.simulation.model import build_robot
from tests.support.kernel_recorded import BETWEEN, PHYSICS

OTHER = build_robot(Morphology(2, (4, 8)), PHYSICS)


def batch(copies=3):
    return KernelBatch([BETWEEN, OTHER], copies=copies, physics=PHYSICS)


def released(sim):
    return np.ones((*sim.shape, sim.n_modules, 5))


def test_starts_as_built():
    sim = batch()
    np.testing.assert_array_equal(sim.qpos[0, 2], BETWEEN.model.qpos0)
    np.testing.assert_array_equal(sim.qpos[1, 1], OTHER.model.qpos0)
    assert not sim.qvel.any()
    assert sim.alive.all()
    assert sim.time == 0.0


def test_chosen_rods_are_among_all():
    sim = batch()
    sim.step(released(sim))
    some = sim.rods(np.array([0, 1]), np.array([[1, 2], [3, 5]]))
    np.testing.assert_array_equal(some[0], sim.all_rods()[0, :, 0, [1, 2]].transpose(1, 0, 2))
    np.testing.assert_array_equal(some[1], sim.all_rods()[1, :, 1, [3, 5]].transpose(1, 0, 2))
    assert sim.time == PHYSICS.control_period
    np.testing.assert_array_equal(sim.commanded, released(sim))


def _put(sim, i, row, value):
    """Set a number of all rods of simulation i of the first robot."""
    sim._lanes[0].rods[:, row, i] = value


@pytest.mark.parametrize(
    ("row", "value", "reason"),
    [
        (0, np.nan, "not finite"),
        (10, np.inf, "not finite"),
        (1, 11.0, "outside the arena"),
        (8, 100.0, "impossible"),
    ],
)
def test_divergence_is_found_and_leaves_others_alone(row, value, reason):
    sim, healthy = batch(), batch()
    for s in (sim, healthy):
        s.step(released(s))
    _put(sim, 1, row, value)
    for s in (sim, healthy):
        s.step(released(s))
        s.step(released(s))
    assert sim.alive.ravel().tolist() == [True, False, True, True, True, True]
    assert reason in sim.failures[1].reason
    assert "0.04 s after the drop" in sim.failures[1].reason
    others = [0, 2, 3, 4, 5]
    state, expected = (s.state().reshape(6, -1)[others] for s in (sim, healthy))
    assert state.tobytes() == expected.tobytes()


def test_a_command_that_is_no_number_is_found():
    sim = batch()
    lengths = released(sim)
    lengths[1, 2, 0, 3] = np.nan
    sim.step(lengths)
    assert "a control was not finite" in sim.failures[5].reason


def test_a_failure_can_be_simulated_again():
    sim = batch(copies=1)
    rng = np.random.default_rng(3)
    for _ in range(BLOCK + 7):
        sim.step(0.06 + 0.005 * rng.random((2, 1, 2, 5)))
    lengths = released(sim)
    lengths[0] = np.inf
    before = sim.state()[0, 0]
    sim.step(lengths)
    failure = sim.failures[0]
    again = KernelBatch([BETWEEN], copies=1, physics=PHYSICS)
    again.restore(failure.state[None, None])
    for control in failure.controls[:-1]:
        again.step(control.reshape(1, 1, 2, 5))
    assert again.state().tobytes() == before.tobytes()
    assert again.alive.all()
    again.step(failure.controls[-1].reshape(1, 1, 2, 5))
    assert not again.alive.any()


def test_width_fits_copies():
    assert widest() in simd.WIDTHS
    assert [width_for(n) for n in (1, 2, 100)] == [1, widest(), widest()]
