"""How simulated robots move through the air and over the ground: contact, heights, speeds."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np

from engine.simulation.batch import SimulationBatch
from engine.simulation.model import Physics, RobotModel


@dataclasses.dataclass(frozen=True, slots=True)
class Motion:
    """What the modules of some simulations did at worst; a module's centre is its rods' mean.

    Failed simulations count until they fail; everything is 0 if nothing was seen.

    Attributes:
        airborne: share of the control updates, 0 to 1, at which no rod touched the ground.
        height: largest height of a module's centre above the ground, in m.
        speed: largest speed of a module's centre, in m/s, over one control period.
        final_speed: the same, over the last control period that was observed.
    """

    airborne: float
    height: float
    speed: float
    final_speed: float


class MotionRecorder:
    """An observer of simulations, of one batch after another, of robots of one size.

    A rod is a capsule and the ground a plane, so a rod touches the ground exactly when the lower end of
    its capsule lies below it; MuJoCo uses the same criterion.

    Args:
        robot: any of the robots; their rods are alike.
        physics: of the simulations.
    """

    def __init__(self, robot: RobotModel, physics: Physics) -> None:
        model = robot.model
        geoms = model.body_geomadr[robot.rod_bodies]
        assert (model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_CAPSULE).all()
        matrix = np.empty((*geoms.shape, 9))
        for index in np.ndindex(*geoms.shape):
            mujoco.mju_quat2Mat(matrix[index], model.geom_quat[geoms[index]])
        self._middle = model.geom_pos[geoms]
        # a capsule lies along the z axis of its geom; both in the frame of the rod
        self._half = matrix.reshape(*geoms.shape, 3, 3)[..., 2] * model.geom_size[geoms, 1, None]
        self._radius = model.geom_size[geoms, 0]
        self._period = physics.control_period
        self._sim: SimulationBatch | None = None
        self._centres = np.empty(0)
        self._n_airborne = 0
        self._n_seen = 0
        self._height = 0.0
        self._speed = 0.0
        self._final_speed = 0.0

    def __call__(self, sim: SimulationBatch) -> None:
        """Look at every simulation of a batch that has not failed."""
        alive = np.array([f is None for f in sim.failures])
        pose = sim.qpos.reshape(len(alive), sim.n_modules, -1, 7)
        self._n_seen += int(alive.sum())
        self._n_airborne += int((alive & (self._lowest(pose) >= 0.0)).sum())
        centres = pose[..., :3].mean(axis=2)
        if alive.any():
            self._height = max(self._height, float(centres[alive, :, 2].max()))
        # a new batch starts from rest
        if sim is self._sim and alive.any():
            moved = np.linalg.norm(centres[alive] - self._centres[alive], axis=-1)
            self._final_speed = float(moved.max()) / self._period
            self._speed = max(self._speed, self._final_speed)
        self._sim, self._centres = sim, centres

    def motion(self) -> Motion:
        """Return what was seen so far."""
        return Motion(
            airborne=self._n_airborne / max(1, self._n_seen),
            height=self._height,
            speed=self._speed,
            final_speed=self._final_speed,
        )

    def _lowest(self, pose: np.ndarray) -> np.ndarray:
        """Return the (n,) heights in m of the lowest points of n robots.

        Args:
            pose: (n, modules, 6, 7) positions and quaternions of the rods.
        """
        w, x, y, z = np.moveaxis(pose[..., 3:], -1, 0)
        # what turns a point of a rod's frame into its height above the rod's middle
        up = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=-1)
        middle = pose[..., 2] + (up * self._middle).sum(axis=-1)
        return (middle - np.abs((up * self._half).sum(axis=-1)) - self._radius).min(axis=(1, 2))
