"""Solutions in, evaluations out.

An evaluation is a pure function of the solution, the task, the physics and the seeds, so it does not
matter who computes it, when, or together with what.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final, Literal, Protocol, Self

import numpy as np

from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.errors import InvalidData
from engine.simulation.divergence import Failure
from engine.simulation.physics import Physics
from engine.simulation.rollout import (
    OPEN_LOOP_TIME,
    BatchObserver,
    ClosedLoop,
    Head,
    Trials,
    build_robots,
    find_heads,
    settle,
)
from engine.tasks import SETTLE_TIME, TRIAL_TIME, Task, fitness, target_offsets, worlds
from engine.tasks.walls import Wall

CHUNK: Final = 8
"""Solutions simulated together; what is finished is handed on chunk by chunk."""


MAX_REPEATS: Final = 100
LONGEST: Final = 1000.0
"""Seconds of any part of a trial, at most: a replay keeps its frames, and runs may come from anywhere."""

Stage = Literal["settling", "head-search", "trial"]
"""What a simulation of an evaluation is for."""


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

    def __post_init__(self) -> None:
        if not 1 <= self.repeats <= MAX_REPEATS:
            raise InvalidData(f"repeats must be from 1 to {MAX_REPEATS}, not {self.repeats}")
        for name, least in (("trial_time", 1.0), ("settle_time", 0.0), ("open_loop_time", 0.0)):
            if not least <= getattr(self, name) <= LONGEST:
                raise InvalidData(
                    f"{name} must be from {least:g} to {LONGEST:g} s, not {getattr(self, name)}"
                )


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Solution:
    """A pair of body and controller that an algorithm wants to know about.

    Attributes:
        number: counts the run's evaluations from 0; the seeds follow from it.
        parent: number of the solution it descends from, None for a random one.
        operator: how it came about: ``random``; by mutation of ``morphology``, ``controller`` or ``both``;
            or ``paired``, a mutated morphology with a controller from another population.
        source: the archive its parent was drawn from, if any.
    """

    number: int
    morphology: Morphology
    controller: Controller
    parent: int | None = None
    operator: str = "random"
    source: str | None = None

    def to_json(self) -> dict[str, Any]:
        """Return JSON-ready values."""
        return {
            "number": self.number,
            "morphology": self.morphology.to_json(),
            "controller": self.controller.to_json(),
            "parent": self.parent,
            "operator": self.operator,
            "source": self.source,
        }

    @classmethod
    def from_json(cls, data: Any) -> Self:
        """Read a solution back from ``to_json``'s form.

        Raises:
            InvalidData, TypeError, KeyError: it is not of that form.
        """
        return cls(
            number=int(data["number"]),
            morphology=Morphology.from_json(data["morphology"]),
            controller=Controller.from_json(data["controller"]),
            parent=None if data["parent"] is None else int(data["parent"]),
            operator=str(data["operator"]),
            source=None if data["source"] is None else str(data["source"]),
        )


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """What was learnt about a solution.

    Attributes:
        solution: what was evaluated.
        fitness: in m, to be minimised; None if a simulation failed.
        distances: (targets, repeats) final distances in m, or how else the task scores the end.
        trajectory: (targets, seconds, 2) float32 head positions at 1 Hz in the settled head's frame,
            averaged over the repeats, in m: the sensory data.
        head_is_end: whether the chain's last module is the head.
        failure: why a simulation failed, or None.
    """

    solution: Solution
    fitness: float | None
    distances: np.ndarray
    trajectory: np.ndarray
    head_is_end: bool
    failure: str | None = None


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class FailedTrial:
    """The first simulation of a solution's evaluation that failed.

    Attributes:
        solution: what was evaluated.
        head_is_end: whether the chain's last module is the head, as far as it was found out.
        stage: where it failed: ``settling``, ``head-search`` or ``trial``.
        target, repeat: which trial, None in another stage.
        failure: why, and the simulation's last control updates.
        walls: that stood in the world.
    """

    solution: Solution
    head_is_end: bool
    stage: Stage
    target: int | None
    repeat: int | None
    failure: Failure
    walls: tuple[Wall, ...] = ()


FailureKeeper = Callable[[FailedTrial], str]
"""Keeps a failure somewhere; returns what the evaluation's ``failure`` adds to the reason, such as where."""


class Evaluator(Protocol):
    """Computes evaluations, on this machine or elsewhere."""

    def evaluate(self, solutions: Sequence[Solution]) -> Iterator[list[Evaluation]]:
        """Yield the evaluations of all solutions in groups, in whatever order they are finished."""
        ...


