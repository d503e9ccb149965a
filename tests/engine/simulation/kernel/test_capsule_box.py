"""A rod touches a box where MuJoCo has it touch."""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from engine.simulation.kernel.physics.capsule_box import NOWHERE, touching_points

RADIUS, HALF_LENGTH = 0.0015, 0.04
SIZE = np.array([0.03, 0.05, 0.01])


def _poses(n):
    """Yield middles near the surface of the box or within it, and orientations, some along its axes."""
    rng = np.random.default_rng(8)
    for k in range(n):
        turn = Rotation.random(random_state=rng)
        if k % 3 == 0:
            turn = Rotation.from_rotvec(0.05 * rng.normal(size=3)) * Rotation.from_euler(
                "xyz", rng.integers(0, 4, 3) * np.pi / 2
            )
        yield rng.uniform(-1.0, 1.0, 3) * (SIZE + 0.02), turn


def _ours(middle, axis):
    """Return the contacts' (depth, place along the rod) by MuJoCo's rule for spheres and boxes."""
    h = HALF_LENGTH * axis
    first, second = touching_points(tuple(middle), tuple(h), tuple(SIZE), HALF_LENGTH)
    places = [first] if second == NOWHERE else [first, first + second]
    found = []
    for place in places:
        at = middle + place * h
        depth = np.linalg.norm(at - np.clip(at, -SIZE, SIZE)) - RADIUS
        if depth == -RADIUS:
            depth -= (SIZE - np.abs(at)).min()
        if depth <= 0.0:
            found.append(depth)
    return found


def test_contacts_are_mujocos():
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody><geom type="box" size="{SIZE[0]} {SIZE[1]} {SIZE[2]}"/>
        <body><freejoint/><geom type="capsule" size="{RADIUS} {HALF_LENGTH}"/></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    numbers = set()
    for middle, turn in _poses(3000):
        data.qpos[:3], data.qpos[3:] = middle, turn.as_quat(scalar_first=True)
        mujoco.mj_fwdPosition(model, data)
        ours = _ours(middle, turn.apply([0.0, 0.0, 1.0]))
        assert len(ours) == data.ncon
        np.testing.assert_allclose(ours, data.contact.dist, atol=1e-12)
        numbers.add(data.ncon)
    assert numbers == {0, 1, 2}
