"""Every number of a robot, read from its compiled MuJoCo model.

A rod is a body with one free joint, one capsule about its middle and a symmetric inertia. Six rods and the
cables between them are a module; all modules are alike but for the stiffness of their cables. A link holds
two rods of neighbouring modules together at points of their axes; a rod has one link at most.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np

from engine.body.kinematics import points_on, rotation_rows
from engine.exact import length
from engine.simulation.kernel.robots.scope import refuse_unknown, same_for_all

RODS: Final = 6
"""Rods of a module."""
PASSIVE: Final = 24
"""Passive cables of a module."""
INTERNAL: Final = 5
"""Internal cables of a module, each with an actuator."""
CABLES: Final = PASSIVE + INTERNAL
SETTLED: Final = 1e-8
"""Default of ``Robot.settled``, in m/s; ``solver`` says why."""
MOST_SWEEPS: Final = 200
"""Default of ``Robot.most_sweeps``."""
FEET_HOLD: Final = 3e-6
"""Default of ``Robot.feet_hold``, in m/s; docs/feet.md says why."""
JOINT: Final = 7
"""Numbers of a free joint's position: centre and quaternion."""
_ON_AXIS: Final = 1e-12
"""How far from a rod's axis, in m, the point of a link may lie."""


class Robot(NamedTuple):
    """A robot's numbers, in SI units; m modules, 6 m rods.

    Attributes:
        n_modules: m.
        timestep, gravity: in s and m/s^2, downwards.
        stiffness: (m,) of the passive cables.
        cable_rods: (29 x 2,) which two rods of a module a cable joins, passive ones first.
        cable_anchors: (29 x 6,) its anchors in the two rods' frames.
        cable_rest, cable_damping: of passive cables.
        servo_gain, servo_offset, servo_limit, servo_damping: an internal cable pulls with gain x (length -
            command) + offset + damping x speed, between 0 and the limit.
        inverse_mass: (6,) of a rod of a module.
        inverse_inertia: (6,) of turning about an axis across the rod.
        inverse_spin: (6,) by how much more a moment about the rod's axis turns it.
        spin: (6,) by how much the inertia about its axis exceeds that across.
        axis: (6,) which axis of its own frame a rod lies along.
        contact_weight: (6,) acceleration of a rod per force, which scales its contacts' softness: MuJoCo's
            ``body_invweight0``.
        centre_of_mass: (3,) of rod 0 of a module from its middle; the others' are in the middle.
        half_length, radius: of a rod's capsule.
        friction: its coefficient.
        feet: 0, or 1 or -1 with feet that slide towards the end or the start of the chain.
        feet_forward, feet_backward: coefficients of feet that slide that way, and of those that do not.
        feet_hold: speed in m/s up to which a foot does not slide.
        impratio: ratio of the softness of a contact along its normal to that across.
        contact_impedance: least and largest impedance and the depth over which it rises.
        contact_stiffness, contact_damping: of a contact's reference acceleration.
        link_range: shortest and longest length of a link.
        link_impedance, link_stiffness, link_damping: as of contacts.
        links: (links, 2) the rods that each link joins, module by module.
        link_arms: (links, 2) where it meets them, along their axes from the middle.
        link_weight: (links,) its acceleration per force as built, which scales its softness.
        speed_limit: speed in m/s that no rod can reach.
        arena_radius: coordinate in m beyond which no rod can get.
        settled: change of a rod's velocity in m/s in one sweep that does not count.
        most_sweeps: sweeps after which forces are taken as they are.
        apart: (6 m, 6 m) whether two rods pass through each other.
    """

    n_modules: int
    timestep: float
    gravity: float
    stiffness: np.ndarray
    cable_rods: np.ndarray
    cable_anchors: np.ndarray
    cable_rest: float
    cable_damping: float
    servo_gain: float
    servo_offset: float
    servo_limit: float
    servo_damping: float
    inverse_mass: np.ndarray
    inverse_inertia: np.ndarray
    inverse_spin: np.ndarray
    spin: np.ndarray
    axis: np.ndarray
    contact_weight: np.ndarray
    centre_of_mass: tuple[float, float, float]
    half_length: float
    radius: float
    friction: float
    feet: float
    feet_forward: float
    feet_backward: float
    feet_hold: float
    impratio: float
    contact_impedance: tuple[float, float, float]
    contact_stiffness: float
    contact_damping: float
    link_range: tuple[float, float]
    link_impedance: tuple[float, float, float]
    link_stiffness: float
    link_damping: float
    links: np.ndarray
    link_arms: np.ndarray
    link_weight: np.ndarray
    speed_limit: float
    arena_radius: float
    settled: float
    most_sweeps: int
    apart: np.ndarray


