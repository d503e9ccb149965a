"""From a controller's outputs to the target lengths of the internal cables."""

from __future__ import annotations

import importlib.resources
from typing import Final

import numpy as np

FREQUENCIES: Final = np.array([0.25, 0.5])
"""Frequencies a module can contract at, in Hz."""
PHASES: Final = np.array([0.0, 1.57, 3.14, 4.71])
"""Phases a module can contract at, in rad."""
N_RHYTHMS: Final = len(FREQUENCIES) * len(PHASES)
"""Ways in which a module can contract: phase p of frequency f is number f x phases + p."""
PULSE: Final = 4
"""The rhythm of every module of a body without rhythms while its head is searched: 0.5 Hz, phase 0."""


def _load_table(name: str) -> np.ndarray:
    path = importlib.resources.files("engine") / "data" / name
    with path.open(encoding="utf-8") as f:
        return np.loadtxt(f, delimiter=",", skiprows=1)[:, 1:]


TARGET_LENGTHS: Final = _load_table("servo_target_lengths.csv")
"""(181, 5) target lengths of the internal cables, in metres, at commands 0, 1, ... 180 degrees.

The order is that of ``module.SERVO_NODES``; the values are the published actuator model's.
"""
DRUM_LENGTHS: Final = _load_table("drum_lengths.csv")
"""(181, 5) the same as a printed drum gives them, whose cams come as near to the published table as they can
(``engine.fabrication.parts.cams``)."""


def pick(options: np.ndarray, outputs: np.ndarray) -> np.ndarray:
    """Let outputs in [0, 1] choose from a list: item min(floor(output x n), n - 1).

    NaN, which a diverged simulation senses, chooses the first item.
    """
    scaled = outputs * len(options)
    index = np.zeros(outputs.shape, dtype=np.intp)
    for k in range(1, len(options)):
        index += scaled >= k
    return options[index]


def command_angle(frequency: np.ndarray, phase: np.ndarray, time: float) -> np.ndarray:
    """Return the servo commands in degrees, 0 released to 180 contracted.

    Args:
        frequency: array of any shape, in Hz.
        phase: array of the same shape, in rad.
        time: seconds since the start of the simulation, settling included.
    """
    return 90.0 * (np.sin(2.0 * np.pi * frequency * time + phase) + 1.0)


def target_lengths(command: np.ndarray, table: np.ndarray = TARGET_LENGTHS) -> np.ndarray:
    """Return the target lengths in metres, (..., 5), for commands in degrees, (...).

    Args:
        command: of any shape.
        table: (181, 5) lengths at commands 0, 1, ... 180 degrees.
    """
    command = np.clip(command, 0.0, 180.0)
    below = np.minimum(command.astype(int), 179)
    part = (command - below)[..., None]
    return np.asarray(table[below] * (1.0 - part) + table[below + 1] * part)
