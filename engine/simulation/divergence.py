"""Tells simulations that have diverged from healthy ones, after every control update.

Judging 64 simulations of six modules takes 0.07 to 0.09 ms, less than 0.3 % of what simulating their
update does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np

from engine.simulation.model import RobotModel

ARENA_RADIUS: Final = 10.0
"""A rod whose x, y or z is further than this from the origin, in m, means that a simulation has diverged."""

_WARNINGS: Final = {
    mujoco.mjtWarning.mjWARN_BADCTRL.value: "a control was not finite",
    mujoco.mjtWarning.mjWARN_BADQPOS.value: "MuJoCo met a position that is not finite or huge",
    mujoco.mjtWarning.mjWARN_BADQVEL.value: "MuJoCo met a velocity that is not finite or huge",
    mujoco.mjtWarning.mjWARN_BADQACC.value: "MuJoCo met an acceleration that is not finite or huge",
}
"""What each of MuJoCo's divergence warnings means, in the order in which a cause leads to the next."""
_WARNING_IDS: Final = list(_WARNINGS)


class Guard:
    """Judges the states of simulations of robots of one size.

    Args:
        robots: the model of every simulation.
    """

    def __init__(self, robots: Sequence[RobotModel]) -> None:
        limits = {id(r): speed_limit(r) for r in robots}
        self.speed_limits = np.array([limits[id(r)] for r in robots])
        """(simulations,) speeds in m/s that no rod can reach."""
        self._squared_limits = self.speed_limits**2

    def judge(
        self, qpos: np.ndarray, qvel: np.ndarray, warnings: np.ndarray, among: np.ndarray
    ) -> dict[int, str]:
        """Return what is wrong with each simulation that has diverged, by its index.

        Args:
            qpos: (simulations, 7 x rods) generalised coordinates; every rod has one free joint.
            qvel: (simulations, 6 x rods) generalised velocities.
            warnings: (simulations, mjNWARNING) how often MuJoCo gave each of its warnings.
            among: (simulations,) whether a simulation is to be judged.
        """
        position = qpos.reshape(len(qpos), -1, 7)[..., :3]
        velocity = qvel.reshape(len(qvel), -1, 6)[..., :3]
        with np.errstate(all="ignore"):
            reach = np.abs(position).max(axis=(1, 2))
            speed = np.einsum("srk,srk->sr", velocity, velocity).max(axis=1)
            # a sum of squares is finite only if everything in it is
            size = np.einsum("sk,sk->s", qpos, qpos) + np.einsum("sk,sk->s", qvel, qvel)
            # NaN compares as false
            good = (reach < ARENA_RADIUS) & (speed <= self._squared_limits) & np.isfinite(size)
        good &= ~warnings[:, _WARNING_IDS].any(axis=1)
        return {
            int(i): self._reason(int(i), reach[i], speed[i], size[i], warnings[i])
            for i in np.flatnonzero(~good & among)
        }

    def _reason(self, i: int, reach: float, speed: float, size: float, warnings: np.ndarray) -> str:
        # MuJoCo resets a simulation after a warning, so that its state says nothing any more
        for warning, meaning in _WARNINGS.items():
            if warnings[warning]:
                return meaning
        if not np.isfinite(size):
            return "the state is not finite"
        if not reach < ARENA_RADIUS:
            return f"a rod is {reach:.1f} m from the origin, outside the arena"
        return f"a rod moves at {speed**0.5:.1f} m/s, impossible above {self.speed_limits[i]:.1f} m/s"


def speed_limit(robot: RobotModel) -> float:
    """Return a speed in m/s that no rod of a robot can reach.

    It is the speed of the lightest rod if it alone carried all the energy that one module can give: its
    potential energy as built, when the cables are stretched more than they ever are again, and one full
    pull of its internal cables. Inertia is scaled, energy is not, so the limit falls with the root of
    ``inertia_scale``: at the default of 10 it is from 8.3 to 18.2 m/s, depending on the stiffness, while
    healthy rods reach 2.4 m/s when the built module is let go and 0.6 m/s when it crawls.

    Where each module has its own stiffness, every one is taken to have the stiffest one's share.
    """
    model, data = robot.model, mujoco.MjData(robot.model)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_energyPos(model, data)
    pull = np.abs(model.actuator_forcerange).max(axis=1) @ data.actuator_length
    cables = model.tendon_stiffness[model.tendon_stiffness > 0.0]
    stiffest = cables.max() / cables.mean()
    energy = stiffest * (data.energy[0] + pull) / robot.n_modules
    lightest = model.body_mass[robot.rod_bodies].min()
    return float(np.sqrt(2.0 * energy / lightest))
