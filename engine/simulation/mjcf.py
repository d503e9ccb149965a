"""Robots as MJCF text, for any program that reads it."""

from __future__ import annotations

import mujoco
import numpy as np


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
