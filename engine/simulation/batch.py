"""Many simulations side by side, on the threads of this machine."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from typing import Final, Protocol, Self

import mujoco
import numpy as np
from mujoco import batch

from engine.simulation.divergence import Failure, Guard, History
from engine.simulation.model import RobotModel
from engine.simulation.physics import Physics


class SimulationBatch:
    """Robots with the same number of modules, each simulated in several copies.

    A simulation that diverges is stopped and its failure kept; the others are not affected.

    Args:
        robots: the compiled robots.
        copies: simulations per robot.
        physics: time step and control period.
        n_threads: threads inside MuJoCo.
        models: the model of every simulation, robot by robot, in worlds with equally many walls; by
            default the robots' own.
    """

    def __init__(
        self,
        robots: Sequence[RobotModel],
        *,
        copies: int,
        physics: Physics,
        n_threads: int,
        models: Sequence[mujoco.MjModel] | None = None,
    ) -> None:
        self._same_world = models is None
        models = [r.model for r in robots for _ in range(copies)] if models is None else models
        self._models = models
        self._batch = batch.Batch(models[0], len(models), n_threads)
        self._batch.set_models(models)
        self._batch.reset()
        self._physics = physics
        self.shape = (len(robots), copies)
        self.n_modules = robots[0].n_modules
        # all robots of a size number their bodies alike; each has one free joint of 7 coordinates
        columns = robots[0].model.jnt_qposadr[robots[0].model.body_jntadr[robots[0].rod_bodies]]
        self._xyz = columns[..., None] + np.arange(3)
        self._qpos = self._batch.bind("qpos")
        self._qvel = self._batch.bind("qvel")
        self._ctrl = self._batch.bind("ctrl")
        self._guard = Guard([r for r in robots for _ in range(copies)])
        self._history = History(self._batch.nsim, self._batch.nstate, self._ctrl.shape[1])
        self.failures: list[Failure | None] = [None] * self._batch.nsim
        """Why each simulation was stopped, None for those that go on; robot by robot."""
        self._alive = np.ones(self._batch.nsim, dtype=bool)
        self.n_updates = 0

    @property
    def time(self) -> float:
        """Seconds since the robots were dropped."""
        return self.n_updates * self._physics.control_period

    @property
    def qpos(self) -> np.ndarray:
        """(robots, copies, nq) generalised coordinates; a view."""
        return self._qpos.reshape(*self.shape, -1)

    @property
    def commanded(self) -> np.ndarray:
        """(robots, copies, modules, 5) commanded lengths of the internal cables, in m; a view."""
        return self._ctrl.reshape(*self.shape, self.n_modules, -1)

    def model(self, i: int) -> mujoco.MjModel:
        """Return the model of a simulation, robot by robot, which must not be changed."""
        return self._models[i]

    def rods(self, module: np.ndarray, rods: np.ndarray) -> np.ndarray:
        """Return (robots, copies, n, 3) centres of n chosen rods per robot, in m.

        Args:
            module: (robots,) which module.
            rods: (robots, n) which of its rods.
        """
        columns = self._xyz[module[:, None], rods]
        robot = np.arange(self.shape[0])[:, None, None, None]
        copy = np.arange(self.shape[1])[None, :, None, None]
        return self.qpos[robot, copy, columns[:, None]]

    def all_rods(self) -> np.ndarray:
        """Return (robots, copies, modules, 6, 3) centres of all rods, in m."""
        return self.qpos[..., self._xyz]

    @property
    def alive(self) -> np.ndarray:
        """(robots, copies) whether a simulation is still running."""
        return self._alive.reshape(self.shape)

    def state(self) -> np.ndarray:
        """Return a copy of the (robots, copies, n) complete states."""
        return self._batch.state.reshape(*self.shape, -1).copy()

    def branch(self, other: SimulationBatch) -> None:
        """Continue from another batch, which has one copy of each robot; every copy here starts from it.

        Where walls have been put up in between, the robots' past cannot be simulated again and is forgotten.
        """
        self._batch.state[:] = np.repeat(other._batch.state, self.shape[1], axis=0)
        self.n_updates = other.n_updates
        self.failures = [f for f in other.failures for _ in range(self.shape[1])]
        self._history.branch(other._history, self.shape[1])
        if not self._same_world:
            self._history.begin(self.n_updates)
        self._alive[:] = np.repeat(other._alive, self.shape[1])

    def step(self, lengths: np.ndarray) -> None:
        """Advance by one control period.

        Args:
            lengths: (robots, copies, modules, 5) commanded lengths of the internal cables, in m.
        """
        self._ctrl[:] = lengths.reshape(len(self._ctrl), -1)
        self._history.remember(self.n_updates, self._batch.state, self._ctrl)
        ids = None if self._alive.all() else np.flatnonzero(self._alive)
        reasons = {}
        if ids is None or len(ids):
            try:
                self._batch.step(ids, nstep=self._physics.steps_per_control)
            except batch.SimulationError as e:
                reasons = {int(i): f"MuJoCo: {self._batch.error(int(i))}" for i in e.ids}
        self.n_updates += 1
        reasons = (
            self._guard.judge(self._qpos, self._qvel, self._batch.warning[..., 1], self._alive) | reasons
        )
        for i, reason in reasons.items():
            self._alive[i] = False
            reason = f"diverged {self.time:.2f} s after the drop: {reason}"
            self.failures[i] = self._history.failure(i, self.n_updates, reason)


class Simulations(Protocol):
    """Simulations as an observer sees them, whatever simulates: R robots in C copies each."""

    @property
    def shape(self) -> tuple[int, int]:
        """(R, C)."""

    @property
    def n_modules(self) -> int:
        """Number of modules of every robot."""

    @property
    def n_updates(self) -> int:
        """Control updates since the robots were dropped."""

    @property
    def time(self) -> float:
        """Seconds since then."""

    @property
    def failures(self) -> Sequence[Failure | None]:
        """Why each simulation was stopped, None for those that go on; robot by robot."""

    @property
    def alive(self) -> np.ndarray:
        """(R, C) whether a simulation goes on."""

    @property
    def qpos(self) -> np.ndarray:
        """(R, C, 7 x rods) generalised coordinates, in MuJoCo's order."""

    @property
    def commanded(self) -> np.ndarray:
        """(R, C, modules, 5) commanded lengths of the internal cables, in m."""

    def model(self, i: int) -> mujoco.MjModel:
        """Return the model of a simulation, robot by robot, which must not be changed."""

    def state(self) -> np.ndarray:
        """Return a copy of the (R, C, n) complete states of MuJoCo (``mjSTATE_INTEGRATION``)."""


