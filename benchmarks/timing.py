"""What the timing benchmarks share: this machine in a line, and CPU time inside MuJoCo's step."""

from __future__ import annotations

import dataclasses
import os
import platform
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np
from mujoco import batch

from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics
from engine.simulation.provenance import processor_facts
from engine.simulation.rollout import ClosedLoop, Head, build_robots, settle
from engine.tasks import GOAL_REACHING, SETTLE_TIME, TRIAL_TIME, target_offsets


@dataclasses.dataclass
class Clock:
    """Seconds that a block took.

    Attributes:
        cpu: of all threads.
        stepping: of those, inside MuJoCo's step.
        wall: by the clock on the wall.
    """

    cpu: float = 0.0
    stepping: float = 0.0
    wall: float = 0.0

    @property
    def outside(self) -> float:
        """Share of the CPU time outside MuJoCo's step, 0 to 1."""
        return 1.0 - self.stepping / self.cpu


@contextmanager
def timed() -> Iterator[Clock]:
    """Time a block; what it computes is the same with and without."""
    clock = Clock()
    step = batch.Batch.step

    def timed_step(*args: Any, **kwargs: Any) -> None:
        started = time.process_time()
        try:
            step(*args, **kwargs)
        finally:
            clock.stepping += time.process_time() - started

    batch.Batch.step = timed_step
    cpu, wall = time.process_time(), time.perf_counter()
    try:
        yield clock
    finally:
        clock.cpu = time.process_time() - cpu
        clock.wall = time.perf_counter() - wall
        batch.Batch.step = step


@dataclasses.dataclass(frozen=True)
class Timed:
    """A robot's timed simulations.

    Attributes:
        clock: what all copies took together, compiling the robot included.
        n_steps: time steps of one copy.
        trajectory: (seconds + 1, 2) 1 Hz head positions of the first copy, in m; the first is the origin.
        failed: whether a copy diverged.
    """

    clock: Clock
    n_steps: int
    trajectory: np.ndarray
    failed: bool

    @property
    def net(self) -> float:
        """Distance of the head from its start at the end, in m."""
        return float(np.hypot(*self.trajectory[-1]))

    @property
    def path(self) -> float:
        """Length of the head's path at 1 Hz, in m."""
        return float(np.hypot(*np.diff(self.trajectory, axis=0).T).sum())


def simulate(
    morphology: Morphology,
    controller: Controller,
    *,
    physics: Physics,
    copies: int = 1,
    n_threads: int = 1,
    settle_time: float = SETTLE_TIME,
    trial_time: float = TRIAL_TIME,
) -> Timed:
    """Drop, settle and drive a robot, its last module the head, in copies with noise of their own."""
    build_robot.cache_clear()
    offsets = np.resize(target_offsets(GOAL_REACHING), (1, copies, 2))
    with timed() as clock:
        robots = build_robots([morphology], physics)
        loop = ClosedLoop(
            settle(robots, physics=physics, n_threads=n_threads, duration=settle_time),
            robots,
            heads=[Head.of(morphology, True)],
            controllers=[controller],
            targets=offsets,
            seeds=[[(0, 0, k, 0) for k in range(copies)]],
            task=GOAL_REACHING,
            physics=physics,
            n_threads=n_threads,
        )
        (result,) = loop.run(trial_time)
    return Timed(
        clock=clock,
        n_steps=round((settle_time + trial_time) / physics.timestep),
        trajectory=result.trajectory[0],
        failed=any(f is not None for f in loop.sim.failures),
    )


def median_cpu(runs: Sequence[Timed]) -> float:
    """Return the median of what runs took, in CPU s."""
    return float(np.median([r.clock.cpu for r in runs]))


def machine() -> str:
    """Return processor, cores and versions in one line."""
    model = processor_facts().get("model name", platform.processor() or platform.machine())
    return (
        f"{model}, {os.cpu_count()} cores, Python {platform.python_version()},"
        f" MuJoCo {mujoco.mj_versionString()}"
    )
