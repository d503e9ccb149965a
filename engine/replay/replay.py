"""One trial simulated afresh, frame by frame, exactly as it was evaluated."""

from __future__ import annotations

import dataclasses
import math
import threading
from typing import Final, Self

import numpy as np

from engine.body.morphology import Morphology
from engine.config import RunConfig, task_of
from engine.errors import Cancelled, InvalidData, TaskError
from engine.replay.frames import FrameMaker
from engine.replay.recording import UPDATES_PER_FRAME, ReplayFrame
from engine.replay.trial import Aim, TrialChoice
from engine.simulation.batch import SPAN, Span, SpanObserver
from engine.simulation.evaluation import Evaluation
from engine.simulation.physics import check_timestep
from engine.simulation.rollout import Head, RollOut
from engine.simulation.trials import fresh_number, physics_of, start_trials, trials_of
from engine.tasks import get_task
from engine.tasks.walls import Wall

MAX_FRESH: Final = 2**20
"""Largest number of a fresh noise."""


def repeat_trial(
    config: RunConfig,
    evaluation: Evaluation,
    *,
    target: int,
    repeat: int,
    fresh: int = 0,
    aim: Aim | None = None,
    observer: SpanObserver | None = None,
) -> RollOut:
    """Settle a robot and return it ready for one of its trials, exactly as it was evaluated.

    Args:
        config: of the run that the evaluation belongs to.
        evaluation: of the robot.
        target: which of the task's targets.
        repeat: which of its noise seeds.
        fresh: 0 for the noise that it was evaluated with; any other number draws fresh noise.
        aim: a place for the target other than the task's.
        observer: sees the robot settle.
    """
    solution, task = evaluation.solution, task_of(config)
    trial = trials_of(task, solution.morphology.n_modules, config.trials.repeats)[
        target * config.trials.repeats + repeat
    ]
    if aim is not None:
        trial = dataclasses.replace(trial, offset=aim.offset)
    number = fresh_number(solution.number, fresh)
    return start_trials(
        [solution.morphology],
        [solution.controller],
        [trial],
        numbers=[number],
        run_seed=config.seed,
        task=task,
        physics=physics_of(config.physics, config.seed, number, repeat),
        times=config.trials,
        heads=[Head.of(solution.morphology, evaluation.head_is_end)],
        observer=observer,
    ).loop