BatchObserver = Callable[[Simulations], None]
"""Called after every control update; may raise to abandon the roll-out."""

SPAN: Final = 100
"""Control updates that are recorded at once: two seconds of them."""
FIRST_SPAN: Final = 10
"""Those that are recorded first: somebody waits to see the robot."""


def spans(n_updates: int) -> Iterator[int]:
    """Yield the lengths of the spans of control updates that begin with the drop."""
    length = FIRST_SPAN
    while n_updates > 0:
        yield min(length, n_updates)
        n_updates -= length
        length = SPAN


@dataclasses.dataclass(frozen=True, slots=True)
class Span:
    """K control updates of R robots in C copies, recorded at once.

    A simulation that fails stays as it is until the span ends.

    Attributes:
        sim: the simulations.
        end: control updates between the drop and the last of these, both included.
        qpos: (K, R, C, 7 x rods) generalised coordinates after every update, in MuJoCo's order.
        commanded: (K, R, C, modules, 5) commanded lengths of the internal cables, in m.
        sensed: (K, R, C, inputs) what the controllers sensed, None while the robots settle.
        forces: (K, R, C, modules, 12, 3) of the ground on the nodes, in N; None where nobody knows them.
    """

    sim: Simulations
    end: int
    qpos: np.ndarray
    commanded: np.ndarray
    sensed: np.ndarray | None
    forces: np.ndarray | None = None

    @classmethod
    def of(cls, sim: Simulations, sensed: np.ndarray | None = None) -> Self:
        """Return the span of the control update that simulations have just made.

        Args:
            sim: the simulations.
            sensed: (R, C, inputs) what the controllers sensed.
        """
        told = None if sensed is None else sensed[None].copy()
        return cls(sim, sim.n_updates, sim.qpos[None].copy(), sim.commanded[None].copy(), told)

    @classmethod
    def joined(cls, spans: Sequence[Self]) -> Self:
        """Return spans of the same simulations, one after the other, as one."""
        told = [s.sensed for s in spans if s.sensed is not None]
        return cls(
            spans[-1].sim,
            spans[-1].end,
            np.concatenate([s.qpos for s in spans]),
            np.concatenate([s.commanded for s in spans]),
            np.concatenate(told) if told else None,
        )

    @property
    def updates(self) -> range:
        """Numbers of the updates, counted from the drop; the first one after it is 1."""
        return range(self.end - len(self.qpos) + 1, self.end + 1)


SpanObserver = Callable[[Span], None]
"""Called with one span after the other; may raise to abandon the roll-out."""
