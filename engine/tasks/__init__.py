"""What the world holds, what a controller senses, how a trial scores.

A user's task file needs ``Task``, ``View`` and ``Wall`` from here; ``docs/tasks.md`` teaches how to write
one. Read in this order:

- ``task``: what a task is, its checks, and the fitness of a robot.
- ``view``: what a task sees of the simulations at one moment.
- ``walls``: boxes that stand in a world, and distances to them.
- ``goal_reaching``, ``squeezing``: the two published tasks. The kernel computes what they sense and score
  a second time, in ``engine.simulation.kernel.loop.sensing``: change both.
- ``loading``: finds a task by its name, and loads those that users write.
- ``sides``: which targets lie at the left, and which at the right.
- ``watchdog``, ``onlooker``: limit the time of a user's function, from inside the process and from outside.
"""

from engine.tasks.goal_reaching import GOAL_REACHING
from engine.tasks.loading import BUILT_IN, TASKS_VARIABLE, get_task, load_task, task_version
from engine.tasks.squeezing import SQUEEZING, SQUEEZING_BY_DISTANCE
from engine.tasks.task import (
    LARGEST_SCORE,
    SETTLE_TIME,
    TRIAL_TIME,
    Bonus,
    Sensors,
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
    "LARGEST_SCORE",
    "SETTLE_TIME",
    "SQUEEZING",
    "SQUEEZING_BY_DISTANCE",
    "TASKS_VARIABLE",
    "TRIAL_TIME",
    "Bonus",
    "GroundFrame",
    "Sensors",
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
