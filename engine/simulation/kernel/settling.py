"""Robots before their trials: dropped, settled, and searched for their heads.

Robots of one size share a vector, and threads take vectors one by one. Why a simulation failed is known at
once; the moments before, which a dump needs, are got by simulating again, for the same call gives the same
bits.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Final

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
from engine.simulation.kernel.physics.state import ROD
from engine.simulation.kernel.robots.parameters import INTERNAL, Robot
from engine.simulation.kernel.simulations import KernelSimulations, mujoco_state
from engine.simulation.kernel.threads import threaded
from engine.simulation.model import RobotModel
from engine.simulation.physics import Physics
from engine.simulation.rollout import Head

_COMMANDS: Final = frozenset({"commands"})
_SPAN: Final = frozenset({"poses", "commands"})


@dataclasses.dataclass(frozen=True, slots=True)
class Settled:
    """A robot after settling.

    Attributes:
        robot: its MuJoCo model.
        numbers: the same as the kernel reads it.
        dropped: the simulations that its own is among.
        lane: which it is.
        failure: why settling failed, or None.
    """

    robot: RobotModel
    numbers: Robot
    dropped: Dropped
    lane: int
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
    """Drop robots of one size and let them come to rest, servos off.

    Args:
        robots: their models.
        morphologies: their bodies.
        physics: time step and control period.
        duration: seconds.
        n_threads: threads that simulate.
        observer: sees the robots of one vector at a time; with threads, from several of them.
    """
    n_updates = round(duration / physics.control_period)

    def one(members: slice) -> list[Settled]:
        own, bodies = robots[members], morphologies[members]
        numbers = [read_robot(robot) for robot in own]
        dropped = _drop(own, numbers, bodies, physics)
        if observer is None:
            dropped.settle(n_updates)
        else:
            for n in spans(n_updates):
                recording = dropped.settle(n, _SPAN)
                observer(_span(recording, _snapshot(own, numbers, dropped, physics)))
        found = []
        for lane, code in enumerate(dropped.failures):
            failure = None
            if code != GOES_ON:
                at = dropped.failed_at[lane]
                failure = _settling_failure(code, at, own[lane], numbers[lane], bodies[lane], physics)
            found.append(Settled(own[lane], numbers[lane], dropped, lane, failure))
        return found

    width = widest()
    vectors = [slice(first, first + width) for first in range(0, len(robots), width)]
    return [robot for vector in threaded(one, vectors, n_threads) for robot in vector]


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
    vectors = list({id(robot.dropped): robot.dropped for robot in settled}.values())
    searched = threaded(lambda dropped: dropped.goes_end_first(duration), vectors, n_threads)
    found = {id(dropped): results for dropped, results in zip(vectors, searched, strict=True)}
    heads, failures = [], []
    for robot, morphology in zip(settled, morphologies, strict=True):
        is_end, code = found[id(robot.dropped)][robot.lane]
        failure = robot.failure
        if failure is None and code != GOES_ON:
            failure = _search_failure(code, robot, round(duration / physics.control_period), physics)
        heads.append(Head.of(morphology, is_end))
        failures.append(failure)
    return heads, failures


def _drop(
    robots: Sequence[RobotModel],
    numbers: Sequence[Robot],
    morphologies: Sequence[Morphology],
    physics: Physics,
) -> Dropped:
    return Dropped(
        numbers,
        np.array([robot.model.qpos0.reshape(-1, 7) for robot in robots]),
        ends=[Head.of(morphology, True) for morphology in morphologies],
        rhythms=[morphology.open_loop for morphology in morphologies],
        physics=physics,
        width=widest(),
    )


def _snapshot(
    robots: Sequence[RobotModel], numbers: Sequence[Robot], dropped: Dropped, physics: Physics
) -> KernelSimulations:
    """Return dropped robots as observers see them."""
    failures = [
        failure_at(code, at, own, physics) if code != GOES_ON else None
        for code, at, own in zip(dropped.failures, dropped.failed_at, numbers, strict=True)
    ]
    return KernelSimulations(
        robots,
        [dropped.state],
        copies=1,
        physics=physics,
        n_updates=dropped.n_updates,
        walls=[[()]] * len(robots),
        failures=failures,
    )


def _span(recording: Recording, sim: KernelSimulations) -> Span:
    """Return what was recorded of dropped robots."""
    n, n_robots = recording.poses.shape[:2]
    return Span(
        sim,
        end=sim.n_updates,
        qpos=recording.poses.reshape(n, n_robots, 1, -1),
        commanded=recording.commands.reshape(n, n_robots, 1, sim.n_modules, INTERNAL),
        sensed=None,
    )


def failure_at(code: int, n_updates: int, robot: Robot, physics: Physics) -> Failure:
    """Return a failure without its past."""
    seconds = n_updates * physics.control_period
    text = f"diverged {seconds:.2f} s after the drop: {reason(code, robot)}"
    return Failure(text, n_updates, np.empty(0), np.empty((0, INTERNAL * robot.n_modules)))


def _settling_failure(
    code: int, at: int, robot: RobotModel, numbers: Robot, morphology: Morphology, physics: Physics
) -> Failure:
    """Return why a robot failed while it settled, with its last moments."""
    n = min(at, MAX_UPDATES)
    before = _drop([robot], [numbers], [morphology], physics)
    before.settle(at - n)
    return dataclasses.replace(
        failure_at(code, at, numbers, physics),
        state=_snapshot([robot], [numbers], before, physics).state()[0, 0],
        controls=np.full((n, INTERNAL * numbers.n_modules), SLACK),
    )


def _search_failure(code: int, settled: Settled, n_updates: int, physics: Physics) -> Failure:
    """Return why a robot failed while its head was searched, with its last moments."""
    dropped, lane = settled.dropped, settled.lane
    _, loop, _ = dropped.pulse(n_updates)
    failed_at = int(by_lane(loop.failed_at)[0, lane])
    at = failed_at - dropped.n_updates
    n = min(at, MAX_UPDATES)
    before, _, _ = dropped.pulse(at - n)
    _, _, recording = dropped.pulse(at, _COMMANDS)
    rods = by_lane(before.rods).reshape(-1, ROD, width_of(before.rods))[..., lane]
    controls = recording.commands[at - n :, lane]
    time = (failed_at - n) * physics.control_period
    return dataclasses.replace(
        failure_at(code, failed_at, settled.numbers, physics),
        state=mujoco_state(settled.robot.model, rods, controls[0], time),
        controls=controls,
    )
