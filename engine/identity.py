"""A short name for a robot that any copy of it can be checked against."""

from __future__ import annotations

import dataclasses
import hashlib
from typing import Final

from engine.config import RunConfig
from engine.files import compact_json
from engine.simulation.evaluation import Solution
from engine.tasks import task_version

ID_LENGTH: Final = 10
"""Hexadecimal digits of an id: among a million robots two share one with a probability of half a percent."""


def robot_hash(config: RunConfig, solution: Solution) -> str:
    """Return the SHA-256 of what a robot is and does: both genotypes, the task and the physics.

    Equal robots of different runs have the same; the run's name, its seed and the noise do not count.
    """
    content = {
        "morphology": solution.morphology.to_json(),
        "controller": solution.controller.to_json(),
        "task": {"name": config.task, **task_version(config.task)},
        "physics": dataclasses.asdict(config.physics),
    }
    return hashlib.sha256(compact_json(content).encode()).hexdigest()


def robot_id(config: RunConfig, solution: Solution) -> str:
    """Return the first digits of ``robot_hash``, which people can read out to each other."""
    return robot_hash(config, solution)[:ID_LENGTH]
