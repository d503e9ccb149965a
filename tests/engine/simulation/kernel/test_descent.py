"""Rods that jam: their contacts pass force to each other slowly."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from engine.body.morphology import Morphology
from engine.simulation.kernel.guard import read_robot
from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.physics.state import KEPT, N_COUPLED, N_PAIRS, ROD
from engine.simulation.kernel.robots.model import model_of
from engine.simulation.kernel.step import run
from engine.simulation.model import build_robot
from tests.support.kernel_driven import PHYSICS, drop

JAMMED = Morphology(1, (1, 1, 5, 6, 8, 7, 6))
OTHER = Morphology(1, (4, 3, 7, 1, 2, 3, 1))


@pytest.fixture(scope="module")
def pulsed():
    """A soft robot, some of whose rods jam as it pulses."""
    dropped = drop(JAMMED)
    dropped.settle(60)
    before = dropped.pulse(100)[0].work.counts[N_COUPLED]
    state = dropped.pulse(150)[0]
    return dropped.model, state, state.work.counts[N_COUPLED] - before


def stepped(model, state):
    """Return the velocities after one step, and the sweeps that it took."""
    after = copy.deepcopy(state)
    run(model, after, 1)
    rods = simd.by_lane(after.rods)[:, 0].reshape(-1, ROD)
    return rods[:, 7:], after.work.counts[N_COUPLED] - state.work.counts[N_COUPLED]


def test_jammed_rods_take_few_sweeps(pulsed):
    _, state, sweeps = pulsed
    assert state.work.counts[N_PAIRS] >= 2
    steps = 50 * PHYSICS.steps_per_control
    assert 10 < sweeps / steps < 40


def test_they_are_pushed_as_if_swept_over_to_the_end(pulsed):
    model, state, _ = pulsed
    robot = read_robot(build_robot(JAMMED, PHYSICS))._replace(settled=1e-13, most_sweeps=20_000)
    exact, many = stepped(model_of([robot] * 8), state)
    found, few = stepped(model, state)
    assert np.abs(found - exact).max() < 1e-7
    assert few < many < 1000


def test_lanes_are_done_each_at_its_own_time():
    """Two robots that jam at other places, for longer or shorter: each moves as it does alone."""
    bodies = (JAMMED, OTHER)
    together, *alone = [drop(*robots) for robots in (bodies, bodies[:1], bodies[1:])]
    for dropped in (together, *alone):
        dropped.settle(60)
    state, *own = [dropped.pulse(100)[0] for dropped in (together, *alone)]
    sweeps = [s.work.counts[N_COUPLED] for s in own]
    assert max(sweeps) < state.work.counts[N_COUPLED] < sum(sweeps)
    for lane, theirs in enumerate(own):
        for field in KEPT:
            ours, others = (simd.by_lane(getattr(s, field)) for s in (state, theirs))
            assert ours[:, lane].tobytes() == others[:, 0].tobytes()
