"""The simulations of a roll-out as observers see them, and as MuJoCo would hold them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from engine.simulation.divergence import Failure
from engine.simulation.kernel.lanes.simd import by_lane
from engine.simulation.kernel.physics.state import ROD, State
from engine.simulation.kernel.robots.parameters import INTERNAL, RODS
from engine.simulation.model import RobotModel, with_walls
from engine.simulation.physics import Physics
from engine.tasks.walls import Wall


class KernelSimulations:
    """Simulations at one moment, with the interface of ``engine.simulation.batch.SimulationBatch``.

    Args:
        robots: their models.
        states: the lanes that hold the simulations, robot by robot; spare lanes come last.
        copies: simulations per robot.
        physics: control period.
        n_updates: control updates since the drop.
        walls: per robot and copy the walls in the world.
        failures: robot by robot, why each simulation was stopped, or None.
    """

    def __init__(
        self,
        robots: Sequence[RobotModel],
        states: Sequence[State],
        *,
        copies: int,
        physics: Physics,
        n_updates: int,
        walls: Sequence[Sequence[tuple[Wall, ...]]],
        failures: list[Failure | None],
    ) -> None:
        self.shape = (len(robots), copies)
        self.n_modules = robots[0].n_modules
        self.n_updates = n_updates
        self.failures = failures
        self._robots = robots
        self._states = states
        self._physics = physics
        self._walls = walls
        self._models: dict[int, mujoco.MjModel] = {}

    @property
    def time(self) -> float:
        """Seconds since the robots were dropped."""
        return self.n_updates * self._physics.control_period

    @property
    def alive(self) -> np.ndarray:
        """(robots, copies) whether a simulation goes on."""
        return np.array([f is None for f in self.failures]).reshape(self.shape)

    @property
    def qpos(self) -> np.ndarray:
        """(robots, copies, 7 x rods) generalised coordinates, in MuJoCo's order."""
        return self._rods()[..., :7].reshape(*self.shape, -1)

    @property
    def commanded(self) -> np.ndarray:
        """(robots, copies, modules, 5) commanded lengths of the internal cables, in m."""
        return self._lanes("commanded").reshape(*self.shape, self.n_modules, INTERNAL)

    def all_rods(self) -> np.ndarray:
        """Return (robots, copies, modules, 6, 3) centres of all rods, in m."""
        return self._rods()[..., :3].reshape(*self.shape, self.n_modules, RODS, 3)

    def model(self, i: int) -> mujoco.MjModel:
        """Return the MuJoCo model of a simulation, robot by robot, which must not be changed."""
        if i not in self._models:
            r, copy = divmod(i, self.shape[1])
            self._models[i] = with_walls(self._robots[r], self._walls[r][copy])
        return self._models[i]

    def state(self) -> np.ndarray:
        """Return the (robots, copies, n) complete states of MuJoCo (``mjSTATE_INTEGRATION``)."""
        rods = self._rods().reshape(-1, self.n_modules * RODS, ROD)
        commanded = self.commanded.reshape(len(rods), -1)
        states = [
            mujoco_state(self.model(i), rods[i], commanded[i], self.time) for i in range(len(self.failures))
        ]
        return np.array(states).reshape(*self.shape, -1)

    def _rods(self) -> np.ndarray:
        return self._lanes("rods").reshape(*self.shape, -1, ROD)

    def _lanes(self, field: str) -> np.ndarray:
        """Return the (robots, copies, n) numbers of a field of all simulations."""
        numbers = np.concatenate([by_lane(getattr(s, field)).T for s in self._states])
        n_robots, copies = self.shape
        return numbers[: n_robots * copies].reshape(n_robots, copies, -1)


def mujoco_state(model: mujoco.MjModel, rods: np.ndarray, commanded: np.ndarray, time: float) -> np.ndarray:
    """Return MuJoCo's complete state (``mjSTATE_INTEGRATION``) of a simulation of the kernel.

    It has no warm start for MuJoCo's solver: the kernel keeps forces, MuJoCo accelerations.

    Args:
        model: of the robot in its world.
        rods: (rods, 13) their states.
        commanded: (modules x 5,) commanded lengths in m.
        time: seconds since the drop.
    """
    data = mujoco.MjData(model)
    data.time = time
    data.qpos[:] = rods[:, :7].ravel()
    data.qvel[:] = rods[:, 7:].ravel()
    data.ctrl[:] = commanded
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return state


def wall_of(placed: Any) -> Wall:
    """Return a wall from the kernel's numbers: centre, half sizes, cosine and sine of its yaw."""
    x, y, z, *sizes, cosine, sine = map(float, placed)
    return Wall(centre=(x, y, z), half_size=(sizes[0], sizes[1], sizes[2]), yaw=math.atan2(sine, cosine))
