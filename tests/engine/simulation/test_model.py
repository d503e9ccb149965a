import dataclasses

import mujoco
import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.body import servo
from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.simulation import model as r
from engine.simulation.model import build_robot, build_spec, face_rods, module_placements, with_walls
from engine.simulation.physics import Physics
from engine.simulation.provenance import body_fingerprint
from engine.tasks.walls import Wall
from tests.support.made_up import examples, morphologies

WEIGHT = 0.025 * 9.81
"""Of a module, in N: 25.0 g in the published table, whose parts add up to 25.015 g."""


def chain(n, level=5):
    return Morphology(level, tuple(1 + i % 8 for i in range(n)))


@pytest.mark.parametrize("n", range(2, 11))
def test_parts_of_a_chain(n):
    robot = build_robot(chain(n), Physics())
    model = robot.model
    assert robot.n_modules == n
    assert model.nbody == 1 + 6 * n
    assert model.nq == 7 * 6 * n
    assert model.nv == 6 * 6 * n
    assert model.ntendon == (24 + 5) * n + 3 * (n - 1)
    assert model.nu == 5 * n
    assert model.ngeom == 1 + 6 * n
    assert robot.rod_bodies.shape == (n, 6)
    assert sorted(robot.rod_bodies.ravel()) == list(range(1, 6 * n + 1))
    # only the links between modules have a limit
    assert int(model.tendon_limited.sum()) == 3 * (n - 1)


def test_passive_cables_have_the_stiffness_of_the_genotype():
    for level in (1, 4, 10):
        model = build_robot(chain(2, level), Physics()).model
        passive = [i for i in range(model.ntendon) if "_cable_" in model.tendon(i).name]
        assert len(passive) == 48
        np.testing.assert_allclose(model.tendon_stiffness[passive], 115.2 * level / 10)
        np.testing.assert_allclose(model.tendon_lengthspring[passive], [[0.0, 0.02067]] * len(passive))


def test_each_module_may_have_a_stiffness_of_its_own():
    levels = (3, 10, 1)
    unlike = build_robot(Morphology(levels, (1, 2, 3)), Physics()).model
    for i, level in enumerate(levels):
        passive = [k for k in range(unlike.ntendon) if unlike.tendon(k).name.startswith(f"m{i}_cable_")]
        assert len(passive) == 24
        np.testing.assert_allclose(unlike.tendon_stiffness[passive], 115.2 * level / 10)


def test_modules_that_happen_to_be_equally_stiff_make_the_same_robot():
    shared, own = (build_spec(Morphology(m, (1, 2, 3)), physics=Physics()) for m in (4, (4, 4, 4)))
    assert own.to_xml() == shared.to_xml()


@pytest.mark.parametrize("scale", [1.0, 2.5, 10.0])
@pytest.mark.parametrize("n", [2, 5, 10])
def test_weight_does_not_depend_on_the_inertia_scale(n, scale):
    model = build_robot(chain(n), Physics(inertia_scale=scale)).model
    assert model.opt.gravity[:2].tolist() == [0.0, 0.0]
    weight = -model.opt.gravity[2] * model.body_mass.sum()
    assert weight == pytest.approx(n * WEIGHT, rel=1e-3)
    real = build_robot(chain(n), Physics(inertia_scale=1.0)).model
    assert weight == pytest.approx(9.81 * real.body_mass.sum(), rel=1e-12)
    np.testing.assert_allclose(model.body_mass, scale * real.body_mass)
    np.testing.assert_allclose(model.body_inertia, scale * real.body_inertia)


def test_most_of_the_mass_is_on_the_servos_rod():
    robot = build_robot(chain(3), Physics())
    masses = robot.model.body_mass[robot.rod_bodies]
    # published: 80 %
    np.testing.assert_allclose(masses[:, 0] / masses.sum(axis=1), 0.8, atol=1e-3)
    assert np.ptp(masses[:, 1:]) == pytest.approx(0.0)


def test_a_chain_is_built_along_x_at_the_height_it_is_dropped_from():
    placements = module_placements(chain(4))
    centres = np.array([centre for _, centre in placements])
    np.testing.assert_allclose(np.diff(centres[:, 0]), 0.0375 * 6**0.5)
    np.testing.assert_allclose(centres[:, 1], 0.0)
    np.testing.assert_allclose(centres[:, 2], 0.082)
    for (turn, _), face in zip(placements, chain(4).faces, strict=True):
        ahead = turn.apply(t.NODES[list(t.FACES[face])].mean(axis=0))
        np.testing.assert_allclose(ahead / np.linalg.norm(ahead), [1.0, 0.0, 0.0], atol=1e-9)


@examples(8)
@given(morphologies)
def test_the_model_stands_where_the_genotype_says(m):
    model = build_spec(m, physics=Physics()).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for i, (turn, centre) in enumerate(module_placements(m)):
        expected = centre + turn.apply(t.NODES)
        for rod, (a, b) in enumerate(t.RODS):
            body = data.body(f"m{i}_rod{rod}")
            np.testing.assert_allclose(body.xpos, (expected[a] + expected[b]) / 2, atol=1e-9)
        for a, b in t.CABLES:
            length = data.tendon(f"m{i}_cable_{a}_{b}").length[0]
            ends = t.passive_anchor(a, b), t.passive_anchor(b, a)
            assert length == pytest.approx(np.linalg.norm(ends[0] - ends[1]))
    for i in range(m.n_modules - 1):
        # links start with little slack or stretch
        assert all(0.001 < data.tendon(f"link{i}_{k}").length[0] < 0.006 for k in range(3))
    # nothing is below the ground
    assert data.geom_xpos[1:, 2].min() > 0.0


