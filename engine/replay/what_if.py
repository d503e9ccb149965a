"""What a changed body would have done with the same controller: simulated at once, stored nowhere.

It is simulated like an evaluation: settling, the search for the head, a trial towards every target under
every noise seed of the original. So the unchanged body gives exactly the recorded scores.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np

from engine.body.morphology import Morphology
from engine.config import RunConfig, task_of
from engine.errors import Cancelled, InvalidData, TaskError
from engine.replay.frames import FrameMaker
from engine.replay.recording import UPDATES_PER_FRAME, ReplayFrame
from engine.simulation.batch import Span
from engine.simulation.evaluation import Evaluation
from engine.simulation.physics import check_timestep
from engine.simulation.rollout import Head, RollOut
from engine.simulation.trials import start_trials, trials_of
from engine.tasks import fitness
from engine.tasks.walls import Wall


class WhatIf:
    """Simulates a variant of a robot; its results can be read while it runs.

    Call ``run`` in a separate thread.

    Args:
        config: of the run that the evaluation belongs to.
        evaluation: of the original.
        morphology: of the variant.

    Raises:
        InvalidData: today's robots do not survive the run's physics.
    """

    def __init__(self, config: RunConfig, evaluation: Evaluation, morphology: Morphology) -> None:
        check_timestep(config.physics)
        self.config, self.original, self.morphology = config, evaluation, morphology
        task, trials = task_of(config), config.trials
        self._task = task
        self._shape = (task.n_targets, trials.repeats)
        self.frames: list[list[ReplayFrame]] = [[] for _ in range(task.n_targets)]
        """Per target the frames under the first noise seed; they only ever grow."""
        self.targets: np.ndarray | None = None
        """(targets, 2) in the world, in m, once the robot has settled."""
        self.walls: list[tuple[Wall, ...]] = [() for _ in range(task.n_targets)]
        self.head: Head | None = None
        """Which end turned out to be its head, once that is known."""
        self.scores: np.ndarray | None = None
        """(targets, repeats) how the task scores the variant so far, in m, once its trials have begun."""
        self.time = -trials.settle_time
        """How far the trials have been simulated, in s."""
        self.finished = False
        """Whether ``scores`` are those of the trials' end."""
        self.failures: list[str | None] = [None] * task.n_targets
        """Per target why a simulation failed, or None."""
        self.failure: str | None = None
        """Why there is no fitness, or None."""
        self._cancelled = threading.Event()

    @property
    def fitness(self) -> float | None:
        """The variant's fitness in m, to be minimised, once its trials are over and if none failed."""
        if not self.finished or self.failure or self.scores is None:
            return None
        return fitness(self.scores)

    @property
    def frame_period(self) -> float:
        """Seconds between two frames."""
        return self.config.physics.control_period * UPDATES_PER_FRAME

    def cancel(self) -> None:
        """Make ``run`` return soon."""
        self._cancelled.set()

    @property
    def cancelled(self) -> bool:
        """Whether ``cancel`` has been called."""
        return self._cancelled.is_set()

    def run(self, progress: Callable[[], None] = lambda: None) -> None:
        """Simulate until the trials are over, a failure or ``cancel``.

        Args:
            progress: called every second of the trials, and at the end.
        """
        try:
            self._run(progress)
        except Cancelled:
            return
        except TaskError as e:
            self.failure = str(e)
        progress()

    def _run(self, progress: Callable[[], None]) -> None:
        config, physics, trials = self.config, self.config.physics, self.config.trials
        settling: list[Span] = []

        def settles(span: Span) -> None:
            self._check()
            settling.append(span)

        n_targets, repeats = self._shape
        solution = self.original.solution
        started = start_trials(
            [self.morphology],
            [solution.controller],
            trials_of(self._task, self.morphology.n_modules, repeats),
            numbers=[solution.number],
            run_seed=config.seed,
            task=self._task,
            physics=physics,
            times=trials,
            observer=settles,
        )
        loop, (head,), (lost,) = started.loop, started.heads, started.head_search
        self.walls = [loop.walls[0][k * repeats] for k in range(n_targets)]
        self.head = head
        maker = self._maker(head, 0)
        before = [frame for span in settling for frame in maker.frames(span)]
        for frames in self.frames:
            frames += before
        # the drawing code takes the targets as the sign that the world is complete
        self.targets = loop.targets[0, ::repeats]
        self._note(loop)
        makers = [self._maker(head, k * repeats) for k in range(n_targets)]
        n, done = round(trials.trial_time / physics.control_period), 0
        while done < n and loop.sim.alive.any():
            self._check()
            span = loop.advance(min(round(1.0 / physics.control_period), n - done))
            done += len(span.updates)
            self.time = done * physics.control_period
            self._record(span, makers)
            if done < n:
                self._note(loop)
                progress()
        self._note(loop)
        failures = [None if f is None else str(f) for f in loop.sim.failures]
        self.failure = next((f for f in (None if lost is None else str(lost), *failures) if f), None)
        self.finished = True

    def _maker(self, head: Head, copy: int) -> FrameMaker:
        config = self.config
        return FrameMaker(
            head,
            settle_time=config.trials.settle_time,
            control_period=config.physics.control_period,
            copy=copy,
        )

    def _record(self, span: Span, makers: list[FrameMaker]) -> None:
        """Keep the frames of the first noise seed of every target."""
        for k, maker in enumerate(makers):
            self.frames[k] += maker.frames(span)
            failure = span.sim.failures[k * self._shape[1]]
            self.failures[k] = None if failure is None else str(failure)

    def _note(self, loop: RollOut) -> None:
        self.scores = loop.scores()[0].reshape(self._shape).copy()

    def _check(self) -> None:
        if self._cancelled.is_set():
            raise Cancelled


