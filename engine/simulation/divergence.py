"""Tells simulations that have diverged from healthy ones, after every control update.

Judging 64 simulations of six modules takes 0.07 to 0.09 ms, less than 0.3 % of the time that their update
takes.
"""

from __future__ import annotations

import dataclasses
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
        # MuJoCo resets a simulation after a warning, so its state is meaningless
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

    Where each module has its own stiffness, all are assumed to give as much energy as the stiffest.
    """
    model, data = robot.model, mujoco.MjData(robot.model)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_energyPos(model, data)
    pull = (np.abs(model.actuator_forcerange).max(axis=1) * data.actuator_length).sum()
    cables = model.tendon_stiffness[model.tendon_stiffness > 0.0]
    stiffest = cables.max() / cables.mean()
    energy = stiffest * (data.energy[0] + pull) / robot.n_modules
    lightest = model.body_mass[robot.rod_bodies].min()
    return float(np.sqrt(2.0 * energy / lightest))


BLOCK: Final = 50
"""Control updates between two complete states that are kept, 1 s by default.

Keeping the commands of every update and a complete state once a block, instead of a complete state of every
update, costs a tenth of the time and a twentieth of the memory: 2.7 MB for 64 simulations of six modules.
From such a state MuJoCo repeats the rest bit for bit.
"""
MAX_UPDATES: Final = 2 * BLOCK
"""Largest number of control updates that a failure keeps."""


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Failure:
    """A simulation that was stopped, and its last K control updates; K is at most ``MAX_UPDATES``.

    Attributes:
        reason: why, in a few words.
        n_updates: control updates since the drop, the last one included.
        state: (n,) the complete state (``mjSTATE_INTEGRATION``) before those K updates.
        controls: (K, modules x 5) commanded lengths of the internal cables at each of them, in m, in
            the order of the actuators.
    """

    reason: str
    n_updates: int
    state: np.ndarray
    controls: np.ndarray

    def __str__(self) -> str:
        return self.reason


class History:
    """The history of a batch: the last one to two blocks of every simulation.

    Args:
        n_simulations: in the batch.
        n_state: size of a complete state.
        n_controls: size of the controls.
    """

    def __init__(self, n_simulations: int, n_state: int, n_controls: int) -> None:
        self._states = np.zeros((2, n_simulations, n_state))
        self._controls = np.zeros((MAX_UPDATES, n_simulations, n_controls))
        self._first = 0

    def remember(self, n_updates: int, state: np.ndarray, controls: np.ndarray) -> None:
        """Keep the states and controls that the next control update starts from.

        Args:
            n_updates: control updates so far.
            state: (simulations, n) complete states before it.
            controls: (simulations, modules x 5) its controls.
        """
        if n_updates % BLOCK == 0 or n_updates == self._first:
            self._states[n_updates // BLOCK % 2] = state
        self._controls[n_updates % MAX_UPDATES] = controls

    def begin(self, n_updates: int) -> None:
        """Forget everything before a control update, because the world changes there."""
        self._first = n_updates

    def branch(self, other: History, copies: int) -> None:
        """Take over another history; each of its simulations continues in several copies."""
        self._first = other._first
        self._states[:] = np.repeat(other._states, copies, axis=1)
        self._controls[:] = np.repeat(other._controls, copies, axis=1)

    def failure(self, i: int, n_updates: int, reason: str) -> Failure:
        """Return the failure of a simulation with its last control updates.

        Args:
            i: the simulation.
            n_updates: control updates since the drop, the last one included.
            reason: why it failed.
        """
        block = max((n_updates - 1) // BLOCK - 1, self._first // BLOCK)
        rows = np.arange(max(block * BLOCK, self._first), n_updates) % MAX_UPDATES
        return Failure(reason, n_updates, self._states[block % 2, i].copy(), self._controls[rows, i])