class LocalEvaluator:
    """Evaluates on the threads of this machine.

    Args:
        task: what the robots are asked to do.
        physics: how they are simulated.
        trials: how long and how often.
        run_seed: first part of every simulation's seed.
        n_threads: threads inside MuJoCo.
        keep_failure: called once for every evaluation in which a simulation failed, in the order of the
            evaluations; by default failures are not kept.
        observer: sees the trials of every group of robots, not how they settle.
    """

    def __init__(
        self,
        *,
        task: Task,
        physics: Physics,
        trials: TrialConfig,
        run_seed: int,
        n_threads: int = 1,
        keep_failure: FailureKeeper | None = None,
        observer: BatchObserver | None = None,
    ) -> None:
        self._task = task
        self._physics = physics
        self._trials = trials
        self._run_seed = run_seed
        self._n_threads = n_threads
        self._keep_failure = keep_failure
        self._observer = observer

    def evaluate(self, solutions: Sequence[Solution]) -> Iterator[list[Evaluation]]:
        """Yield evaluations in groups of robots with equally many modules."""
        by_size = sorted(solutions, key=lambda s: s.morphology.n_modules)
        for _, group in itertools.groupby(by_size, key=lambda s: s.morphology.n_modules):
            while chunk := list(itertools.islice(group, CHUNK)):
                yield self._evaluate_chunk(chunk)

    def _evaluate_chunk(self, solutions: Sequence[Solution]) -> list[Evaluation]:
        task, trials = self._task, self._trials
        morphologies = [s.morphology for s in solutions]
        robots = build_robots(morphologies, self._physics)
        common: dict[str, Any] = {"physics": self._physics, "n_threads": self._n_threads}
        settled = settle(robots, duration=trials.settle_time, **common)
        heads, head_failures = find_heads(
            settled, robots, morphologies, duration=trials.open_loop_time, **common
        )
        targets = np.repeat(target_offsets(task), trials.repeats, axis=0)
        loop = ClosedLoop(
            settled,
            robots,
            heads=heads,
            controllers=[s.controller for s in solutions],
            targets=np.broadcast_to(targets, (len(solutions), *targets.shape)),
            seeds=[
                [
                    noise_seed(self._run_seed, s.number, target, repeat)
                    for target in range(task.n_targets)
                    for repeat in range(trials.repeats)
                ]
                for s in solutions
            ],
            task=task,
            walls=[walls for walls in worlds(task, morphologies[0].n_modules) for _ in range(trials.repeats)],
            **common,
        )
        results = loop.run(trials.trial_time, self._observer)
        evaluations = []
        for k, (solution, result, head) in enumerate(zip(solutions, results, heads, strict=True)):
            failed = self._first_failure(
                solution, head, settled.failures[k], head_failures[k], result, loop.walls[k]
            )
            evaluations.append(self._summarise(solution, result, head, failed))
        return evaluations

    def _first_failure(
        self,
        solution: Solution,
        head: Head,
        settling: Failure | None,
        head_search: Failure | None,
        result: Trials,
        worlds: Sequence[tuple[Wall, ...]],
    ) -> FailedTrial | None:
        """Return the first failure of an evaluation, given those of its stages; None if there is none."""
        stage: Stage = "trial"
        target = repeat = None
        walls: tuple[Wall, ...] = ()
        failure = settling or head_search  # what fails while settling is not tried in the later stages
        if failure is not None:
            stage = "settling" if settling else "head-search"
        elif result.failed is not None:
            failure = result.failures[result.failed]
            target, repeat = divmod(result.failed, self._trials.repeats)
            walls = worlds[result.failed]
        if failure is None:
            return None
        return FailedTrial(
            solution=solution,
            head_is_end=head.is_end,
            stage=stage,
            target=target,
            repeat=repeat,
            failure=failure,
            walls=walls,
        )

    def _summarise(
        self, solution: Solution, result: Trials, head: Head, failed: FailedTrial | None
    ) -> Evaluation:
        shape = (self._task.n_targets, self._trials.repeats)
        distances = result.scores.reshape(shape)
        paths = result.trajectory[:, 1:].reshape(*shape, -1, 2)
        failure = None
        if failed is not None:
            failure = str(failed.failure)
            if self._keep_failure is not None:
                failure += self._keep_failure(failed)
        return Evaluation(
            solution=solution,
            fitness=None if failure else fitness(distances),
            distances=distances,
            trajectory=paths.mean(axis=1).astype(np.float32),
            head_is_end=head.is_end,
            failure=failure,
        )


def fresh_number(number: int, sample: int) -> int:
    """Return the number under which a solution gets noise of its own, instead of that of its evaluation.

    Args:
        number: of the solution.
        sample: 0 for the recorded noise; any other number for noise that no evaluation of the run has, and
            no other sample of this solution.
    """
    # no run has as many evaluations
    return number + sample * 2**32


def noise_seed(run_seed: int, number: int, target: int, repeat: int) -> tuple[int, ...]:
    """Return the seed of one simulation's actuation noise."""
    return (run_seed, number, target, repeat)
