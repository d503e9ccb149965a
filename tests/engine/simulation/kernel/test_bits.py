"""A simulation has the same bytes whatever shares its lanes and however many there are."""

from __future__ import annotations

import numpy as np
import pytest

from engine.simulation.kernel.batch import KernelBatch
from engine.simulation.kernel.lanes import simd
from engine.tasks.walls import Wall
from tests.support.kernel_recorded import ACROSS, BETWEEN, FOOTED, FREE, GATE, PHYSICS, STEPS, commands

N_UPDATES = 60
WALLS = [(), GATE, STEPS[:2]]
"""Of the three copies; they differ in number, too."""


def run(robots, *, copies=3, n_updates=N_UPDATES, seed=5, **options):
    """Return a batch after some updates, whose copies have commands and walls of their own."""
    batch = KernelBatch(
        robots,
        copies=copies,
        physics=PHYSICS,
        walls=[w for _ in robots for w in WALLS[:copies]],
        **options,
    )
    drive(batch, 0, n_updates, seed)
    return batch


def drive(batch, first, last, seed=5):
    """Advance a batch from one update to another."""
    n, copies = batch.shape
    each = [commands(batch.n_modules, last, seed + c, released=10) for c in range(copies)]
    for u in range(first, last):
        batch.step(np.array([[e[u].reshape(-1, 5) for e in each]] * n))


@pytest.fixture(scope="module")
def expected():
    return run([ACROSS], width=8)


def test_width_does_not_matter_to_feet(expected):
    batch, wide = run([FOOTED], width=1), run([FOOTED], width=8)
    assert batch.state().tobytes() == wide.state().tobytes()
    assert batch.state().tobytes() != expected.state().tobytes()


def test_width_does_not_matter(expected):
    """One lane; two and four are tried by the whole closed loop (``test_closed_loop``)."""
    batch = run([ACROSS], width=1)
    assert batch.state().tobytes() == expected.state().tobytes()
    assert batch.qvel.tobytes() == expected.qvel.tobytes()


def test_robots_touched_what_they_could(expected):
    forces = [simd.by_lane(lanes.state.contact_force) for lanes in expected._lanes]
    n_ground = 3 * 2 * 18
    assert all((f[:n_ground] != 0.0).any() for f in forces)
    assert any((f[n_ground:] != 0.0).any() for f in forces)


def test_company_does_not_matter(expected):
    """One copy beside a simulation that has diverged, and beside others."""
    batch = KernelBatch([ACROSS], copies=3, physics=PHYSICS, walls=WALLS, width=8)
    lengths = [commands(3, N_UPDATES, 5 + c, released=10) for c in range(3)]
    for u in range(N_UPDATES):
        now = np.array([[e[u].reshape(-1, 5) for e in lengths]])
        now[0, 0] = np.nan if u == 12 else 1.0
        batch.step(now)
    assert batch.alive[0].tolist() == [False, True, True]
    assert batch.state()[0, 1:].tobytes() == expected.state()[0, 1:].tobytes()


def test_threads_do_not_matter():
    one, two = (run([FREE, FREE], copies=1, n_updates=40, n_threads=n, width=1) for n in (1, 2))
    assert one.state().tobytes() == two.state().tobytes()


def test_a_restart_goes_on_with_the_same_bytes(expected):
    """In another width, from the middle of the fall, where rods touch for the first time."""
    before = run([ACROSS], n_updates=21, width=8)
    after = KernelBatch([ACROSS], copies=3, physics=PHYSICS, walls=WALLS, width=1)
    after.restore(before.state())
    drive(after, 21, N_UPDATES)
    assert after.state().tobytes() == expected.state().tobytes()


def test_a_branch_goes_on_as_its_origin():
    origin = run([BETWEEN], copies=1, n_updates=30, width=1)
    branch = KernelBatch([BETWEEN], copies=2, physics=PHYSICS, width=8)
    branch.branch(origin)
    assert branch.time == origin.time
    drive(origin, 30, 45)
    lengths = commands(2, 45, 5, released=10)
    for u in range(30, 45):
        branch.step(np.broadcast_to(lengths[u].reshape(-1, 5), (1, 2, 2, 5)))
    assert (branch.state() == origin.state()).all()


def test_a_branch_may_have_walls():
    """The robot goes on with the same bytes until it meets one."""
    origin = run([BETWEEN], copies=1, n_updates=30, width=1)
    far = Wall(centre=(0.0, 1.0, 0.1), half_size=(0.5, 0.1, 0.1))
    near = Wall(centre=(0.05, 0.0, 0.03), half_size=(0.05, 0.05, 0.03))
    branch = KernelBatch([BETWEEN], copies=2, physics=PHYSICS, width=8, walls=[(far, far), (far, near)])
    branch.branch(origin)
    assert branch.time == origin.time
    for sim in (branch, origin):
        sim.step(np.ones((*sim.shape, 2, 5)))
    assert branch.qpos[0, 0].tobytes() == origin.qpos.tobytes()
    assert branch.qpos[0, 1].tobytes() != origin.qpos.tobytes()
