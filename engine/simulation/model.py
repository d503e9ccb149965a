"""A morphology and a task's world become a MuJoCo model.

``inertia_scale`` follows the published simulator, whose dynamics are those of the real robot under
Earth's gravity with every inertia multiplied by ten (mass scaling): weights and forces are the real
ones, gravity is divided and masses are multiplied by the scale. 1 gives the real inertia.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import threading
from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.body.kinematics import points_on, quaternion_product
from engine.body.morphology import Feet, Morphology
from engine.exact import length
from engine.simulation.built import Built
from engine.simulation.physics import Physics
from engine.tasks.walls import Wall, add_walls

# a diverging simulation is reported with its evaluation, not in a log file in the current folder
_log = mujoco.MjLogConfig.get()
_log.logto_file = False
_log.logto_console = False
mujoco.MjLogConfig.set(_log)

DROP_HEIGHT: Final = 0.082
"""Height of the chain's axis above the ground at the start, in metres."""
GRAVITY: Final = 9.81
NEWTON_TOLERANCE: Final = 1e-12
"""Tolerance of MuJoCo's Newton solver: below it nothing changes within a trial's rounding."""
FEET_WAY: Final[dict[Feet, int]] = {"none": 0, "end": 1, "start": -1}
"""``RobotModel.feet`` by a body's gene."""
CONTACT_SOLIMP: Final = (0.98, 0.995, 0.001, 0.5, 2.0)
"""Constraint impedance of every contact; MuJoCo's default lets friction creep by millimetres a second."""


@dataclasses.dataclass(frozen=True, slots=True)
class RobotModel:
    """A compiled robot and where to find its parts.

    Attributes:
        model: the MuJoCo model.
        rod_bodies: (modules, 6) body ids of the rods.
        n_modules: number of modules.
        spec: what the model was compiled from.
        feet: 1 or -1 with feet that slide towards the end or the start of the chain, else 0; MuJoCo knows
            nothing of them.
        feet_friction: their coefficients, forward and backward.
    """

    model: mujoco.MjModel
    rod_bodies: np.ndarray
    n_modules: int
    spec: mujoco.MjSpec
    feet: int
    feet_friction: tuple[float, float]


def face_rods(face: int) -> tuple[int, ...]:
    """Return the three rods whose centres average to a face's position."""
    return tuple(t.rod_of(n) for n in t.FACES[face])


def module_placements(morphology: Morphology) -> list[tuple[Rotation, np.ndarray]]:
    """Return per module its turn and its centre (3,) in metres as built, the chain along +x.

    The published simulator builds the chain along (1, 1, 1) in a frame whose y axis is up and lays it down by
    one turn of 45 degrees about z. The turn decides on which side a robot falls; of all turns about the
    chain's axis this one leaves the modules of the reference robots at the published heights.
    """
    places = _places(morphology.faces)
    return [(Rotation.from_quat(place[3:], scalar_first=True), place[:3]) for place in places]


def _places(faces: Sequence[int]) -> np.ndarray:
    """Return per module its centre in metres as built and its turn as a quaternion, (modules, 7)."""
    # the axis becomes x, (-1, 1, 0) becomes up
    ahead, left, up = t.CHAIN_AXIS[0], 1.0 / math.sqrt(6.0), 1.0 / math.sqrt(2.0)
    w = math.sqrt(1.0 + ahead + left) / 2.0
    level = (w, (up + 2.0 * left) / (4.0 * w), (ahead + up) / (4.0 * w), (left - ahead) / (4.0 * w))
    half_turn = (0.0, *t.CHAIN_AXIS)
    places = []
    for i, face in enumerate(faces):
        turn = t.FACE_TURN[face]
        if i % 2:
            turn = quaternion_product(turn, half_turn)
        places.append((t.MODULE_SPACING * i, 0.0, DROP_HEIGHT, *quaternion_product(turn, level)))
    return np.array(places)


def build_spec(morphology: Morphology, *, physics: Physics, gravity: bool = True) -> mujoco.MjSpec:
    """Describe a robot on the ground plane.

    Bodies are named ``m{module}_rod{rod}``, passive cables ``m{module}_cable_{a}_{b}``, internal
    cables and their actuators ``m{module}_servo_{node}``; the control of an actuator is the target
    length of its cable in metres.
    """
    return chain_spec(morphology.stiffness_levels, morphology.faces, physics=physics, gravity=gravity)


def chain_spec(
    levels: Sequence[int], faces: Sequence[int], *, physics: Physics, gravity: bool = True
) -> mujoco.MjSpec:
    """Describe a chain of modules on the ground plane: a robot, or a single module.

    Args:
        levels: per module its stiffness level, 1 to 10.
        faces: per module the face, 1 to 8, that the next module attaches to.
        physics: how it is simulated.
        gravity: whether gravity acts.

    Returns:
        A description with the same names as ``build_spec``'s.
    """
    with _copying:
        spec = _loose_modules(len(faces), physics, gravity).copy()
    spec.modelname = f"tsmr_{len(faces)}x{'_'.join(map(str, sorted(set(levels))))}"
    rods = _Rods(spec)
    for i, place in enumerate(_places(faces)):
        rods.place(i, place)
    for i, tendon in enumerate(spec.tendons):
        module, cable = divmod(i, t.N_CABLES)
        if cable < len(t.CABLES):
            stiffness = t.stiffness_n_per_m(levels[module] / t.N_STIFFNESS_LEVELS)
            stiffness *= physics.built.stiffness_factor(levels[module], module)
            tendon.stiffness = [stiffness, 0.0, 0.0]
    for i in range(len(faces) - 1):
        _add_joint(rods, i, faces)
    return spec