def read_model(model: mujoco.MjModel) -> Robot:
    """Read a robot's numbers.

    Raises:
        ValueError: the model has something that the kernel does not know; says what.
    """
    refuse_unknown(model)
    n_rods = _count_rods(model)
    n = n_rods // RODS
    passive, internal, links = _tendons(model, n)
    cables = np.concatenate([passive, internal], axis=1)
    rods, anchors = _anchors(model, cables.ravel())
    rods = rods.reshape(n, CABLES, 2) - RODS * np.arange(n)[:, None, None]
    if rods.min(initial=0) < 0 or rods.max(initial=0) >= RODS:
        raise ValueError("the kernel needs a cable to join two rods of one module")
    link_rods, link_anchors = _anchors(model, links)
    gravity = model.opt.gravity
    if gravity[0] or gravity[1]:
        raise ValueError(f"the kernel needs gravity to be vertical, not {gravity}")
    return Robot(
        n_modules=n,
        timestep=float(model.opt.timestep),
        gravity=-float(gravity[2]),
        stiffness=_stiffness(model, passive),
        cable_rods=same_for_all("the rods that a cable joins", rods).ravel().astype(np.int64),
        cable_anchors=same_for_all("cables' anchors", anchors.reshape(n, -1)),
        cable_rest=float(same_for_all("tendon_lengthspring", model.tendon_lengthspring[passive.ravel()])[1]),
        cable_damping=float(same_for_all("tendon_damping", model.tendon_damping[passive.ravel()])),
        **_servos(model),
        **_rods(model, n),
        **_contacts(model),
        feet=0.0,
        feet_forward=0.0,
        feet_backward=0.0,
        feet_hold=FEET_HOLD,
        **_links(model, links, link_rods, link_anchors),
        speed_limit=math.inf,
        arena_radius=math.inf,
        settled=SETTLED,
        most_sweeps=MOST_SWEEPS,
        apart=_apart(model, n_rods),
    )


def _count_rods(model: mujoco.MjModel) -> int:
    """Return the number of rods; body 0 is the world and the others are rods."""
    n = model.nbody - 1
    if not n or n % RODS:
        raise ValueError(f"the kernel needs modules of {RODS} rods, not {n} bodies")
    if model.njnt != n or model.body_parentid.any() or (model.body_jntnum[1:] != 1).any():
        raise ValueError("the kernel needs every body to hang on a free joint of its own")
    if (model.jnt_qposadr != JOINT * np.arange(n)).any() or (model.body_jntadr[1:] != np.arange(n)).any():
        raise ValueError("the kernel needs joints in the order of the bodies")
    return n