class Replay:
    """Simulates one trial of an evaluated solution; frames can be read while it runs.

    Call ``advance`` in a separate thread; ``frames`` only grows.

    Args:
        config: of the run that the evaluation belongs to.
        evaluation: what to replay.
        target, repeat: which of its trials, counted from 0; people read them from 1.
        fresh: 0 for the noise that it was evaluated with; each of 1 to ``MAX_FRESH`` draws other noise.
        aim: a place for the target other than the task's; walls and noise stay those of ``target``.
        observer: sees every control update, too, from the drop on.

    Raises:
        InvalidData: there is no such target, repeat or noise, or today's robots do not survive the run's
            physics.
    """

    def __init__(
        self,
        config: RunConfig,
        evaluation: Evaluation,
        *,
        target: int = 0,
        repeat: int = 0,
        fresh: int = 0,
        aim: Aim | None = None,
        observer: SpanObserver = lambda _span: None,
    ) -> None:
        task = get_task(config.task)
        if not 0 <= target < task.n_targets:
            raise InvalidData(f"target must be from 1 to {task.n_targets}, not {target + 1}")
        if not 0 <= repeat < config.trials.repeats:
            raise InvalidData(f"repeat must be from 1 to {config.trials.repeats}, not {repeat + 1}")
        if not 0 <= fresh <= MAX_FRESH:
            raise InvalidData(f"fresh noise must be from 1 to {MAX_FRESH}, not {fresh}")
        check_timestep(config.physics)
        self.config = config
        self.evaluation = evaluation
        self.target_index = target
        self.repeat = repeat
        self.fresh = fresh
        self.aim = aim
        self.frames: list[ReplayFrame] = []
        self.target: np.ndarray | None = None
        """(2,) the target in the world, in m, once the robot has settled."""
        self.walls: tuple[Wall, ...] = ()
        self.score: float | None = None
        """How the task scores the end of the evaluated time, in m, once it is reached."""
        self.failure: str | None = None
        self.head = Head.of(evaluation.solution.morphology, evaluation.head_is_end)
        self._loop: RollOut | None = None
        self._observer = observer
        self._maker = FrameMaker(
            self.head,
            settle_time=config.trials.settle_time,
            control_period=config.physics.control_period,
        )
        self._cancelled = threading.Event()
        self._advancing = threading.Lock()

    @classmethod
    def of(cls, config: RunConfig, evaluation: Evaluation, trial: TrialChoice) -> Self:
        """Return the replay of a trial.

        Raises:
            InvalidData: as the constructor does.
        """
        return cls(
            config,
            evaluation,
            target=trial.target,
            repeat=trial.repeat,
            fresh=trial.fresh,
            aim=trial.aim,
        )

    @property
    def morphology(self) -> Morphology:
        """The robot's body."""
        return self.evaluation.solution.morphology

    @property
    def target_name(self) -> str:
        """The target's name."""
        task = get_task(self.config.task)
        return task.target_names[self.target_index] if self.aim is None else self.aim.name

    def aim_at(self, point: np.ndarray) -> Aim:
        """Return the aim at a (2,) point in the world, in m.

        Raises:
            InvalidData: it is too near or too far, or the robot has not settled yet.
        """
        if self._loop is None:
            raise InvalidData("the robot has not settled yet; try again in a moment")
        return Aim.at(self._loop.from_world(point))

    @property
    def start_time(self) -> float:
        """Time of the trial's clock when the robot is dropped, in s."""
        return -self.settle_time

    @property
    def end_time(self) -> float:
        """Time of the trial's clock when it ends, in s."""
        return self.trial_time

    @property
    def trial_time(self) -> float:
        """Seconds that were evaluated."""
        return self.config.trials.trial_time

    @property
    def settle_time(self) -> float:
        """Seconds of settling before the trial's clock starts."""
        return self.config.trials.settle_time

    @property
    def frame_period(self) -> float:
        """Seconds between two frames."""
        return self.config.physics.control_period * UPDATES_PER_FRAME

    @property
    def loop(self) -> RollOut | None:
        """The simulation itself, once the robot has settled; not to be touched while ``advance`` runs."""
        return self._loop

    def cancel(self) -> None:
        """Make ``advance`` return soon, and at once from then on."""
        self._cancelled.set()

    def advance(self, until: float) -> None:
        """Simulate until a time of the trial's clock, in s, a failure or ``cancel``."""
        with self._advancing:
            try:
                if self._loop is None:
                    self._start()
                assert self._loop is not None
                while self.failure is None and (n := self._updates_to(until)) > 0:
                    to_end = self._updates_to(self.trial_time)
                    n = min(n, SPAN, to_end) if to_end > 0 else min(n, SPAN)
                    self._take(self._loop.advance(n))
                    if n == to_end and self.failure is None:
                        self.score = float(self._loop.scores()[0, 0])
            except Cancelled:
                return
            except TaskError as e:
                self.failure = str(e)

    def _start(self) -> None:
        self._loop = repeat_trial(
            self.config,
            self.evaluation,
            target=self.target_index,
            repeat=self.repeat,
            fresh=self.fresh,
            aim=self.aim,
            observer=self._take,
        )
        # the drawing code takes the target as the sign that the world is complete
        self.walls = self._loop.walls[0][0]
        self.target = self._loop.targets[0, 0]

    def _updates_to(self, moment: float) -> int:
        """Return how many control updates there are until a time of the trial's clock, in s."""
        assert self._loop is not None
        left = moment + self.settle_time - self._loop.sim.time
        return math.ceil(left / self.config.physics.control_period - 0.5)

    def _take(self, span: Span) -> None:
        """Keep the frames of the next control updates."""
        if self._cancelled.is_set():
            raise Cancelled
        self.frames += self._maker.frames(span)
        self._observer(span)
        failure = span.sim.failures[0]
        self.failure = None if failure is None else str(failure)
