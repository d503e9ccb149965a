"""Solutions in, evaluations out.

An evaluation is a pure function of the solution, the task, the physics and the seeds, so it does not matter
where, when and in which group it is computed.
"""

from __future__ import annotations

import concurrent.futures
import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final, Literal, Self

import numpy as np

from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.errors import printable
from engine.simulation.divergence import Failure
from engine.simulation.physics import Physics
from engine.simulation.rollout import BatchObserver, Head, TrialResults
from engine.simulation.trials import StartedTrials, TrialConfig, physics_of, rounded, start_trials, trials_of
from engine.tasks import Task, fitness
from engine.tasks.walls import Wall

MOST_TOGETHER: Final = 8
"""Most solutions simulated together: lanes of the widest vectors."""
GROUPS_PER_WORKER: Final = 3
"""Groups of solutions per worker, at least: with few, workers wait for the last."""


Stage = Literal["settling", "head-search", "trial"]
"""The purpose of a simulation within an evaluation."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Solution:
    """An individual, body and controller, that an algorithm wants evaluated.

    Attributes:
        number: counts the run's evaluations from 0; the seeds follow from it.
        parent: number of the solution it descends from, None for a random one.
        operator: how it came about: ``random``; by mutation of ``morphology``, ``controller`` or ``both``;
            ``paired``, a mutated morphology with a controller from another population; ``again``, the parent
            itself under other noise; or ``given``, from another file.
        source: the archive its parent was drawn from, or what it was given from, if any.
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
    """The result of evaluating a solution.

    Attributes:
        solution: what was evaluated.
        fitness: in m, to be minimised; None if a simulation failed.
        distances: (targets, repeats) final distances in m, or the task's own scores.
        trajectory: (targets, seconds, 2) float32 head positions at 1 Hz in the settled head's frame,
            averaged over the repeats and rounded, in m: the sensory data.
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
    """The first simulation that failed in the evaluation of a solution.

    Attributes:
        solution: what was evaluated.
        head_is_end: whether the chain's last module is the head, as far as known.
        stage: where it failed: ``settling``, ``head-search`` or ``trial``.
        target, repeat: which trial, None in another stage.
        failure: why, and the simulation's last control updates.
        walls: that stood in the world.
        physics: of the robot, where it is another than its run's.
    """

    solution: Solution
    head_is_end: bool
    stage: Stage
    target: int | None
    repeat: int | None
    failure: Failure
    walls: tuple[Wall, ...] = ()
    physics: Physics | None = None


FailureKeeper = Callable[[FailedTrial], str]
"""Stores a failure; returns a note for the evaluation's ``failure``, such as the name of the file."""


