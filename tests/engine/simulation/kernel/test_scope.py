"""A model with anything that the kernel does not know is refused by name."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
import pytest

from engine.body.morphology import Morphology
from engine.simulation.kernel.physics.walls import read_walls
from engine.simulation.kernel.robots import scope
from engine.simulation.kernel.robots.parameters import read_model
from engine.simulation.model import build_robot, with_walls
from engine.simulation.physics import Physics
from engine.tasks.walls import Wall

ROBOT = build_robot(Morphology(4, (3, 8, 1)), Physics())


def test_a_robots_numbers_are_its_models():
    model = read_model(ROBOT.model)
    assert model.n_modules == 3
    assert model.timestep == ROBOT.model.opt.timestep
    np.testing.assert_array_equal(1.0 / model.inverse_mass, ROBOT.model.body_mass[1:7])
    # two joints of three links, each between neighbours
    assert (model.links // 6).tolist() == [[0, 1]] * 3 + [[1, 2]] * 3
    assert len(np.unique(model.links)) == 12


def test_modules_have_the_same_masses_however_they_lie():
    # at this inertia MuJoCo's inverse of a rod's mass has another last digit in one module than in the next
    robot = build_robot(Morphology(3, (2, 5, 7, 8, 1)), Physics(inertia_scale=7.0, timestep=0.002))
    weight = robot.model.body_invweight0[1:, 0]
    assert (weight != 1.0 / robot.model.body_mass[1:]).any()
    assert (read_model(robot.model).contact_weight == 1.0 / robot.model.body_mass[1:7]).all()


def test_walls_are_read_from_a_model():
    walls = [Wall(centre=(1.0, 2.0, 0.1), half_size=(0.1, 0.2, 0.3), yaw=0.7)]
    (found,) = read_walls(with_walls(ROBOT, walls))
    assert (found.centre, found.half_size) == (walls[0].centre, walls[0].half_size)
    assert found.yaw == pytest.approx(0.7)


def _public(thing):
    return {n for n in dir(thing) if not n.startswith("_") and not callable(getattr(thing, n))}


def _groups(field):
    """Return how many groups of the scope a field is in."""
    listed = (scope.NONE_OF, scope.FIELDS, scope.READ, scope.DERIVED, scope.IDLE)
    return sum(field in group for group in listed) + field.startswith(tuple(scope.BEGINNINGS))


def test_every_field_of_mujocos_models_is_in_one_group():
    """One that is in none is new: say in ``scope`` what the kernel makes of it."""
    unclear = {field for field in _public(ROBOT.model) - {"opt"} if _groups(field) != 1}
    assert not unclear
    for group in (scope.NONE_OF, scope.FIELDS, scope.READ, scope.DERIVED, scope.IDLE):
        assert set(group) <= _public(ROBOT.model)


def test_every_option_of_mujocos_is_in_one_group():
    groups = [*scope.OPTIONS, *scope.READ_OPTIONS, *scope.IDLE_OPTIONS]
    assert len(set(groups)) == len(groups)
    assert set(groups) == _public(ROBOT.model.opt)


def _next_velocities(model):
    """Return the velocities after a step from a crouching robot with servos on."""
    data = mujoco.MjData(model)
    data.qpos[:], data.ctrl[:] = ROBOT.model.qpos0, 0.06
    data.qpos[2::7] -= 0.04
    mujoco.mj_step(model, data, 3)
    assert data.ncon
    return data.qvel


@pytest.mark.parametrize(
    "field",
    [
        f
        for f in scope.IDLE
        if isinstance(v := getattr(ROBOT.model, f), np.ndarray) and v.size and v.dtype.kind == "f"
    ],
)
def test_idle_fields_change_no_motion(field):
    model = copy.copy(ROBOT.model)
    getattr(model, field)[...] += 0.37
    np.testing.assert_array_equal(_next_velocities(model), _next_velocities(ROBOT.model))


def _set(path, value):
    def change(spec):
        *owners, name = path.split(".")
        thing = spec
        for owner in owners:
            thing = getattr(thing, owner)
            if isinstance(thing, list | tuple) or hasattr(thing, "__getitem__"):
                thing = thing[-1]
        setattr(thing, name, value)

    return change


def _add_weld(spec):
    spec.add_equality(
        type=mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        name1="m0_rod0",
        name2="m0_rod1",
        data=np.zeros(12),
    )


def _add_sphere(spec):
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0.0, 0.0])


def _tilt_plane(spec):
    spec.geom("ground").quat = [1.0, 0.1, 0.0, 0.0]


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (_set("option.cone", mujoco.mjtCone.mjCONE_PYRAMIDAL), "cone"),
        (_set("option.integrator", mujoco.mjtIntegrator.mjINT_RK4), "integrator"),
        (_set("option.density", 1.2), "density"),
        (_set("option.gravity", [1.0, 0.0, -9.8]), "gravity"),
        (_set("option.disableflags", int(mujoco.mjtDisableBit.mjDSBL_CONTACT)), "disableflags"),
        (_add_weld, "equality constraints"),
        (_add_sphere, "boxes"),
        (_tilt_plane, "plane"),
        (_set("tendons.frictionloss", 0.1), "tendon_frictionloss"),
        (_set("tendons.armature", 0.1), "tendon_armature"),
        (_set("actuators.ctrllimited", True), "actuator_ctrllimited"),
        (_set("geoms.friction", [0.9, 0.005, 0.0001]), "geom_friction"),
        (_set("geoms.margin", 0.01), "geom_margin"),
        (_set("geoms.condim", 1), "geom_condim"),
        (_set("geoms.solimp", [0.9, 0.95, 0.001, 0.3, 2.0]), "geom_solimp"),
        (_set("joints.damping", [0.1, 0.0, 0.0]), "dof_damping"),
        (_set("bodies.gravcomp", 0.5), "body_gravcomp"),
        (_set("bodies.mass", 2.0), "masses of modules"),
    ],
)
def test_unknown_things_are_refused(change, named):
    spec = ROBOT.spec.copy()
    change(spec)
    if named == "actuator_ctrllimited":
        spec.actuators[-1].ctrlrange = [0.0, 1.0]
    with pytest.raises(ValueError, match=named):
        read_model(spec.compile())
