"""Finds tasks by name, and loads the task files that users write.

Code is loaded only from files that the user names, on the command line or in ``TENSATLAS_TASKS``. A run file
or a dump holds a task's name, which is looked up and never taken for a path.
"""

from __future__ import annotations

import dataclasses
import hashlib
import os
import sys
import threading
import types
from pathlib import Path
from typing import Final

import numpy as np

from engine.body.module import MAX_MODULES, MIN_MODULES
from engine.errors import InvalidData, TaskError, UnknownTask
from engine.tasks.goal_reaching import GOAL_REACHING
from engine.tasks.squeezing import SQUEEZING, SQUEEZING_BY_DISTANCE
from engine.tasks.task import Bonus, Sensors, Task, describe, scores, sensed, target_offsets, worlds
from engine.tasks.view import GroundFrame, View
from engine.tasks.walls import Obstacles
from engine.tasks.watchdog import TooLong, time_limit

BUILT_IN: Final = {task.name: task for task in (GOAL_REACHING, SQUEEZING)}
TASKS_VARIABLE: Final = "TENSATLAS_TASKS"
"""Environment variable with the user's task files, separated as in ``PATH``."""

_loaded: dict[str, tuple[Task, str]] = {}
_mutex = threading.RLock()


def get_task(name: str, sensors: Sensors = "centimetres", bonus: Bonus = "depth") -> Task:
    """Return a task by name: a built-in one, or one from a file that the user has named.

    Args:
        name: of the task.
        sensors: the units that it senses in. What simulates a run's robots takes the run's, see
            ``config.task_of``; to everything else they make no difference.
        bonus: the rule of squeezing's bonus; it goes with the sensors.

    Raises:
        UnknownTask: no task has this name.
        TaskError: a file of ``TENSATLAS_TASKS``, which may hold it, has an error.
    """
    task = _find(name)
    if task is SQUEEZING and bonus == "distance":
        task = SQUEEZING_BY_DISTANCE
    return task.sensing(sensors)


def _find(name: str) -> Task:
    if name in BUILT_IN:
        return BUILT_IN[name]
    with _mutex:
        if name not in _loaded:
            _load_listed(name)
        if name in _loaded:
            return _loaded[name][0]
    known = ", ".join([*BUILT_IN, *_loaded])
    raise UnknownTask(
        f"unknown task {name[:60]!r} (known: {known}); if it is one of your own, name its file in the"
        f" environment variable {TASKS_VARIABLE}"
    )


def task_version(name: str) -> dict[str, str]:
    """Return the hash of a task's file as an entry for a run's versions; empty for a built-in task."""
    return {f"task {name}": _loaded[name][1]} if name in _loaded else {}


def load_task(path: Path) -> Task:
    """Run a Python file and load its task, which can be found by its name from then on.

    Raises:
        TaskError: the file cannot be read, has an error or holds no proper task.
    """
    file = str(path)
    try:
        source = path.read_bytes()
    except OSError as e:
        raise TaskError(f"{file} cannot be read: {e.strerror or e}") from None
    task = _run(source, file)
    if not isinstance(task, Task):
        raise TaskError(f"{file} must define TASK = Task(...); docs/tasks.md shows how")
    if task.name in BUILT_IN:
        raise TaskError(f"{file}: {task.name} is the name of a built-in task; choose another")
    task = dataclasses.replace(task, file=file)
    _try_out(task)
    with _mutex:
        _loaded[task.name] = (task, f"sha256:{hashlib.sha256(source).hexdigest()[:16]}")
    return task


def _load_listed(name: str) -> None:
    """Load the files of the environment variable until one holds the wanted task."""
    error = None
    for part in filter(None, os.environ.get(TASKS_VARIABLE, "").split(os.pathsep)):
        if any(task.file == part for task, _ in _loaded.values()):
            continue
        try:
            if load_task(Path(part)).name == name:
                return
        except TaskError as e:
            error = error or TaskError(f"{e} (listed in {TASKS_VARIABLE})")
    if error is not None:
        raise error


def _run(source: bytes, file: str) -> object:
    module = types.ModuleType(f"tensatlas_task_{hashlib.sha256(file.encode()).hexdigest()[:12]}")
    module.__file__ = file
    # dataclasses look up their module
    sys.modules[module.__name__] = module
    try:
        with time_limit(file):
            exec(compile(source, file, "exec"), module.__dict__)
    except SyntaxError as e:
        where = f", line {e.lineno}" if e.lineno else ""
        raise TaskError(f"{file}{where}: {e.msg}") from None
    except (Exception, SystemExit, TooLong) as e:
        raise TaskError(f"{file}: {describe(e, file)}") from None
    return getattr(module, "TASK", None)


def _try_out(task: Task) -> None:
    """Call every function of a task, for the smallest and the largest robots.

    Raises:
        TaskError: something fails or has the wrong shape.
    """
    for n_modules in (MIN_MODULES, MAX_MODULES):
        try:
            view = made_up_view(task, n_modules)
        except InvalidData as e:
            raise TaskError(f"{task.file}: {e}") from None
        alive = np.ones(view.shape, dtype=bool)
        sensed(task, view, alive)
        scores(task, view, alive)


def made_up_view(task: Task, n_modules: int) -> View:
    """Return a task's view of three robots: at the start, half way and turned away, at the target.

    Raises:
        TaskError: the task's ``walls`` fails.
    """
    obstacles = Obstacles(worlds(task, n_modules))
    targets = target_offsets(task)
    front = np.stack([0.0 * targets, 0.5 * targets, targets])
    facing = np.array([[0.07, 0.0], [-0.05, 0.05], [0.0, 0.07]])[:, None]
    behind = np.arange(n_modules)[:, None, None] * np.array([-0.075, 0.0, 0.0]) + np.array([0.0, 0.0, 0.04])
    centres = np.concatenate([front, np.zeros((*front.shape[:2], 1))], axis=-1)[:, :, None, None] + behind
    return View(
        front=front,
        rear=front - facing,
        target=np.broadcast_to(targets, front.shape),
        frame=GroundFrame(np.zeros((3, 1, 2)), np.broadcast_to(np.eye(2), (3, 1, 2, 2))),
        obstacles=obstacles,
        time=1.0,
        rods=lambda: np.broadcast_to(centres, (*front.shape[:2], n_modules, 6, 3)),
        height=lambda: np.full(front.shape[:2], 0.04),
    )
