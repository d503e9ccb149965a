"""The lines between a host and the board, as text; ``engine/data/firmware/protocol.h`` reads the host's.

A host says ``t`` and what the robot senses, ``g`` go, ``s`` stop, ``a90`` servos to 90 degrees, ``x`` to test
itself and ``?``. The board says ``hello tensatlas 1 robot 637 modules 4 inputs 2 gaits 4`` and ``state NAME
UPDATES``, with the number of control updates since it was told to go.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.tasks import Task

BAUD: Final = 115200
VERSION: Final = 1
PATIENCE: Final = 0.5
"""Seconds after which servos release if a host falls silent: a dozen lines at 25 a second."""
LEAST_RATE: Final = 5
"""Lines a second that a host should send at least; fewer come near the board's patience."""
THOUSANDTHS: Final = 1000
"""Of its unit in which every value is sent: mm, mrad, and 1000 for yes."""
LARGEST: Final = 9_999_999
"""Largest number that the board reads."""
STATES: Final = ("stopped", "settling", "steering", "waiting", "held", "testing")
"""What the board may be doing; besides ``gait1``, ``gait2`` and so on."""
_HELLO: Final = re.compile(r"hello tensatlas (\d+) robot (\d+) modules (\d+) inputs (\d+) gaits (\d+)")
_STATE: Final = re.compile(r"state ([a-z]+\d*) (\d+)")


@dataclasses.dataclass(frozen=True, slots=True)
class Hello:
    """How the board introduces itself.

    Attributes:
        version: of the protocol.
        robot: number of its evaluation.
        modules, inputs, gaits: how many it has.
    """

    version: int
    robot: int
    modules: int
    inputs: int
    gaits: int

    @classmethod
    def read(cls, line: str) -> Hello | None:
        """Return what a line says, None if it is none of these."""
        found = _HELLO.fullmatch(line.strip())
        return cls(*map(int, found.groups())) if found else None


@dataclasses.dataclass(frozen=True, slots=True)
class BoardState:
    """What the board does.

    Attributes:
        name: one of ``STATES``, or ``gait`` and its number.
        updates: control updates since go; 0 where it does not run.
    """

    name: str
    updates: int

    @classmethod
    def read(cls, line: str) -> BoardState | None:
        """Return what a line says, None if it is none of these."""
        found = _STATE.fullmatch(line.strip())
        return cls(found[1], int(found[2])) if found else None


def sensed_line(values: Sequence[float] | np.ndarray) -> str:
    """Return the line that tells the board what its robot senses.

    Args:
        values: as a task's ``sense`` returns them, in m, rad and so on, before its factors.
    """
    whole = np.clip(np.rint(THOUSANDTHS * np.asarray(values, dtype=float)), -LARGEST, LARGEST)
    return "t" + ",".join(str(int(v)) for v in whole)


def line_format(task: Task) -> str:
    """Return for people what such a line holds, such as ``t<distance in mm>,<bearing in mrad>``."""
    units = {"m": "mm", "rad": "mrad", "": "thousandths"}
    return "t" + ",".join(
        f"<{name} in {units[unit]}>" for name, unit in zip(task.inputs, task.sensed_in, strict=True)
    )
