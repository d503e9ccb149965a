"""States that MuJoCo's Newton passes through, and what it makes of each; and lanes to put them in."""

from __future__ import annotations

import copy
import dataclasses

import mujoco
import numpy as np

from engine.body import servo
from engine.body.morphology import Morphology
from engine.simulation.kernel import guard
from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.physics.state import forget, new_state
from engine.simulation.kernel.physics.walls import place_walls
from engine.simulation.kernel.robots.model import model_of
from engine.simulation.kernel.step import run
from engine.simulation.model import build_robot, with_walls
from engine.simulation.physics import Physics
from engine.tasks.walls import Wall

PHYSICS = Physics()
EVERY = 2
"""Control updates from one recorded state to the next."""


@dataclasses.dataclass
class Recorded:
    """N states: before and after one step, the commands, and how many contacts of each kind there are."""

    qpos: np.ndarray
    qvel: np.ndarray
    ctrl: np.ndarray
    next_qpos: np.ndarray
    next_qvel: np.ndarray
    on_ground: np.ndarray
    on_walls: np.ndarray
    of_rods: np.ndarray


def newton(model, tolerance=1e-14):
    """Return a model that MuJoCo solves as exactly as it can."""
    exact = copy.copy(model)
    exact.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
    exact.opt.tolerance, exact.opt.iterations = tolerance, 200
    exact.opt.ls_tolerance, exact.opt.ls_iterations = 1e-4, 100
    return exact


def commands(n_modules, n_updates, seed, released=25):
    """Return (updates, modules x 5) noisy commands: servos off at first, then a gait every two seconds."""
    rng = np.random.default_rng(seed)
    lengths = np.ones((n_updates, n_modules, 5))
    for u in range(released, n_updates):
        if (u - released) % 100 == 0:
            frequency, phase = rng.choice(servo.FREQUENCIES, n_modules), rng.choice(servo.PHASES, n_modules)
        lengths[u] = servo.target_lengths(servo.command_angle(frequency, phase, 0.02 * u))
        lengths[u] += rng.normal(size=(n_modules, 5)) * PHYSICS.servo_noise
    return lengths.reshape(n_updates, -1)


def record(robot, walls, seconds, seed):
    """Let a robot fall and crawl, and record states within control updates, the fall among them."""
    model = newton(with_walls(robot, walls))
    data = mujoco.MjData(model)
    rows = []
    for u, control in enumerate(commands(robot.n_modules, round(50 * seconds), seed)):
        data.ctrl[:] = control
        for s in range(PHYSICS.steps_per_control):
            before = data.qpos.copy(), data.qvel.copy(), control
            mujoco.mj_step(model, data)
            if s == 3 and u % EVERY == 0:
                kinds = model.geom_type[data.contact.geom].reshape(-1, 2)
                ground, box = (
                    (kinds == k).any(axis=1).sum()
                    for k in (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_BOX)
                )
                after = data.qpos.copy(), data.qvel.copy()
                rows.append((*before, *after, ground, box, len(kinds) - ground - box))
    return Recorded(*map(np.array, zip(*rows, strict=True)))


def stepped(robot, walls, recorded, **settings):
    """Return the velocities after one step of the kernel from every recorded state, with no forces known."""
    model = model_of([guard.read_robot(robot)._replace(**settings)] * 8)
    width = 8
    state = new_state(model, n_walls=len(walls))
    for lane in range(width):
        place_walls(state, lane, walls)
    rods = simd.by_lane(state.rods).reshape(-1, 13, width)
    out = np.empty_like(recorded.qvel)
    n = len(out)
    for start in range(0, n, width):
        some = np.minimum(np.arange(start, start + width), n - 1)
        rods[:, :7] = recorded.qpos[some].reshape(width, -1, 7).transpose(1, 2, 0)
        rods[:, 7:] = recorded.qvel[some].reshape(width, -1, 6).transpose(1, 2, 0)
        simd.by_lane(state.commanded)[:] = recorded.ctrl[some].T
        for force in (state.link_force, state.contact_force, state.pair_force):
            simd.by_lane(force)[:] = 0.0
        forget(state)
        run(model, state, 1)
        out[some] = rods[:, 7:].transpose(2, 0, 1).reshape(width, -1)
    return out


def of_centres(qvel):
    """Return the velocities of rods' middles of (..., 6 x rods) generalised velocities, in m/s."""
    return qvel.reshape(*qvel.shape[:-1], -1, 6)[..., :3]


FREE = build_robot(Morphology(1, (2, 5, 1, 6, 8)), PHYSICS)
"""Soft, so that its rods touch each other."""
BETWEEN = build_robot(Morphology(5, (5, 6)), PHYSICS)
GATE = (
    Wall(centre=(0.02, 0.068, 0.06), half_size=(0.2, 0.02, 0.06), yaw=0.1),
    Wall(centre=(0.02, -0.068, 0.06), half_size=(0.2, 0.02, 0.06), yaw=-0.05),
)
ACROSS = build_robot(Morphology(3, (3, 7, 1)), PHYSICS)
FOOTED = build_robot(Morphology(3, (3, 7, 1), (), "start"), PHYSICS)
"""The same with feet that grip one way."""
STEPS = (
    Wall(centre=(0.05, 0.0, 0.01), half_size=(0.02, 0.03, 0.012), yaw=0.5),
    Wall(centre=(0.2, 0.02, 0.005), half_size=(0.01, 0.2, 0.012), yaw=0.2),
    Wall(centre=(-0.04, 0.0, 0.1), half_size=(0.01, 0.02, 0.1), yaw=1.0),
)
"""Two low ones that the robot falls on and one that it falls into."""
