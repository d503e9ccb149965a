"""The last moments of a simulation that failed, simulated again from a dump."""

from __future__ import annotations

import threading
from typing import Final

import mujoco
import numpy as np

from engine.body.morphology import Morphology
from engine.replay.dump import Dump
from engine.replay.recording import ContactFinder, ReplayFrame
from engine.simulation.divergence import ARENA_RADIUS, Guard
from engine.simulation.rollout import Head

FRAMES_PER_UPDATE: Final = 10
"""Most frames of a control update; every time step is one if there are no more."""


class DumpReplay:
    """Simulates a dump up to its failure; a ``Playable`` whose clock is 0 at the failure.

    Call ``advance`` in a separate thread; ``frames`` only grows.

    Args:
        dump: what to simulate.
    """

    def __init__(self, dump: Dump) -> None:
        self.dump = dump
        self.frames: list[ReplayFrame] = []
        self.target: np.ndarray | None = None
        self.walls = dump.failed.walls
        self.failure: str | None = None
        """The dump's reason, once everything is simulated."""
        self.reproduced: bool | None = None
        """Whether the simulation failed here too, at the same control update; None until it is known."""
        self.head = Head.of(self.morphology, dump.failed.head_is_end)
        self._physics = dump.physics
        steps = self._physics.steps_per_control
        self._frames_per_update = next(n for n in range(FRAMES_PER_UPDATE, 0, -1) if steps % n == 0)
        self._guard = Guard([dump.robot])
        self._contacts = ContactFinder(dump.model)
        self._gone = False
        self._cancelled = threading.Event()
        self._advancing = threading.Lock()

    @property
    def morphology(self) -> Morphology:
        """The robot's body."""
        return self.dump.failed.solution.morphology

    @property
    def start_time(self) -> float:
        """Time of the clock one ``frame_period`` before the first frame, in s."""
        n = len(self.dump.failed.failure.controls)
        return -n * self._physics.control_period - self.frame_period

    @property
    def end_time(self) -> float:
        """Time of the clock at the control update after which the simulation was stopped: 0 s."""
        return 0.0

    @property
    def frame_period(self) -> float:
        """Seconds between two frames."""
        return self._physics.control_period / self._frames_per_update

    def cancel(self) -> None:
        """Make ``advance`` return soon, and at once from then on."""
        self._cancelled.set()

    def advance(self, until: float = 0.0) -> None:  # noqa: ARG002 - a dump ends at its failure
        """Simulate everything, whatever ``until`` is; return early after ``cancel``."""
        with self._advancing:
            if self.failure is not None or self._cancelled.is_set():
                return
            self.frames, self._gone = [], False
            model, failure = self.dump.model, self.dump.failed.failure
            data = mujoco.MjData(model)
            mujoco.mj_setState(model, data, failure.state, mujoco.mjtState.mjSTATE_INTEGRATION)
            self._show(data, failure.controls[0])
            steps = self._physics.steps_per_control // self._frames_per_update
            n_done, diverged = 0, False
            while n_done < len(failure.controls) and not diverged:
                data.ctrl[:] = failure.controls[n_done]
                for _ in range(self._frames_per_update):
                    if self._cancelled.is_set():
                        return
                    mujoco.mj_step(model, data, steps)
                    self._show(data, failure.controls[n_done])
                n_done += 1
                diverged = self._diverged(data)
            self.reproduced = diverged and n_done == len(failure.controls)
            self.failure = failure.reason

    def _diverged(self, data: mujoco.MjData) -> bool:
        return bool(
            self._guard.judge(data.qpos[None], data.qvel[None], _warnings(data)[None], np.array([True]))
        )

    def _show(self, data: mujoco.MjData, controls: np.ndarray) -> None:
        """Add a frame, unless the robot can no longer be drawn."""
        # MuJoCo resets a robot after a warning, so later poses are not its own
        gone = not np.abs(data.qpos).max() < ARENA_RADIUS or _warnings(data).any()
        self._gone = self._gone or bool(gone)
        if self._gone:
            return
        lengths = np.clip(np.nan_to_num(controls, nan=1.0), 0.0, 1.0)
        lengths = lengths.reshape(self.morphology.n_modules, -1)
        time = self.start_time + (len(self.frames) + 1) * self.frame_period
        pose = data.qpos.astype(np.float32).reshape(len(lengths), -1, 7)
        head = pose[self.head.module, list(self.head.front), :2].mean(axis=0)
        find_contacts = self._contacts.later(data.qpos.copy())
        self.frames.append(ReplayFrame(time, pose, lengths.astype(np.float32), head, find_contacts))


def _warnings(data: mujoco.MjData) -> np.ndarray:
    return np.array([w.number for w in data.warning])
