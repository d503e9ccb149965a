"""What the kernel knows of MuJoCo's models; a model with anything else is refused by name.

MuJoCo's fields are in four groups: those that the kernel reads (``parameters`` checks them where it reads
them), those that must have one value, objects of which there must be none, and those that change no motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import mujoco
import numpy as np

NONE_OF: Final = {
    "neq": "equality constraints",
    "nflex": "flexible bodies",
    "nmesh": "meshes",
    "nhfield": "height fields",
    "nplugin": "plugins",
    "nmocap": "mocap bodies",
    "na": "activation states",
    "npair": "contact pairs of its own",
}
"""Objects that the kernel does not know, by the field that counts them."""

OPTIONS: Final[Mapping[str, object]] = {
    "integrator": int(mujoco.mjtIntegrator.mjINT_EULER),
    "cone": int(mujoco.mjtCone.mjCONE_ELLIPTIC),
    "disableflags": 0,
    "enableflags": 0,
    "disableactuator": 0,
    "noslip_iterations": 0,
    "density": 0.0,
    "viscosity": 0.0,
}
"""The value that an option must have. Of the others, only ``timestep``, ``gravity`` and ``impratio`` matter:
they are read; a solver's choice and tolerances are MuJoCo's own."""

FIELDS: Final[Mapping[str, object]] = {
    "body_gravcomp": 0.0,
    "body_iquat": (1.0, 0.0, 0.0, 0.0),
    "jnt_type": int(mujoco.mjtJoint.mjJNT_FREE),
    "jnt_stiffness": 0.0,
    "jnt_stiffnesspoly": 0.0,
    "jnt_limited": 0,
    "jnt_actfrclimited": 0,
    "jnt_margin": 0.0,
    "dof_armature": 0.0,
    "dof_damping": 0.0,
    "dof_dampingpoly": 0.0,
    "dof_frictionloss": 0.0,
    "geom_contype": 1,
    "geom_conaffinity": 1,
    "geom_condim": 3,
    "geom_priority": 0,
    "geom_margin": 0.0,
    "geom_gap": 0.0,
    "geom_adhesion": 0.0,
    "geom_surfacevel": 0.0,
    "geom_fluid": 0.0,
    "tendon_num": 2,
    "tendon_margin": 0.0,
    "tendon_armature": 0.0,
    "tendon_frictionloss": 0.0,
    "tendon_stiffnesspoly": 0.0,
    "tendon_dampingpoly": 0.0,
    "tendon_actfrclimited": 0,
    "wrap_type": int(mujoco.mjtWrap.mjWRAP_SITE),
    "actuator_trntype": int(mujoco.mjtTrn.mjTRN_TENDON),
    "actuator_gaintype": int(mujoco.mjtGain.mjGAIN_FIXED),
    "actuator_biastype": int(mujoco.mjtBias.mjBIAS_AFFINE),
    "actuator_dyntype": int(mujoco.mjtDyn.mjDYN_NONE),
    "actuator_ctrllimited": 0,
    "actuator_forcelimited": 1,
    "actuator_armature": 0.0,
    "actuator_damping": 0.0,
    "actuator_dampingpoly": 0.0,
    "actuator_delay": 0.0,
    "actuator_gear": (1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
}
"""The value that a field must have for every object; fields that this MuJoCo lacks are left out.

A joint's springs, limits and plasticity do nothing while these hold, nor do a tendon's or an actuator's."""

READ: Final = (
    "body_mass body_inertia body_ipos body_invweight0 body_parentid body_jntnum body_jntadr body_geomnum"
    " body_geomadr jnt_qposadr geom_type geom_bodyid geom_size geom_pos geom_quat geom_friction geom_solref"
    " geom_solimp geom_solmix tendon_adr tendon_limited tendon_range tendon_solref_lim tendon_solimp_lim"
    " tendon_stiffness tendon_damping tendon_lengthspring tendon_invweight0 wrap_objid site_bodyid site_pos"
    " actuator_trnid actuator_gainprm actuator_biasprm actuator_forcerange exclude_signature"
).split()
"""Fields that ``parameters`` reads."""


def refuse_unknown(model: mujoco.MjModel) -> None:
    """Refuse a model with an object, an option or a value that the kernel does not know.

    Raises:
        ValueError: names the first of them.
    """
    for field, what in NONE_OF.items():
        if getattr(model, field, 0):
            raise ValueError(f"the kernel knows no {what}; the model has {getattr(model, field)}")
    for field, wanted in OPTIONS.items():
        if (value := getattr(model.opt, field, wanted)) != wanted:
            raise ValueError(f"the kernel needs option {field} to be {wanted}, not {value}")
    for field, wanted in FIELDS.items():
        values = getattr(model, field, None)
        if values is None or not len(values):
            continue
        rows = np.asarray(values).reshape(len(values), -1)
        bad = np.flatnonzero((rows != np.asarray(wanted)).any(axis=1))
        if len(bad):
            raise ValueError(
                f"the kernel needs {field} to be {wanted}; of number {bad[0]} it is {rows[bad[0]]}"
            )


def same_for_all(name: str, values: Any) -> Any:
    """Return the value that all rows of an array have.

    Raises:
        ValueError: they differ, or there is none; names the field.
    """
    values = np.asarray(values)
    if not len(values) or (values != values[0]).any():
        raise ValueError(f"the kernel needs {name} to be the same for all")
    return values[0]