def test_an_actuator_pulls_with_the_published_tension():
    model = build_spec(chain(2), physics=Physics()).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    length = data.actuator_length.copy()
    for error, tension in ((0.0, 0.1), (0.002, 0.1 + 61.3 * 0.002), (0.02, 0.654), (-0.01, 0.0)):
        data.ctrl[:] = length - error
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(-data.actuator_force, tension, atol=1e-6)


def test_walls_stand_where_they_should():
    wall = Wall(centre=(0.3, 0.1, 0.06), half_size=(0.08, 0.2, 0.06), yaw=0.4)
    model = with_walls(build_robot(chain(2), Physics()), [wall])
    geom = model.geom("wall0")
    np.testing.assert_allclose(geom.pos, wall.centre)
    np.testing.assert_allclose(geom.size, wall.half_size)
    turn = Rotation.from_quat(geom.quat, scalar_first=True)
    np.testing.assert_allclose(turn.as_rotvec(), [0.0, 0.0, 0.4])


def test_gravity_can_be_left_out():
    assert build_robot(chain(2), Physics(), gravity=False).model.opt.gravity.tolist() == [0, 0, 0]


def test_face_rods_are_the_rods_of_its_nodes():
    assert face_rods(1) == (1, 3, 4)
    assert face_rods(8) == (0, 2, 4)


@pytest.mark.parametrize(
    "changes",
    [
        {"timestep": 0.0},
        {"timestep": -0.004},
        {"timestep": float("nan")},
        {"timestep": float("inf")},
        {"timestep": 0.003},
        {"timestep": 0.04},
        {"control_period": 0.0},
        {"control_period": 0.03, "timestep": 0.003},
        {"control_period": 2.0},
        {"control_period": float("inf")},
        {"inertia_scale": 0.0},
        {"inertia_scale": float("nan")},
        {"inertia_scale": float("inf")},
        {"friction": -1.0},
        {"friction": float("inf")},
        {"impratio": 0.0},
        {"servo_noise": -0.1},
        {"servo_noise": float("nan")},
        {"servo_noise": float("inf")},
    ],
    ids=str,
)
def test_impossible_physics_is_refused(changes):
    with pytest.raises(InvalidData, match="physics"):
        Physics(**changes)


def test_time_steps_per_control_period():
    assert Physics().steps_per_control == 8
    assert Physics(timestep=0.005, control_period=0.1).steps_per_control == 20
    assert dataclasses.replace(Physics(), timestep=0.02).steps_per_control == 1


def single_module(level):
    """One module, floating."""
    return r.chain_spec((level,), (1,), physics=Physics(), gravity=False).compile()


def face_distance(data, face):
    """Distance between the centres of a face and of its opposite, in cm."""
    centres = []
    for f in (face, t.OPPOSITE_FACE[face]):
        nodes = []
        for n in t.FACES[f]:
            body = data.body(f"m0_rod{n // 2}")
            half = (t.NODES[n] - t.NODES[n ^ 1]) / 2
            nodes.append(body.xpos + body.xmat.reshape(3, 3) @ half)
        centres.append(np.mean(nodes, axis=0))
    return 100 * np.linalg.norm(centres[0] - centres[1])


def test_only_the_actuated_faces_approach_each_other():
    model = single_module(5)
    data = mujoco.MjData(model)
    distances = []
    for command in (0.0, 180.0):
        data.ctrl[:] = servo.target_lengths(np.array(command))
        mujoco.mj_step(model, data, 750)
        distances.append([face_distance(data, f) for f in (1, 2, 3, 4)])
    change = np.subtract(*distances)
    assert change[0] > 1.0
    assert np.abs(change[1:]).max() < 0.5 * change[0]


def test_the_fingerprint_tells_bodies_apart(monkeypatch):
    before = body_fingerprint()
    assert body_fingerprint() == before
    monkeypatch.setattr(t, "CABLE_DAMPING", 0.71)
    for cached in (body_fingerprint, r._loose_modules):
        cached.cache_clear()
    changed = body_fingerprint()
    for cached in (body_fingerprint, r._loose_modules):
        cached.cache_clear()
    assert changed != before


def test_a_robot_is_described_alike_whatever_was_described_before():
    """Descriptions of one size are copies of one, which must stay as it is."""
    one, other = Morphology((1, 9, 4), (1, 2, 3)), Morphology(10, (8, 5, 7))

    def described(morphology):
        spec = build_spec(morphology, physics=Physics())
        spec.compile()
        return spec.to_xml()

    before = described(one)
    assert described(other) != before
    assert described(one) == before
    build_spec(one, physics=Physics()).body("m0_rod0").pos = [9.0, 9.0, 9.0]
    assert described(one) == before
