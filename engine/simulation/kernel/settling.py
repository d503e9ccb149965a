"""Robots before their trials: dropped, settled, and searched for their heads, each on its own.

Threads take robots one by one. Why a simulation failed is known at once; the moments before, which a dump
needs, are got by simulating again, for the same call gives the same bits.
"""

from __future__ import annotations

import concurrent.futures
import dataclasses
from collections.abc import Callable, Sequence
from typing import Final, TypeVar

import numpy as np

from engine.body.morphology import Morphology
from engine.simulation.batch import Span, SpanObserver, spans
from engine.simulation.divergence import MAX_UPDATES, Failure
from engine.simulation.kernel.batch import widest
from engine.simulation.kernel.guard import GOES_ON, read_robot, reason
from engine.simulation.kernel.lanes.simd import by_lane, width_of
from engine.simulation.kernel.loop.closed_loop import SLACK
from engine.simulation.kernel.loop.dropped import Dropped
from engine.simulation.kernel.loop.setup import Recording
from engine.simulation.kernel.physics.parameters import INTERNAL, Model
from engine.simulation.kernel.physics.state import ROD
from engine.simulation.kernel.simulations import KernelSimulations, mujoco_state
from engine.simulation.model import RobotModel
from engine.simulation.physics import Physics
from engine.simulation.rollout import Head

_COMMANDS: Final = frozenset({"commands"})
_SPAN: Final = frozenset({"poses", "commands"})
R = TypeVar("R")
Q = TypeVar("Q")


@dataclasses.dataclass(frozen=True, slots=True)
class Settled:
    """A robot after settling.

    Attributes:
        robot: its MuJoCo model.
        model: the same as the kernel reads it.
        dropped: the simulation.
        failure: why settling failed, or None.
    """

    robot: RobotModel
    model: Model
    dropped: Dropped
    failure: Failure | None


def settle(
    robots: Sequence[RobotModel],
    morphologies: Sequence[Morphology],
    *,
    physics: Physics,
    duration: float,
    n_threads: int = 1,
    observer: SpanObserver | None = None,
) -> list[Settled]:
    """Drop robots and let them come to rest, servos off.

    Args:
        robots: their models.
        morphologies: their bodies.
        physics: time step and control period.
        duration: seconds.
        n_threads: threads that simulate.
        observer: sees one robot at a time; with threads, from several of them.
    """

    def one(pair: tuple[RobotModel, Morphology]) -> Settled:
        robot, morphology = pair
        model = read_robot(robot)
        dropped = _drop(robot, model, morphology, physics)
        if observer is None:
            dropped.settle(round(duration / physics.control_period))
        else:
            for n in spans(round(duration / physics.control_period)):
                recording = dropped.settle(n, _SPAN)
                observer(_span(recording, _snapshot(robot, dropped, physics)))
        failure = None
        if dropped.failure != GOES_ON:
            failure = _settling_failure(robot, model, morphology, dropped, physics)
        return Settled(robot, model, dropped, failure)

    return threaded(one, list(zip(robots, morphologies, strict=True)), n_threads)


def find_heads(
    settled: Sequence[Settled],
    morphologies: Sequence[Morphology],
    *,
    physics: Physics,
    duration: float,
    n_threads: int = 1,
) -> tuple[list[Head], list[Failure | None]]:
    """Find which end of each robot goes first when all modules pulse together, or by their rhythms.

    Returns:
        The heads and, per robot, why its simulation failed or None.
    """

    def one(pair: tuple[Settled, Morphology]) -> tuple[Head, Failure | None]:
        robot, morphology = pair
        is_end, code = robot.dropped.goes_end_first(duration)
        failure = robot.failure
        if failure is None and code != GOES_ON:
            failure = _search_failure(code, robot, round(duration / physics.control_period), physics)
        return Head.of(morphology, is_end), failure

    found = threaded(one, list(zip(settled, morphologies, strict=True)), n_threads)
    return [head for head, _ in found], [failure for _, failure in found]


def threaded(function: Callable[[Q], R], items: Sequence[Q], n_threads: int) -> list[R]:
    """Return a function's results for items, in their order, computed on some threads."""
    if n_threads == 1 or len(items) == 1:
        return [function(item) for item in items]
    with concurrent.futures.ThreadPoolExecutor(n_threads) as pool:
        return list(pool.map(function, items))


def _drop(robot: RobotModel, model: Model, morphology: Morphology, physics: Physics) -> Dropped:
    return Dropped(
        model,
        robot.model.qpos0.reshape(-1, 7),
        end=Head.of(morphology, True),
        rhythms=morphology.open_loop,
        physics=physics,
        width=widest(),
    )


def _snapshot(robot: RobotModel, dropped: Dropped, physics: Physics) -> KernelSimulations:
    """Return a dropped robot as observers see it."""
    code = dropped.failure
    failure = failure_at(code, dropped.failed_at, dropped.model, physics) if code != GOES_ON else None
    return KernelSimulations(
        [robot],
        [[dropped.state]],
        copies=1,
        physics=physics,
        n_updates=dropped.n_updates,
        walls=[[()]],
        failures=[failure],
    )


def _span(recording: Recording, sim: KernelSimulations) -> Span:
    """Return what was recorded of a dropped robot."""
    n = len(recording.poses)
    return Span(
        sim,
        end=sim.n_updates,
        qpos=recording.poses.reshape(n, 1, 1, -1),
        commanded=recording.commands.reshape(n, 1, 1, sim.n_modules, INTERNAL),
        sensed=None,
    )


def failure_at(code: int, n_updates: int, model: Model, physics: Physics) -> Failure:
    """Return a failure without its past."""
    seconds = n_updates * physics.control_period
    text = f"diverged {seconds:.2f} s after the drop: {reason(code, model)}"
    return Failure(text, n_updates, np.empty(0), np.empty((0, INTERNAL * model.n_modules)))


def _settling_failure(
    robot: RobotModel, model: Model, morphology: Morphology, dropped: Dropped, physics: Physics
) -> Failure:
    """Return why a robot failed while it settled, with its last moments."""
    at = dropped.failed_at
    n = min(at, MAX_UPDATES)
    before = _drop(robot, model, morphology, physics)
    before.settle(at - n)
    return dataclasses.replace(
        failure_at(dropped.failure, at, model, physics),
        state=_snapshot(robot, before, physics).state()[0, 0],
        controls=np.full((n, INTERNAL * model.n_modules), SLACK),
    )


def _search_failure(code: int, settled: Settled, n_updates: int, physics: Physics) -> Failure:
    """Return why a robot failed while its head was searched, with its last moments."""
    dropped, model = settled.dropped, settled.model
    _, loop, _ = dropped.pulse(n_updates)
    failed_at = int(by_lane(loop.failed_at)[0, 0])
    at = failed_at - dropped.n_updates
    n = min(at, MAX_UPDATES)
    before, _, _ = dropped.pulse(at - n)
    _, _, recording = dropped.pulse(at, _COMMANDS)
    rods = by_lane(before.rods).reshape(-1, ROD, width_of(before.rods))[..., 0]
    controls = recording.commands[at - n :, 0]
    time = (failed_at - n) * physics.control_period
    return dataclasses.replace(
        failure_at(code, failed_at, model, physics),
        state=mujoco_state(settled.robot.model, rods, controls[0], time),
        controls=controls,
    )