_copying: Final = threading.Lock()
"""Held while a description that threads share is copied."""


@functools.lru_cache(maxsize=32)
def _loose_modules(n: int, physics: Physics, gravity: bool) -> mujoco.MjSpec:
    """Describe modules that lie in one place, unlinked, their passive cables without stiffness.

    A copy of that takes a fifth of the time of describing modules anew.
    """
    spec = mujoco.MjSpec()
    _set_options(spec, physics, gravity)
    contact = spec.default.geom
    contact.friction = [physics.friction, 0.005, 0.0001]
    contact.solref = [physics.contact_time, physics.contact_damping]
    contact.solimp = CONTACT_SOLIMP
    _add_ground(spec)
    rods = _Rods(spec)
    for i in range(n):
        _add_module(rods, i, physics)
    return spec


class _Rods:
    """The rods of a robot that is being described; looking them up there by name is slow.

    Args:
        spec: the description, with rods or none as yet.
    """

    def __init__(self, spec: mujoco.MjSpec) -> None:
        self.spec = spec
        self._bodies = {divmod(k, len(t.RODS)): body for k, body in enumerate(spec.bodies[1:])}
        self._n_sites = 2 * len(spec.tendons)  # one at each end

    def add(self, module: int, rod: int) -> mujoco.MjsBody:
        """Add a rod's body."""
        body = self.spec.worldbody.add_body(name=f"m{module}_rod{rod}")
        self._bodies[module, rod] = body
        return body

    def place(self, module: int, place: np.ndarray) -> None:
        """Put a module's rods where its centre in metres and its turn as a quaternion are, (7,)."""
        middles = points_on(place[None], np.zeros(len(t.RODS), int), t.ROD_MIDDLES)
        for rod, middle in enumerate(middles):
            body = self._bodies[module, rod]
            body.pos, body.quat = middle, place[3:]

    def add_site(self, module: int, rod: int, point: np.ndarray) -> str:
        """Add a site at a point (3,) of the module's built frame, in metres, to a rod; return its name."""
        name = f"m{module}_site{self._n_sites}"
        self._n_sites += 1
        self._bodies[module, rod].add_site(
            name=name,
            pos=point - t.ROD_MIDDLES[rod],
            size=[0.0005, 0.0005, 0.0005],
        )
        return name


@functools.lru_cache(maxsize=48)  # up to 3 MB each
def build_robot(morphology: Morphology, physics: Physics, *, gravity: bool = True) -> RobotModel:
    """Compile a robot on the open plane; equal arguments share one model, which must not be changed."""
    spec = build_spec(morphology, physics=physics, gravity=gravity)
    model = spec.compile()
    rod_bodies = np.array(
        [[model.body(f"m{i}_rod{r}").id for r in range(len(t.RODS))] for i in range(morphology.n_modules)]
    )
    return RobotModel(
        model=model,
        rod_bodies=rod_bodies,
        n_modules=morphology.n_modules,
        spec=spec,
        feet=FEET_WAY[morphology.feet],
        feet_friction=physics.feet_friction,
    )


def with_walls(robot: RobotModel, walls: Sequence[Wall]) -> mujoco.MjModel:
    """Compile a robot in a world with walls, at their places in the world.

    Describing a robot takes long (10 to 50 ms); compiling the description again takes 1 to 5 ms, so every
    trial can have its own walls, with bounding volumes that fit them. The state has the same layout as
    without walls.
    """
    if not walls:
        return robot.model
    spec = robot.spec.copy()
    add_walls(spec, walls)
    return spec.compile()


def _set_options(spec: mujoco.MjSpec, physics: Physics, gravity: bool) -> None:
    spec.option.timestep = physics.timestep
    spec.option.gravity = [0.0, 0.0, -GRAVITY / physics.inertia_scale if gravity else 0.0]
    # implicitfast would solve for contact forces without the cables' damping and apply them with it
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    # PGS is wrong in 1 to 6 % of states (docs/physics.md)
    spec.option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    spec.option.tolerance = NEWTON_TOLERANCE
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = physics.impratio


def _add_ground(spec: mujoco.MjSpec) -> None:
    spec.worldbody.add_geom(
        name="ground",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0.0, 0.0, 0.1],
        rgba=[0.8, 0.82, 0.85, 1.0],
    )
    spec.worldbody.add_light(pos=[0.0, 0.0, 2.0], dir=[0.0, 0.0, -1.0])


