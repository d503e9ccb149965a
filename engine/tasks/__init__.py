"""Tasks: what the world holds, what a controller senses, how a final state scores.

A task's own file needs ``Task``, ``View`` and ``Wall`` from here; ``docs/tasks.md`` teaches how.
"""

from engine.tasks.goal_reaching import GOAL_REACHING
from engine.tasks.loading import BUILT_IN, TASKS_VARIABLE, get_task, load_task, task_version
from engine.tasks.squeezing import SQUEEZING
from engine.tasks.task import (
    SETTLE_TIME,
    TRIAL_TIME,
    Task,
    bearing_name,
    fitness,
    remaining_distance,
    scores,
    sensed,
    target_offsets,
    worlds,
)
from engine.tasks.view import GroundFrame, View, distance_and_bearing
from engine.tasks.walls import Wall

__all__ = [
    "BUILT_IN",
    "GOAL_REACHING",
    "SETTLE_TIME",
    "SQUEEZING",
    "TASKS_VARIABLE",
    "TRIAL_TIME",
    "GroundFrame",
    "Task",
    "View",
    "Wall",
    "bearing_name",
    "distance_and_bearing",
    "fitness",
    "get_task",
    "load_task",
    "remaining_distance",
    "scores",
    "sensed",
    "target_offsets",
    "task_version",
    "worlds",
]