def _tendons(model: mujoco.MjModel, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the ids of passive cables (n, 24), internal ones (n, 5) and links (any number)."""
    internal = model.actuator_trnid[:, 0]
    is_passive = model.tendon_stiffness > 0.0
    is_link = model.tendon_limited.astype(bool)
    kinds = is_passive.astype(int) + is_link + np.bincount(internal, minlength=model.ntendon)
    if (kinds != 1).any():
        raise ValueError(
            "the kernel needs a tendon to be a spring, to have one actuator or to have limits;"
            f" tendon {np.flatnonzero(kinds != 1)[0]} is not one of the three"
        )
    if (model.tendon_damping[~is_passive] != 0.0).any():
        raise ValueError("the kernel needs tendon_damping to be 0 where there is no spring")
    passive = np.flatnonzero(is_passive)
    if len(passive) != n * PASSIVE or len(internal) != n * INTERNAL:
        raise ValueError(f"the kernel needs {PASSIVE} springs and {INTERNAL} actuators in a module")
    return passive.reshape(n, PASSIVE), internal.reshape(n, INTERNAL), np.flatnonzero(is_link)


def _anchors(model: mujoco.MjModel, tendons: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (n, 2) rods and (n, 2, 3) points in their frames where n tendons end."""
    sites = model.wrap_objid[model.tendon_adr[tendons, None] + np.arange(2)]
    return model.site_bodyid[sites] - 1, model.site_pos[sites]


def _stiffness(model: mujoco.MjModel, passive: np.ndarray) -> np.ndarray:
    values = model.tendon_stiffness[passive]
    if (values != values[:, :1]).any():
        raise ValueError("the kernel needs tendon_stiffness to be the same for all springs of a module")
    if (model.tendon_lengthspring[passive, 0] != 0.0).any():
        raise ValueError("the kernel needs springs that only pull: tendon_lengthspring from 0")
    return values[:, 0].copy()


def _servos(model: mujoco.MjModel) -> dict[str, Any]:
    gain = same_for_all("actuator_gainprm", model.actuator_gainprm)
    bias = same_for_all("actuator_biasprm", model.actuator_biasprm)
    lower, upper = same_for_all("actuator_forcerange", model.actuator_forcerange)
    if gain[1:].any() or bias[3:].any() or bias[1] != -gain[0] or upper != 0.0 or not lower < 0.0:
        raise ValueError("the kernel needs an actuator's tension to rise with its length error, from 0 up")
    return {
        "servo_gain": float(gain[0]),
        "servo_offset": -float(bias[0]),
        "servo_limit": -float(lower),
        "servo_damping": -float(bias[2]),
    }


def _rods(model: mujoco.MjModel, n: int) -> dict[str, Any]:
    """Return what is said of the rods of a module."""
    mass, inertia, middle = model.body_mass[1:], model.body_inertia[1:], model.body_ipos[1:]
    # MuJoCo inverts a matrix for it, so that the last digits depend on how a rod lies
    if not np.allclose(model.body_invweight0[1:, 0], 1.0 / mass, rtol=1e-9, atol=0.0):
        raise ValueError("the kernel needs body_invweight0 to be that of free rods")
    modules = np.column_stack([mass, inertia, middle])
    rows = same_for_all("masses of modules", modules.reshape(n, RODS, -1))
    mass, inertia, middle = rows[:, 0], rows[:, 1:4], rows[:, 4:7]
    if middle[1:].any():
        raise ValueError("the kernel needs body_ipos to be 0 for all rods but a module's first")
    axis = inertia.argmin(axis=1)
    rod = np.arange(RODS)
    along, across = inertia[rod, axis], inertia[rod, (axis + 1) % 3]
    if (across != inertia[rod, (axis + 2) % 3]).any():
        raise ValueError("the kernel needs body_inertia to be the same about both axes across a rod")
    if (model.body_geomnum[1:] != 1).any():
        raise ValueError("the kernel needs one geom on every rod")
    geoms = model.body_geomadr[1:]
    if (model.geom_type[geoms] != mujoco.mjtGeom.mjGEOM_CAPSULE).any() or model.geom_pos[geoms].any():
        raise ValueError("the kernel needs a capsule about the middle of every rod")
    for geom, k in zip(geoms, np.tile(axis, n), strict=True):
        matrix = np.empty(9)
        mujoco.mju_quat2Mat(matrix, model.geom_quat[geom])
        if abs(abs(matrix[3 * k + 2]) - 1.0) > _ON_AXIS:
            raise ValueError(f"the kernel needs geom {geom} to lie along its rod")
    size = same_for_all("geom_size of rods", model.geom_size[geoms])
    return {
        "inverse_mass": 1.0 / mass,
        "inverse_inertia": 1.0 / across,
        "inverse_spin": 1.0 / along - 1.0 / across,
        "spin": along - across,
        "axis": axis.astype(np.int64),
        "contact_weight": 1.0 / mass,
        "centre_of_mass": tuple(map(float, middle[0])),
        "half_length": float(size[1]),
        "radius": float(size[0]),
    }


def _contacts(model: mujoco.MjModel) -> dict[str, Any]:
    """Return what is said of all contacts, and refuse a ground that is not the plane z = 0."""
    fixed = model.geom_type[model.geom_bodyid == 0]
    planes = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
    level = [1.0, 0.0, 0.0, 0.0]
    if len(planes) != 1 or model.geom_pos[planes].any() or (model.geom_quat[planes] != level).any():
        raise ValueError("the kernel needs one plane, z = 0")
    if (fixed == mujoco.mjtGeom.mjGEOM_BOX).sum() != len(fixed) - 1:
        raise ValueError("the kernel needs all that stands in the world to be boxes")
    same_for_all("geom_solmix", model.geom_solmix)
    stiffness, damping, impedance = _reference(
        model,
        "geom",
        same_for_all("geom_solref", model.geom_solref),
        same_for_all("geom_solimp", model.geom_solimp),
    )
    return {
        "friction": float(same_for_all("geom_friction", model.geom_friction)[0]),
        "impratio": float(model.opt.impratio),
        "contact_impedance": impedance,
        "contact_stiffness": stiffness,
        "contact_damping": damping,
    }


def _reference(
    model: mujoco.MjModel, what: str, solref: np.ndarray, solimp: np.ndarray
) -> tuple[float, float, tuple[float, float, float]]:
    """Return stiffness and damping of a reference acceleration, and the impedance.

    MuJoCo gives a constraint the dynamics of a spring and a damper with a time constant, of two time steps
    at least, and a damping ratio ("Computation: Constraint model" of its documentation).
    """
    time, ratio = solref
    if not (time > 0.0 and ratio > 0.0):
        raise ValueError(f"the kernel needs {what}_solref to be a time constant and a damping ratio")
    if tuple(solimp[3:]) != (0.5, 2.0):
        raise ValueError(f"the kernel needs {what}_solimp to rise as two parabolas: midpoint 0.5, power 2")
    least, most, width = map(float, solimp[:3])
    if not (0.0 < least <= most < 1.0 and width > 0.0):
        raise ValueError(f"the kernel needs {what}_solimp to rise from above 0 to below 1 over some width")
    time = max(float(time), 2.0 * model.opt.timestep)
    root = 1.0 / (most * time * ratio)
    return float(root * root), 2.0 / (most * time), (least, most, width)


def _links(model: mujoco.MjModel, links: np.ndarray, rods: np.ndarray, anchors: np.ndarray) -> dict[str, Any]:
    """Return what is said of links."""
    if len(np.unique(rods)) != rods.size:
        raise ValueError("the kernel needs a rod to have one link at most")
    axis = np.abs(anchors).argmax(axis=2)[..., None]
    arms = np.take_along_axis(anchors, axis, axis=2)[..., 0]
    across = anchors.copy()
    np.put_along_axis(across, axis, 0.0, axis=2)
    inertia_axis = model.body_inertia[rods + 1].argmin(axis=2)
    if np.abs(across).max(initial=0.0) > _ON_AXIS or (axis[..., 0] != inertia_axis).any():
        raise ValueError("the kernel needs links to end on the axes of rods")
    if len(links):
        limits = same_for_all("tendon_range", model.tendon_range[links])
        stiffness, damping, impedance = _reference(
            model,
            "tendon",
            same_for_all("tendon_solref_lim", model.tendon_solref_lim[links]),
            same_for_all("tendon_solimp_lim", model.tendon_solimp_lim[links]),
        )
    else:
        limits, stiffness, damping, impedance = np.zeros(2), 0.0, 0.0, (0.5, 0.5, 1.0)
    return {
        "link_range": (float(limits[0]), float(limits[1])),
        "link_impedance": impedance,
        "link_stiffness": stiffness,
        "link_damping": damping,
        "links": rods.astype(np.int64),
        "link_arms": arms,
        "link_weight": _link_weights(model, links, rods, anchors),
    }


def _link_weights(
    model: mujoco.MjModel, links: np.ndarray, rods: np.ndarray, anchors: np.ndarray
) -> np.ndarray:
    """Return the links' accelerations per force as built, (n,): MuJoCo's ``tendon_invweight0``.

    MuJoCo factorises a matrix for it. Here the order of all sums is known.
    """
    poses, bodies = model.qpos0.reshape(-1, JOINT), rods.ravel()
    ends = points_on(poses, bodies, anchors.reshape(-1, 3)).reshape(-1, 2, 3)
    middles = points_on(poses, bodies, model.body_ipos[1 + bodies]).reshape(-1, 2, 3)
    along = ends[:, 1] - ends[:, 0]
    moments = np.cross(ends - middles, (along / length(along)[:, None])[:, None])
    weights = np.zeros(len(links))
    for side in range(2):
        rows = rotation_rows(poses[rods[:, side], 3:])
        inertia = model.body_inertia[1 + rods[:, side]]
        weights += 1.0 / model.body_mass[1 + rods[:, side]]
        for axis in range(3):
            own = sum(row[axis] * moments[:, side, i] for i, row in enumerate(rows))
            weights += own * own / inertia[:, axis]
    if not np.allclose(weights, model.tendon_invweight0[links], rtol=1e-9, atol=0.0):
        raise ValueError("the kernel needs tendon_invweight0 to be that of the robot as built")
    return weights


def _apart(model: mujoco.MjModel, n_rods: int) -> np.ndarray:
    """Return which rods pass through each other, (rods, rods)."""
    apart = np.zeros((n_rods, n_rods), bool)
    for signature in model.exclude_signature:
        a, b = (int(signature) >> 16) - 1, (int(signature) & 0xFFFF) - 1
        if min(a, b) < 0:
            raise ValueError("the kernel needs excluded contacts to be between rods")
        apart[a, b] = apart[b, a] = True
    return apart