def in_groups(solutions: Sequence[Solution], most: int) -> list[list[Solution]]:
    """Return solutions in groups of at most ``most``, of robots with equally many modules, the largest first.

    What takes longest is then begun first, so that no worker is left with it at the end.
    """
    groups = []
    by_size = sorted(solutions, key=lambda s: -s.morphology.n_modules)
    for _, equal in itertools.groupby(by_size, key=lambda s: s.morphology.n_modules):
        of_size = list(equal)
        n = math.ceil(len(of_size) / most)
        groups += [of_size[k * len(of_size) // n : (k + 1) * len(of_size) // n] for k in range(n)]
    return groups


def most_together(n_solutions: int, n_workers: int, physics: Physics) -> int:
    """Return how many solutions to simulate together.

    The kernel simulates several robots of one size in little more time than one; MuJoCo does not.

    Args:
        n_solutions: how many there are.
        n_workers: how many groups are simulated at once.
        physics: how they are simulated.
    """
    if physics.simulator != "kernel":
        return 1
    return max(1, min(MOST_TOGETHER, n_solutions // (GROUPS_PER_WORKER * max(1, n_workers))))


@dataclasses.dataclass(frozen=True, slots=True)
class _Outcome:
    """What simulating one solution gave: its trials, its head and its first failure."""

    result: TrialResults
    head: Head
    failed: FailedTrial | None


class LocalEvaluator:
    """Evaluates solutions on the threads of this machine.

    Args:
        task: what the robots are asked to do.
        physics: how they are simulated.
        trials: how long and how often.
        run_seed: first part of every simulation's seed.
        n_threads: threads that simulate.
        keep_failure: called once for every evaluation in which a simulation failed, in the order of the
            evaluations; by default failures are not kept.
        observer: sees the trials of every group of robots, not how they settle.
        head_is_end: which end of every robot is its head, if that is known; it is then not searched.
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
        head_is_end: bool | None = None,
    ) -> None:
        self._task = task
        self._physics = physics
        self._trials = trials
        self._run_seed = run_seed
        self._n_threads = n_threads
        self._keep_failure = keep_failure
        self._observer = observer
        self._head_is_end = head_is_end

    def evaluate(self, solutions: Sequence[Solution]) -> Iterator[list[Evaluation]]:
        """Yield evaluations in groups of robots with equally many modules."""
        # Python's own part of a simulation keeps other threads waiting, and a user's task may not expect them
        if self._n_threads == 1 or self._physics.simulator != "kernel" or self._task.file or self._observer:
            for group in in_groups(solutions, MOST_TOGETHER):
                yield self._summary(group, self._simulated(group, self._n_threads))
            return
        groups = in_groups(solutions, most_together(len(solutions), self._n_threads, self._physics))
        inside = self._n_threads // min(self._n_threads, max(1, len(groups)))
        pool = concurrent.futures.ThreadPoolExecutor(self._n_threads)
        try:
            done = pool.map(lambda group: self._simulated(group, inside), groups)
            for group, outcome in zip(groups, done, strict=True):
                yield self._summary(group, outcome)
        finally:
            pool.shutdown(cancel_futures=True)

    def _simulated(self, solutions: Sequence[Solution], n_threads: int) -> list[_Outcome]:
        """Simulate solutions of one size."""
        if self._physics.spread:
            return [self._of_a_design(solution, n_threads) for solution in solutions]
        started = self._start(solutions, self._physics, self._heads(solutions), n_threads)
        results = started.loop.run(self._trials.trial_time, self._observer)
        return [
            _Outcome(result, started.heads[k], self._first_failure(solution, result, started, k))
            for k, (solution, result) in enumerate(zip(solutions, results, strict=True))
        ]

    def _of_a_design(self, solution: Solution, n_threads: int) -> _Outcome:
        """Simulate robots of one design, another in every repeat; all have the head that the design has."""
        heads = self._heads([solution])
        if heads is None:
            heads = self._start([solution], self._physics, None, n_threads).heads
        repeats, failed = [], None
        for repeat in range(self._trials.repeats):
            physics = physics_of(self._physics, self._run_seed, solution.number, repeat)
            started = self._start([solution], physics, heads, n_threads, repeat)
            result = started.loop.run(self._trials.trial_time, self._observer)[0]
            found = self._first_failure(solution, result, started, 0)
            if failed is None and found is not None:
                failed = dataclasses.replace(
                    found, repeat=None if found.repeat is None else repeat, physics=physics
                )
            repeats.append(result)
        joined = TrialResults(
            np.stack([r.scores for r in repeats], axis=1).ravel(),
            np.stack([r.trajectory for r in repeats], axis=1).reshape(-1, *repeats[0].trajectory.shape[1:]),
            tuple(f for of_target in zip(*(r.failures for r in repeats), strict=True) for f in of_target),
        )
        return _Outcome(joined, heads[0], failed)

    def _summary(self, solutions: Sequence[Solution], outcomes: Sequence[_Outcome]) -> list[Evaluation]:
        """Return the evaluations of simulated solutions, and keep their failures."""
        return [
            self._summarise(solution, o.result, o.head, o.failed)
            for solution, o in zip(solutions, outcomes, strict=True)
        ]

    def _start(
        self,
        solutions: Sequence[Solution],
        physics: Physics,
        heads: list[Head] | None,
        n_threads: int,
        repeat: int | None = None,
    ) -> StartedTrials:
        """Start the trials of solutions with equally many modules, of one repeat or of all."""
        n_modules = solutions[0].morphology.n_modules
        trials = trials_of(self._task, n_modules, self._trials.repeats)
        return start_trials(
            [s.morphology for s in solutions],
            [s.controller for s in solutions],
            [trial for trial in trials if repeat in (None, trial.repeat)],
            numbers=[s.number for s in solutions],
            run_seed=self._run_seed,
            task=self._task,
            physics=physics,
            times=self._trials,
            heads=heads,
            n_threads=n_threads,
        )

    def _heads(self, solutions: Sequence[Solution]) -> list[Head] | None:
        """Return the heads of robots if they are known."""
        if self._head_is_end is None:
            return None
        return [Head.of(s.morphology, self._head_is_end) for s in solutions]

    def _first_failure(
        self, solution: Solution, result: TrialResults, started: StartedTrials, robot: int
    ) -> FailedTrial | None:
        """Return the first of the failures of a robot's stages, or None."""
        stage: Stage = "trial"
        target = repeat = None
        walls: tuple[Wall, ...] = ()
        settling = started.settling[robot]
        failure = settling or started.head_search[robot]  # no search after a failed settling
        if failure is not None:
            stage = "settling" if settling else "head-search"
        elif result.failed is not None:
            failure = result.failures[result.failed]
            target, repeat = divmod(result.failed, len(result.failures) // self._task.n_targets)
            walls = started.loop.walls[robot][result.failed]
        if failure is None:
            return None
        return FailedTrial(
            solution=solution,
            head_is_end=started.heads[robot].is_end,
            stage=stage,
            target=target,
            repeat=repeat,
            failure=failure,
            walls=walls,
        )

    def _summarise(
        self, solution: Solution, result: TrialResults, head: Head, failed: FailedTrial | None
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
            trajectory=rounded(paths.mean(axis=1), self._trials.trajectory_bits),
            head_is_end=head.is_end,
            # the note may name a file, whose name may be any bytes
            failure=failure and printable(failure),
        )
