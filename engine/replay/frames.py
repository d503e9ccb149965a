"""Frames of one simulation, made of what was recorded of it at once."""

from __future__ import annotations

import numpy as np

from engine.replay.recording import UPDATES_PER_FRAME, ContactFinder, ReplayFrame
from engine.simulation.batch import Span
from engine.simulation.rollout import Head


class FrameMaker:
    """Makes the frames of one simulation, span by span.

    Args:
        head: which end of the robot is its head.
        settle_time: seconds between the drop and the beginning of the trial's clock.
        control_period: seconds between two control updates.
        copy: which of the first robot's simulations.
    """

    def __init__(self, head: Head, *, settle_time: float, control_period: float, copy: int = 0) -> None:
        self._head = head
        self._settle_time = settle_time
        self._period = control_period
        self._copy = copy
        self._contacts: ContactFinder | None = None

    def frames(self, span: Span) -> list[ReplayFrame]:
        """Return the frames of the next span, up to the simulation's failure if it has failed."""
        failure = span.sim.failures[self._copy]
        numbers = [
            n
            for n in span.updates
            if n % UPDATES_PER_FRAME == 0 and (failure is None or n < failure.n_updates)
        ]
        if not numbers:
            return []
        rows = np.array(numbers) - span.updates.start
        lengths = span.commanded[rows, 0, self._copy].astype(np.float32)
        poses = span.qpos[rows, 0, self._copy].astype(np.float32).reshape(*lengths.shape[:2], -1, 7)
        heads = poses[:, self._head.module, list(self._head.front), :2].mean(axis=1)
        sensed = None if span.sensed is None else span.sensed[rows, 0, self._copy]
        forces = None if span.forces is None else span.forces[rows, 0, self._copy].astype(np.float16)
        finder = self._finder(span)
        return [
            ReplayFrame(
                time=number * self._period - self._settle_time,
                pose=poses[k],
                lengths=lengths[k],
                head=heads[k],
                find_contacts=finder.later(poses[k].ravel()),
                sensed=None if sensed is None else sensed[k],
                forces=None if forces is None else forces[k],
            )
            for k, number in enumerate(numbers)
        ]

    def _finder(self, span: Span) -> ContactFinder:
        model = span.sim.model(self._copy)
        if self._contacts is None or self._contacts.model is not model:  # walls have gone up
            self._contacts = ContactFinder(model)
        return self._contacts
