"""Many simulations side by side in the kernel's lanes, with the interface of ``SimulationBatch``."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Sequence
from typing import Any, Final

import numba
import numpy as np
from llvmlite import binding

from engine.simulation.divergence import BLOCK, Failure, History
from engine.simulation.kernel import guard
from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.physics.state import KEPT, ROD, State, new_state, restore, save
from engine.simulation.kernel.physics.walls import place_walls
from engine.simulation.kernel.robots.model import model_of
from engine.simulation.kernel.robots.parameters import INTERNAL, RODS, Robot
from engine.simulation.kernel.step import run
from engine.simulation.model import RobotModel
from engine.simulation.physics import Physics
from engine.tasks.walls import Wall

_WIDTHS: Final = {"avx512f": 8, "avx": 4}
"""Lanes of a processor's widest vectors by what it knows; 2 without either, as SSE2 and ARM's NEON have."""


def widest() -> int:
    """Return how many lanes fill a vector of the processor for which Numba compiles."""
    config: Any = numba.config
    known = dict(binding.get_host_cpu_features())
    if config.CPU_FEATURES is not None:
        known = {feature[1:]: feature[0] == "+" for feature in config.CPU_FEATURES.split(",") if feature}
    elif config.CPU_NAME not in (None, "host"):
        known = {}
    return next((n for feature, n in _WIDTHS.items() if known.get(feature)), 2)


def width_for(copies: int) -> int:
    """Return how many lanes to give a robot's simulations: one, or all that there are.

    One simulation in a vector of eight takes twice as long as one alone; every other width would have to be
    compiled, too.
    """
    return 1 if copies == 1 else widest()


class KernelBatch:
    """Robots with the same number of modules, each simulated in several copies.

    A simulation that diverges is stopped and its failure kept; the others do not notice. Results are the same
    bits whatever the number of lanes or threads.

    Args:
        robots: the compiled robots.
        copies: simulations per robot.
        physics: control period.
        n_threads: threads that share the robots.
        walls: the walls of every simulation, robot by robot; by default none.
        width: lanes of a vector; by default what suits the processor and the number of copies.

    Raises:
        ValueError: a robot's model has something that the kernel does not know.
    """

    def __init__(
        self,
        robots: Sequence[RobotModel],
        *,
        copies: int,
        physics: Physics,
        n_threads: int = 1,
        walls: Sequence[Sequence[Wall]] | None = None,
        width: int | None = None,
    ) -> None:
        self.shape = (len(robots), copies)
        n = len(robots) * copies
        walls = [()] * n if walls is None else walls
        n_walls = max(map(len, walls))
        self.n_modules = robots[0].n_modules
        self._physics = physics
        self._n_threads = n_threads
        self._n_walls = n_walls
        width = width_for(copies) if width is None else width
        numbers = {id(r): guard.read_robot(r) for r in robots}
        self._lanes: list[_Lanes] = []
        for r, robot in enumerate(robots):
            for start in range(r * copies, (r + 1) * copies, width):
                members = range(start, min(start + width, (r + 1) * copies))
                lanes = _Lanes(numbers[id(robot)], width=width, members=members, n_walls=n_walls)
                for lane, i in enumerate(members):
                    lanes.put(lane, robot.model.qpos0)
                    place_walls(lanes.state, lane, walls[i])
                self._lanes.append(lanes)
        self._history = History(n, len(self._lanes[0].save(0)), INTERNAL * self.n_modules)
        self._first = 0
        self.failures: list[Failure | None] = [None] * n
        """Why each simulation was stopped, None for those that go on; robot by robot."""
        self._alive = np.ones(n, dtype=bool)
        self.n_updates = 0

    @property
    def time(self) -> float:
        """Seconds since the robots were dropped."""
        return self.n_updates * self._physics.control_period

    @property
    def qpos(self) -> np.ndarray:
        """(robots, copies, 7 x rods) generalised coordinates, in MuJoCo's order; a copy."""
        return self._rods()[..., :7].reshape(*self.shape, -1)

    @property
    def qvel(self) -> np.ndarray:
        """(robots, copies, 6 x rods) generalised velocities, in MuJoCo's order; a copy."""
        return self._rods()[..., 7:].reshape(*self.shape, -1)

    @property
    def commanded(self) -> np.ndarray:
        """(robots, copies, modules, 5) commanded lengths of the internal cables, in m; a copy."""
        parts = [lanes.commanded[:, : len(lanes.members)].T for lanes in self._lanes]
        return np.concatenate(parts).reshape(*self.shape, self.n_modules, INTERNAL)

    def rods(self, module: np.ndarray, rods: np.ndarray) -> np.ndarray:
        """Return (robots, copies, n, 3) centres of n chosen rods per robot, in m.

        Args:
            module: (robots,) which module.
            rods: (robots, n) which of its rods.
        """
        robot = np.arange(self.shape[0])[:, None, None]
        copy = np.arange(self.shape[1])[None, :, None]
        return self.all_rods()[robot, copy, module[:, None, None], rods[:, None]]

    def all_rods(self) -> np.ndarray:
        """Return (robots, copies, modules, 6, 3) centres of all rods, in m."""
        return self._rods()[..., :3].reshape(*self.shape, self.n_modules, RODS, 3)

    def _rods(self) -> np.ndarray:
        """Return (simulations, rods, 13) states of all rods."""
        parts = [lanes.rods[..., : len(lanes.members)] for lanes in self._lanes]
        return np.concatenate(parts, axis=-1).transpose(2, 0, 1)

    @property
    def alive(self) -> np.ndarray:
        """(robots, copies) whether a simulation goes on."""
        return self._alive.reshape(self.shape)

    def state(self) -> np.ndarray:
        """Return a copy of the (robots, copies, n) complete states."""
        return self._save().reshape(*self.shape, -1)

    def _save(self) -> np.ndarray:
        return np.array([lanes.save(lane) for lanes in self._lanes for lane in range(len(lanes.members))])

    def restore(self, states: np.ndarray) -> None:
        """Go on from (robots, copies, n) complete states, with the bits of the simulations they are of."""
        flat = states.reshape(len(self._alive), -1)
        for lanes in self._lanes:
            for lane, i in enumerate(lanes.members):
                restore(lanes.state, lane, flat[i])

    def branch(self, other: KernelBatch) -> None:
        """Continue from another batch's robots, whose only copy is copied to all of this one's.

        In a world with walls, which the other batch has not, the robots' past cannot be simulated again
        and is forgotten.
        """
        states = other.state()
        if self._n_walls:
            states = self._with_walls(states)
        self.restore(np.repeat(states, self.shape[1], axis=1))
        self.n_updates = other.n_updates
        self.failures = [f for f in other.failures for _ in range(self.shape[1])]
        if self._n_walls:
            self._history.begin(self.n_updates)
            self._first = self.n_updates
        else:
            self._history.branch(other._history, self.shape[1])
            self._first = other._first
        self._alive[:] = np.repeat(other._alive, self.shape[1])
        for lanes in self._lanes:
            lanes.stop(~self._alive[lanes.members.start : lanes.members.stop])

    def _with_walls(self, states: np.ndarray) -> np.ndarray:
        """Return states without walls as ones with this batch's walls, which nothing touches yet."""
        lanes = self._lanes[0].state
        before = new_state(model_of([self._lanes[0].robot]))
        parts = np.split(states, np.cumsum([len(getattr(before, f)) for f in KEPT])[:-1], axis=-1)
        sizes = [len(getattr(lanes, f)) for f in KEPT]
        room = [np.zeros((*p.shape[:-1], n - p.shape[-1])) for p, n in zip(parts, sizes, strict=True)]
        return np.concatenate([x for pair in zip(parts, room, strict=True) for x in pair], axis=-1)

    def step(self, lengths: np.ndarray) -> None:
        """Advance by one control period.

        Args:
            lengths: (robots, copies, modules, 5) commanded lengths of the internal cables, in m.
        """
        commands = lengths.reshape(len(self._alive), -1)
        due = self.n_updates % BLOCK == 0 or self.n_updates == self._first
        self._history.remember(self.n_updates, self._save() if due else np.empty(0), commands)
        for lanes in self._lanes:
            lanes.commanded[:, : len(lanes.members)] = commands[lanes.members.start : lanes.members.stop].T
        self._advance()
        self.n_updates += 1
        for lanes in self._lanes:
            for lane, code in zip(lanes.members, lanes.codes(), strict=True):
                if self._alive[lane] and code != guard.GOES_ON:
                    self._fail(lane, guard.reason(code, lanes.robot))

    def _advance(self) -> None:
        n = self._physics.steps_per_control
        if self._n_threads == 1 or len(self._lanes) == 1:
            for lanes in self._lanes:
                run(lanes.model, lanes.state, n)
            return
        with concurrent.futures.ThreadPoolExecutor(self._n_threads) as pool:
            list(pool.map(lambda lanes: run(lanes.model, lanes.state, n), self._lanes))

    def _fail(self, i: int, reason: str) -> None:
        self._alive[i] = False
        reason = f"diverged {self.time:.2f} s after the drop: {reason}"
        self.failures[i] = self._history.failure(i, self.n_updates, reason)


