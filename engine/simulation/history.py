"""Enough of a simulation's recent past to simulate its failure again."""

from __future__ import annotations

import dataclasses
from typing import Final

import numpy as np

BLOCK: Final = 50
"""Control updates between two complete states that are kept, 1 s by default.

Keeping the commands of every update and a complete state once a block, instead of a complete state of
every update, costs a tenth of the time and a twentieth of the memory: 2.7 MB for 64 simulations of six
modules. From there MuJoCo gives the same bits again.
"""
MAX_UPDATES: Final = 2 * BLOCK
"""Most control updates that a failure remembers."""


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Failure:
    """A simulation that was stopped, and its last K control updates; K is at most ``MAX_UPDATES``.

    Attributes:
        reason: why, in a few words for people.
        n_updates: control updates since the drop, the last one included.
        state: (n,) the complete state (``mjSTATE_INTEGRATION``) before those K updates.
        controls: (K, modules x 5) commanded lengths of the internal cables at each of them, in m, in
            the order of the actuators.
    """

    reason: str
    n_updates: int
    state: np.ndarray
    controls: np.ndarray

    def __str__(self) -> str:
        return self.reason


class History:
    """The last one to two blocks of every simulation of a batch.

    Args:
        n_simulations: in the batch.
        n_state: size of a complete state.
        n_controls: size of the controls.
    """

    def __init__(self, n_simulations: int, n_state: int, n_controls: int) -> None:
        self._states = np.zeros((2, n_simulations, n_state))
        self._controls = np.zeros((MAX_UPDATES, n_simulations, n_controls))
        self._first = 0

    def remember(self, n_updates: int, state: np.ndarray, controls: np.ndarray) -> None:
        """Keep what the next control update starts from.

        Args:
            n_updates: control updates so far.
            state: (simulations, n) complete states before it.
            controls: (simulations, modules x 5) its controls.
        """
        if n_updates % BLOCK == 0 or n_updates == self._first:
            self._states[n_updates // BLOCK % 2] = state
        self._controls[n_updates % MAX_UPDATES] = controls

    def begin(self, n_updates: int) -> None:
        """Forget everything before a control update: the world is another one from there on."""
        self._first = n_updates

    def branch(self, other: History, copies: int) -> None:
        """Take over another history, each of whose simulations goes on in several copies."""
        self._first = other._first
        self._states[:] = np.repeat(other._states, copies, axis=1)
        self._controls[:] = np.repeat(other._controls, copies, axis=1)

    def failure(self, i: int, n_updates: int, reason: str) -> Failure:
        """Return what led to the failure of a simulation.

        Args:
            i: the simulation.
            n_updates: control updates since the drop, the last one included.
            reason: why it failed.
        """
        block = max((n_updates - 1) // BLOCK - 1, self._first // BLOCK)
        rows = np.arange(max(block * BLOCK, self._first), n_updates) % MAX_UPDATES
        return Failure(reason, n_updates, self._states[block % 2, i].copy(), self._controls[rows, i])
