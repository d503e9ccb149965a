"""The trials of a robot, and the one place where they begin: settling, head search, target and walls."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, Final, Literal

import numpy as np

from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.control.network import silenced
from engine.errors import InvalidData
from engine.simulation.batch import Span, SpanObserver
from engine.simulation.divergence import Failure
from engine.simulation.physics import Physics, one_of
from engine.simulation.rollout import (
    OPEN_LOOP_TIME,
    ClosedLoop,
    Head,
    RollOut,
    build_robots,
    find_heads,
    settle,
)
from engine.tasks import SETTLE_TIME, TRIAL_TIME, Task, target_offsets, worlds
from engine.tasks.walls import Wall

MAX_REPEATS: Final = 100
FINEST: Final = 30
"""Largest number of binary digits that a head position is rounded to."""
LONGEST: Final = 1000.0
"""Longest part of a trial in seconds: a replay keeps every frame, whatever a stranger's run asks for."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class TrialConfig:
    """How long and how often a solution is tried; part of a run's configuration."""

    repeats: int = 2
    """Simulations per target, each with its own noise."""
    settle_time: float = SETTLE_TIME
    """Seconds without actuation before the target is placed."""
    open_loop_time: float = OPEN_LOOP_TIME
    """Seconds of open-loop motion that show which end is the head."""
    trial_time: float = TRIAL_TIME
    """Seconds a trial lasts."""
    unfed_outputs: Literal["bias", "zero"] = "bias"
    """What outputs that lack an input give: the logistic of their bias, or 0 as in NEAT-Python 0.92."""
    trajectory_bits: int = 14
    """Head positions are rounded to 2 ** -trajectory_bits m, 0.06 mm unless changed, so that a run's file is
    small; 0 keeps every digit."""

    def __post_init__(self) -> None:
        if not 0 <= self.trajectory_bits <= FINEST:
            raise InvalidData(f"trajectory_bits must be from 0 to {FINEST}, not {self.trajectory_bits}")
        if not 1 <= self.repeats <= MAX_REPEATS:
            raise InvalidData(f"repeats must be from 1 to {MAX_REPEATS}, not {self.repeats}")
        for name, least in (("trial_time", 1.0), ("settle_time", 0.0), ("open_loop_time", 0.0)):
            if not least <= getattr(self, name) <= LONGEST:
                raise InvalidData(
                    f"{name} must be from {least:g} to {LONGEST:g} s, not {getattr(self, name)}"
                )


def rounded(positions: np.ndarray, bits: int) -> np.ndarray:
    """Return positions in m as float32, rounded to 2 ** -bits m, or not at all where that is 0."""
    if bits:
        # adding zero makes -0.0 an ordinary one
        positions = np.ldexp(np.round(np.ldexp(positions, bits)), -bits) + 0.0
    return positions.astype(np.float32)


def driving(controller: Controller, trials: TrialConfig) -> Controller:
    """Return a controller as it drives its robot in a run's trials."""
    return silenced(controller) if trials.unfed_outputs == "zero" else controller


def fresh_number(number: int, sample: int) -> int:
    """Return the number whose noise a solution gets: that of its evaluation, or fresh noise.

    Args:
        number: of the solution.
        sample: 0 for the recorded noise; any other number for fresh noise, which neither an evaluation of the
            run nor another sample of this solution has.
    """
    # no run has 2**32 evaluations
    return number + sample * 2**32


def noise_seed(run_seed: int, number: int, target: int, repeat: int) -> tuple[int, int, int, int]:
    """Return the seed of one simulation's actuation noise."""
    return (run_seed, number, target, repeat)


def physics_of(physics: Physics, run_seed: int, number: int, repeat: int) -> Physics:
    """Return the physics of one repeat of an evaluation: another robot's where those of a design differ."""
    return one_of(physics, (run_seed, number, repeat)) if physics.spread else physics


@dataclasses.dataclass(frozen=True, slots=True)
class Trial:
    """One simulation of an evaluation.

    Attributes:
        target: which of the task's targets decides its walls and its noise.
        repeat: which noise seed of that target.
        offset: (2,) the target in the settled head's frame: x ahead, y left, in m.
        walls: that go up when the target is placed, in the settled head's frame.
    """

    target: int
    repeat: int
    offset: np.ndarray
    walls: tuple[Wall, ...]


