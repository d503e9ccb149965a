"""What the kernel knows of MuJoCo's models; a model with anything else is refused by name.

Every field of MuJoCo's models and options is in one of five groups: those that the kernel reads
(``parameters`` checks them where it reads them), those that must have one value, objects of which there must
be none, those that MuJoCo works out from others, and those that change no motion. A test compares the groups
with what the installed MuJoCo has, so that a release which adds something does not go unnoticed.
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
    "nhistory": "delayed controls",
    "nplastic": "plastic springs",
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
"""The value that an option must have."""

READ_OPTIONS: Final = ("timestep", "gravity", "impratio")
"""Options that ``parameters`` reads."""

IDLE_OPTIONS: Final = (
    "solver iterations tolerance ls_iterations ls_tolerance jacobian ccd_iterations ccd_tolerance"
    " noslip_tolerance sdf_initpoints sdf_iterations sleep_tolerance wind magnetic o_margin o_solref"
    " o_solimp o_friction"
).split()
"""Options that change no motion while the others have their values, or only how exactly MuJoCo solves."""

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
    "geom_plugin": -1,
    "tendon_num": 2,
    "tendon_type": int(mujoco.mjtTendon.mjTENDON_SPATIAL),
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
    "actuator_ctrlnum": 1,
    "actuator_ctrlspec": 0,
    "actuator_outnum": 1,
    "actuator_plugin": -1,
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
    " body_geomadr jnt_qposadr geom_type geom_bodyid geom_size geom_pos geom_quat geom_friction"
    " geom_solref geom_solimp geom_solmix tendon_adr tendon_limited tendon_range tendon_solref_lim"
    " tendon_solimp_lim tendon_stiffness tendon_damping tendon_lengthspring tendon_invweight0 wrap_objid"
    " site_bodyid site_pos qpos0 actuator_trnid actuator_gainprm actuator_biasprm actuator_forcerange"
    " exclude_signature"
).split()
"""Fields that ``parameters`` reads."""

BEGINNINGS: Final = (
    "eq_ flex_ flexedge_ mesh_ hfield_ pair_ plugin cam_ light_ mat_ tex_ skin_ key_ numeric_ text_"
    " tuple_ sensor_ name_ names nuser_ bvh_ oct_ efm0_ efmC_ tree_ ten_J_ B_ D_ M_ map"
).split()
"""How the names of fields begin that belong to objects of which there is none or which push nothing, such as
lights, and to MuJoCo's indices into its matrices and bounding volumes."""

DERIVED: Final = (
    "body_bvhadr body_bvhnum body_conaffinity body_contype body_dofadr body_dofnum body_rootid"
    " body_sameframe body_simple body_subtreemass body_treeid body_weldid body_margin dof_M0 dof_Madr"
    " dof_bodyid dof_jntid dof_invweight0 dof_length dof_parentid dof_simplenum dof_treeid jnt_bodyid"
    " jnt_dofadr jnt_actuatorid geom_aabb geom_rbound geom_sameframe site_sameframe tendon_actuatorid"
    " tendon_length0 tendon_treeid tendon_treenum actuator_acc0 actuator_length0 actuator_ctrladr"
    " actuator_outadr flg_adhesion flg_gravcomp flg_surfacevel ngravcomp signature nq nv nu nout nactuator"
    " nbody njnt ngeom nsite ntendon nwrap nexclude ntree nM nB nC nD nJten nJmom nJfe nbvh nbvhstatic"
    " nbvhdynamic noct nefm0L nefm0dof nefmCvert nnames nnames_map npaths narena nbuffer nemax npolygonmax"
).split()
"""Fields that MuJoCo works out from others when it compiles a model."""

IDLE: Final = (
    "body_pos body_quat body_mocapid body_plugin body_user jnt_pos jnt_axis jnt_range jnt_group jnt_user"
    " jnt_solref jnt_solimp jnt_actfrcrange jnt_actgravcomp jnt_plasticadr jnt_springyield dof_solref"
    " dof_solimp qpos_spring geom_dataid geom_group geom_matid geom_rgba geom_castshadow geom_user"
    " site_dataid site_group site_matid site_quat site_rgba site_size site_type site_user"
    " tendon_actfrcrange tendon_group tendon_matid tendon_plasticadr tendon_rgba tendon_solimp_fri"
    " tendon_solref_fri tendon_springyield tendon_user tendon_width wrap_prm actuator_actadr"
    " actuator_actearly actuator_actlimited actuator_actnum actuator_actrange actuator_cranklength"
    " actuator_ctrlrange actuator_dynprm actuator_group actuator_history actuator_historyadr"
    " actuator_lengthrange actuator_user stat vis paths nuserdata nconmax njmax ncam nlight nmat ntex"
    " ntexdata nkey nnumeric nnumericdata ntext ntextdata ntuple ntupledata nsensor nsensordata nskin"
    " nskinbone nskinbonevert nskinface nskintexvert nskinvert nflexbending nflexedge nflexelem"
    " nflexelemdata nflexelemedge nflexnode nflexshelldata nflexstiffness nflextexcoord nflexvert"
    " nhfielddata nmeshdegmax nmeshface nmeshgraph nmeshnormal nmeshpoly nmeshpolymap nmeshpolyvert"
    " nmeshtexcoord nmeshvert npluginattr npluginstate"
).split()
"""Fields that change no motion while the others are as they must be, and counts of objects that push nothing.

A free joint has neither axis nor limits; springs, plasticity and activations are switched off above."""


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