class _Lanes:
    """Some simulations of one robot; lanes that none of them needs stand still.

    Args:
        robot: its numbers.
        width: number of lanes.
        members: which simulations of the batch they hold.
        n_walls: walls of every simulation.
    """

    def __init__(self, robot: Robot, *, width: int, members: range, n_walls: int) -> None:
        self.robot = robot
        self.model = model_of([robot] * width)
        self.members = members
        self.state: State = new_state(self.model, n_walls=n_walls)
        self.rods = simd.by_lane(self.state.rods).reshape(-1, ROD, width)
        self.commanded = simd.by_lane(self.state.commanded)
        self._failed = simd.by_lane(self.state.failed)[0]
        self._failed[len(members) :] = guard.OUTSIDE

    def put(self, lane: int, qpos: np.ndarray) -> None:
        """Put a robot at rest into a lane."""
        self.rods[:, :7, lane] = qpos.reshape(-1, 7)

    def save(self, lane: int) -> np.ndarray:
        """Return a lane's complete state."""
        return save(self.state, lane)

    def codes(self) -> list[int]:
        """Return what ``guard`` says of each simulation."""
        return [int(code) for code in self._failed[: len(self.members)]]

    def stop(self, which: np.ndarray) -> None:
        """Stop some of the simulations, in place of those that were stopped."""
        self._failed[: len(self.members)] = np.where(which, guard.OUTSIDE, guard.GOES_ON)