def trials_of(task: Task, n_modules: int, repeats: int) -> list[Trial]:
    """Return all trials of an evaluation, in its order: every noise seed of the first target, then the next.

    Args:
        task: places targets and walls.
        n_modules: of the robots; walls may depend on it.
        repeats: noise seeds per target.
    """
    places = zip(target_offsets(task), worlds(task, n_modules), strict=True)
    return [
        Trial(target, repeat, offset, walls)
        for target, (offset, walls) in enumerate(places)
        for repeat in range(repeats)
    ]


@dataclasses.dataclass(frozen=True, slots=True)
class StartedTrials:
    """Robots that have settled, at the start of their trials.

    Attributes:
        loop: drives every robot in every trial.
        heads: which end of each is its head.
        settling, head_search: per robot why this part failed, or None.
    """

    loop: RollOut
    heads: list[Head]
    settling: list[Failure | None]
    head_search: list[Failure | None]


def start_trials(
    morphologies: Sequence[Morphology],
    controllers: Sequence[Controller],
    trials: Sequence[Trial],
    *,
    numbers: Sequence[int],
    run_seed: int,
    task: Task,
    physics: Physics,
    times: TrialConfig,
    heads: Sequence[Head] | None = None,
    n_threads: int = 1,
    observer: SpanObserver | None = None,
) -> StartedTrials:
    """Let robots of one size settle, find their heads, and place targets and walls.

    Every simulation of a trial starts here, so a replay or a what-if equals the evaluation.

    Args:
        morphologies: the robots' bodies, all with equally many modules.
        controllers: one per robot.
        trials: of every robot.
        numbers: per robot the number of the evaluation whose noise it gets, see ``noise_seed``.
        run_seed: first part of every noise seed.
        task: decides what the controllers sense and how the final state scores.
        physics: how the robots are simulated; a spread between them is for ``physics_of``.
        times: how long settling and head search last, and how networks are evaluated.
        heads: the robots' heads if they are known, which skips the search.
        n_threads: threads that simulate.
        observer: sees the robots settle; the kernel shows it those that share a vector.

    Raises:
        InvalidData: a robot has feet that grip one way, which MuJoCo does not know.
    """
    if physics.simulator != "kernel" and any(m.feet != "none" for m in morphologies):
        raise InvalidData(f"{physics.simulator} knows no directional feet; simulate the robot by the kernel")
    robots = build_robots(morphologies, physics)
    controllers = [driving(c, times) for c in controllers]
    offsets = np.array([trial.offset for trial in trials])
    seeds = [[noise_seed(run_seed, n, trial.target, trial.repeat) for trial in trials] for n in numbers]
    if physics.simulator == "kernel":
        # Numba takes a second to import, and MuJoCo's runs do without
        from engine.simulation.kernel import settling
        from engine.simulation.kernel.rollout import KernelLoop

        common: dict[str, Any] = {"physics": physics, "n_threads": n_threads}
        at_rest = settling.settle(
            robots, morphologies, duration=times.settle_time, observer=observer, **common
        )
        lost: list[Failure | None] = [None] * len(robots)
        if heads is None:
            heads, lost = settling.find_heads(at_rest, morphologies, duration=times.open_loop_time, **common)
        return StartedTrials(
            KernelLoop(
                at_rest,
                heads=heads,
                controllers=controllers,
                targets=offsets,
                noise=seeds,
                task=task,
                walls=[trial.walls for trial in trials],
                **common,
            ),
            list(heads),
            [robot.failure for robot in at_rest],
            lost,
        )
    settled = settle(
        robots,
        physics=physics,
        n_threads=n_threads,
        duration=times.settle_time,
        observer=None if observer is None else lambda sim: observer(Span.of(sim)),
    )
    lost = [None] * len(robots)
    if heads is None:
        heads, lost = find_heads(
            settled,
            robots,
            morphologies,
            physics=physics,
            n_threads=n_threads,
            duration=times.open_loop_time,
        )
    loop = ClosedLoop(
        settled,
        robots,
        heads=heads,
        controllers=controllers,
        targets=np.broadcast_to(offsets, (len(robots), *offsets.shape)),
        seeds=seeds,
        task=task,
        physics=physics,
        n_threads=n_threads,
        walls=[trial.walls for trial in trials],
    )
    return StartedTrials(loop, list(heads), list(settled.failures), lost)
