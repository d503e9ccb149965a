"""What a robot's modules chose in its simulated trials, as gaits that a board plays without any sensor."""

from __future__ import annotations

import dataclasses
from typing import Final

import numpy as np

from engine.body import servo
from engine.config import RunConfig, task_of
from engine.control.network import NetworkBatch
from engine.errors import InvalidData
from engine.simulation.batch import SPAN
from engine.simulation.evaluation import Evaluation
from engine.simulation.physics import Physics
from engine.simulation.rollout import Head
from engine.simulation.trials import driving, start_trials, trials_of

ROOM: Final = 6000
"""Bytes of flash for all gaits of a robot: beside the sketch they leave an ATmega328P room to spare."""
_LAST: Final = 65535
"""Largest update that a switch may be at."""


@dataclasses.dataclass(frozen=True, slots=True)
class RecordedGait:
    """The choices of one trial.

    Attributes:
        target: index of the task's target that the robot was to go to.
        gained: how much closer it came, in m.
        switches: control updates since the controller began at which any module chose anew, the first 0.
        choices: (switches, modules) frequency x number of phases + phase, modules as built.
        held: control updates for which every choice is held at least; 1 for the trial as it was.
    """

    target: int
    gained: float
    switches: np.ndarray
    choices: np.ndarray
    held: int = 1

    @property
    def n_bytes(self) -> int:
        """Bytes of flash that it takes."""
        return len(self.switches) * (2 + self.choices.shape[1])


def recorded_gaits(config: RunConfig, evaluation: Evaluation, physics: Physics) -> list[RecordedGait]:
    """Return what a robot's modules choose in a trial for each target, but for trials that fail.

    Args:
        config: of the run that the evaluation belongs to.
        evaluation: of the robot.
        physics: to simulate it with.

    Raises:
        InvalidData: every trial fails.
    """
    solution, task = evaluation.solution, task_of(config)
    body, head = solution.morphology, Head.of(solution.morphology, evaluation.head_is_end)
    repeats = config.trials.repeats
    loop = start_trials(
        [body],
        [solution.controller],
        trials_of(task, body.n_modules, repeats)[::repeats],
        numbers=[solution.number],
        run_seed=config.seed,
        task=task,
        physics=physics,
        times=config.trials,
        heads=[head],
    ).loop
    told, left = [], round(config.trials.trial_time / physics.control_period)
    while left > 0:
        span = loop.advance(min(SPAN, left))
        assert span.sensed is not None
        told.append(span.sensed[:, 0])
        left -= len(span.qpos)
    sensed, scores = np.concatenate(told), loop.scores()[0]
    network = NetworkBatch([driving(solution.controller, config.trials)], n_outputs=2 * body.n_modules)
    gaits = []
    for k in range(task.n_targets):
        if loop.sim.failures[k] is not None:
            continue
        outputs = network.activate(sensed[None, :, k])[0]
        frequency = servo.pick(np.arange(len(servo.FREQUENCIES)), outputs[:, 0::2])
        phase = servo.pick(np.arange(len(servo.PHASES)), outputs[:, 1::2])
        chosen = frequency * len(servo.PHASES) + phase
        # the first pair of outputs drives the head module
        gaits.append(
            _switched(k, float(task.target_distance - scores[k]), chosen[:, ::-1] if head.is_end else chosen)
        )
    if not gaits:
        raise InvalidData(f"robot {solution.number} does not survive its trials, so it has no gait")
    return gaits


def best_of(gaits: list[RecordedGait]) -> int:
    """Return the index of the gait that gained most."""
    return int(np.argmax([g.gained for g in gaits]))


def fitting(gaits: list[RecordedGait], room: int = ROOM) -> list[RecordedGait]:
    """Return gaits that take at most so many bytes; choices are held as long as that needs.

    A module that changes its mind at every update cannot follow it anyway: the slowest rhythm lasts 4 s, a
    servo takes 0.4 s for its way.
    """
    held = 1
    found = gaits
    while sum(g.n_bytes for g in found) > room:
        held *= 2
        found = [_held(g, held) for g in gaits]
    return found


def _switched(target: int, gained: float, chosen: np.ndarray, held: int = 1) -> RecordedGait:
    """Return a gait from the (updates, modules) choices at every update."""
    chosen = chosen[:_LAST]
    changed = np.flatnonzero((chosen[1:] != chosen[:-1]).any(axis=1)) + 1
    switches = np.concatenate([[0], changed])
    return RecordedGait(target, gained, switches, chosen[switches], held)


def _held(gait: RecordedGait, held: int) -> RecordedGait:
    """Return a gait whose every choice, of those made most often meanwhile, is held for some updates."""
    n = max(int(gait.switches[-1]) + 1, held)
    every = gait.choices[np.searchsorted(gait.switches, np.arange(n), side="right") - 1]
    blocks = [every[k : k + held] for k in range(0, n, held)]
    most = [[np.bincount(column).argmax() for column in block.T] for block in blocks]
    return _switched(gait.target, gait.gained, np.repeat(np.array(most), held, axis=0), held)