class WhatIfReplay:
    """The trial of a ``WhatIf`` towards one target; it can be played while it is still being simulated.

    Args:
        what_if: that simulates it.
        target: which of the task's targets.

    Raises:
        InvalidData: there is no such target.
    """

    def __init__(self, what_if: WhatIf, target: int) -> None:
        if not 0 <= target < len(what_if.frames):
            raise InvalidData(f"target must be from 0 to {len(what_if.frames) - 1}, not {target}")
        self.what_if, self.target_index = what_if, target

    @property
    def frames(self) -> list[ReplayFrame]:
        """The frames simulated so far; none before the head is known."""
        return self.what_if.frames[self.target_index]

    @property
    def target(self) -> np.ndarray | None:
        """(2,) the target in the world, in m, or None."""
        targets = self.what_if.targets
        return None if targets is None else targets[self.target_index]

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The walls in the world."""
        return self.what_if.walls[self.target_index]

    @property
    def failure(self) -> str | None:
        """Why the simulation failed, once it has."""
        if self.what_if.failures[self.target_index] is not None:
            return self.what_if.failures[self.target_index]
        # one that failed before its trials
        return self.what_if.failure if self.what_if.finished and len(self.frames) < 2 else None

    @property
    def head(self) -> Head:
        """Which end of the robot is its head."""
        return self.what_if.head or Head.of(self.morphology, True)

    @property
    def morphology(self) -> Morphology:
        """The variant's body."""
        return self.what_if.morphology

    @property
    def start_time(self) -> float:
        """Time of the trial's clock when the robot is dropped, in s."""
        return -self.what_if.config.trials.settle_time

    @property
    def end_time(self) -> float:
        """Time of the trial's clock when it ends, in s."""
        return self.what_if.config.trials.trial_time

    @property
    def frame_period(self) -> float:
        """Seconds between two frames."""
        return self.what_if.frame_period

    def cancel(self) -> None:
        """Do nothing: the other targets continue."""

    def advance(self, until: float) -> None:
        """Do nothing: the ``WhatIf`` simulates all targets, to their end."""