def _add_module(rods: _Rods, i: int, physics: Physics) -> None:
    for r, (a, b) in enumerate(t.RODS):
        body = rods.add(i, r)
        body.add_freejoint()
        half = (t.NODES[b] - t.NODES[a]) / 2
        core = half * (1.0 - t.ROD_END_CUT / length(half))
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=np.concatenate([-core, core]),
            size=[t.ROD_RADIUS, 0.0, 0.0],
            mass=0.0,
        )
        _set_inertia(body, r, half, physics)
    _add_cables(rods, i, physics.built)


def _set_inertia(body: mujoco.MjsBody, rod: int, half: np.ndarray, physics: Physics) -> None:
    """Give a rod a slender rod's inertia, with a spin part large enough for stable integration.

    The true spin inertia is some 500 times smaller than the transverse one and no task depends on it; 0.3 of
    the transverse part keeps every integrator stable.
    """
    mass = physics.built.loaded_servo_rod if rod == t.SERVO_ROD else physics.built.plain_rod_mass
    mass *= physics.inertia_scale
    transverse = mass * t.ROD_LENGTH * t.ROD_LENGTH / 12
    axis = int(np.argmax(np.abs(half)))
    inertia = np.full(3, transverse)
    inertia[axis] = 0.3 * transverse
    if rod != t.SERVO_ROD:
        inertia *= physics.rod_inertia
    body.mass = mass
    body.ipos = physics.built.centre_of_mass if rod == t.SERVO_ROD else [0.0, 0.0, 0.0]
    body.inertia = inertia
    body.explicitinertial = True


def _add_cables(rods: _Rods, i: int, built: Built) -> None:
    spec = rods.spec
    for a, b in t.CABLES:
        tendon = spec.add_tendon(
            name=f"m{i}_cable_{a}_{b}",
            damping=[t.CABLE_DAMPING, 0.0, 0.0],
            springlength=[0.0, built.rest_length],
            width=0.0006,
            rgba=[0.36, 0.65, 0.86, 1.0],
        )
        for node, other in ((a, b), (b, a)):
            tendon.wrap_site(rods.add_site(i, t.rod_of(node), t.passive_anchor(node, other)))
    for node in t.SERVO_NODES:
        tendon = spec.add_tendon(name=f"m{i}_servo_{node}", width=0.0005, rgba=[0.93, 0.49, 0.19, 1.0])
        on_sphere, on_rod = t.servo_anchors(node)
        tendon.wrap_site(rods.add_site(i, t.SERVO_ROD, on_sphere))
        tendon.wrap_site(rods.add_site(i, t.rod_of(node), on_rod))
        # tension = SERVO_OFFSET + stiffness (length - target), between 0 and the limit
        spec.add_actuator(
            name=f"m{i}_servo_{node}",
            trntype=mujoco.mjtTrn.mjTRN_TENDON,
            target=f"m{i}_servo_{node}",
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            gainprm=[built.line_stiffness] + [0.0] * 9,
            biasprm=[-t.SERVO_OFFSET, -built.line_stiffness, -t.CABLE_DAMPING] + [0.0] * 7,
            forcelimited=True,
            forcerange=[-built.tension_limit, 0.0],
        )


def _add_joint(rods: _Rods, i: int, faces: Sequence[int]) -> None:
    spec = rods.spec
    face = t.FACES[faces[i]]
    opposite = t.FACES[t.OPPOSITE_FACE[faces[i + 1]]]
    for k, (p, q) in enumerate(t.JOINT_ORDER):
        a, b = face[p], opposite[q]
        link = spec.add_tendon(
            name=f"link{i}_{k}",
            limited=True,
            range=[0.8 * t.LINK_PLAY, 1.2 * t.LINK_PLAY],
            width=0.001,
            rgba=[0.2, 0.2, 0.2, 1.0],
        )
        link.wrap_site(rods.add_site(i, t.rod_of(a), t.NODES[a]))
        link.wrap_site(rods.add_site(i + 1, t.rod_of(b), t.NODES[b]))
        spec.add_exclude(bodyname1=f"m{i}_rod{t.rod_of(a)}", bodyname2=f"m{i + 1}_rod{t.rod_of(b)}")


def xml_with_state(spec: mujoco.MjSpec, name: str, state: np.ndarray) -> str:
    """Return MJCF that compiles to the same numbers, bit for bit, with a state as a keyframe.

    Args:
        spec: of the model; the keyframe is added to it.
        name: of the keyframe; the solver's starting point is the numeric ``{name}_qacc_warmstart``.
        state: (n,) a complete state (``mjSTATE_INTEGRATION``) of the compiled model.
    """
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    spec.add_key(name=name, time=data.time, qpos=data.qpos, qvel=data.qvel, ctrl=data.ctrl)
    # a keyframe has no place for the solver's starting point, without which motions drift apart
    spec.add_numeric(name=f"{name}_qacc_warmstart", data=data.qacc_warmstart, size=model.nv)
    # compiled values are saved with six digits, values as written in the spec with all
    spec.compiler.savecompiled = False
    return spec.to_xml()
