"""A task: what robots are asked to do. ``docs/tasks.md`` shows how to write one.

Positions are horizontal, in metres. Bearings are in rad, positive to the left of the head's direction
(counter-clockwise seen from above); so "90 left" is pi/2.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Sequence
from typing import Final, Literal

import numpy as np

from engine.errors import InvalidData, TaskError
from engine.exact import cosine_and_sine
from engine.tasks.view import View
from engine.tasks.walls import BURIED, MAX_WALLS, Wall
from engine.tasks.watchdog import TIMEOUT_VARIABLE, TooLong, time_limit, timeout

SETTLE_TIME: Final = 3.0
"""Seconds without actuation before a trial's clock starts."""
TRIAL_TIME: Final = 40.0
"""Seconds a trial lasts after settling."""
LARGEST_SCORE: Final = 1e9
"""In m; whatever adds scores up, or shows them in cm, stays far from the largest number that there is."""
MAX_INPUTS: Final = 100
MAX_TARGETS: Final = 20
Sensors = Literal["centimetres", "relative"]
"""Units of what the built-in tasks sense: centimetres and radians, as published, or parts of the distance at
the start and of pi."""
Bonus = Literal["depth", "distance"]
"""What squeezing's bonus takes: a head that is far enough past the entrance or, as published, past it and far
enough from its middle."""
_NAME: Final = re.compile(r"[a-z0-9][a-z0-9-]{0,40}")


def remaining_distance(view: View) -> np.ndarray:
    """Return how far the heads are from their targets, (robots, copies) in m: the usual score."""
    return view.distance


def no_walls(_target: int, _n_modules: int) -> tuple[Wall, ...]:
    """Return the walls of an open plane: none."""
    return ()


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """One task: what the world holds, what a controller senses, how a final state scores.

    A trial begins when the robot has settled, with its head at the origin facing along x. Every solution is
    tried on every target, each in a separate world.

    Attributes:
        name: as on the command line and in run files: small letters, digits and dashes.
        inputs: a short name for every number that the controller senses.
        sense: called with a ``View`` before every control update; returns (robots, copies, inputs) numbers.
        target_distance: from the settled head to each target, in m; d_init of the reported fitness
            f_s = d_init - fitness.
        target_bearings: of the targets, in rad.
        names: of the targets, as shown; by default their bearings.
        walls: called with a target's index and the number of modules; returns the boxes of that world, in the
            settled head's frame. Leave room for the robot, which lies behind the origin and is up to 0.8 m
            long.
        score: called with a ``View`` of the final state; returns (robots, copies) numbers in m, to be
            minimised, like a distance.
        units: per input the factor by which a network gets what ``sense`` returns; by default 1. Networks do
            well with numbers from about -1 to 1: larger ones saturate their neurons.
        relative_units: these factors in a run whose sensors are relative; by default ``units``.
        sensed_in: per input the unit of what ``sense`` returns, "m", "rad" or "" for none, as people are told
            it; by default none.
        score_name: what the score is called.
        summary: the task in one line.
        file: the file it was loaded from; set by the loader.

    Raises:
        InvalidData: a field has the wrong type or value.
    """

    name: str
    inputs: tuple[str, ...]
    sense: Callable[[View], np.ndarray]
    target_distance: float
    target_bearings: tuple[float, ...]
    names: tuple[str, ...] = ()
    walls: Callable[[int, int], Sequence[Wall]] = no_walls
    score: Callable[[View], np.ndarray] = remaining_distance
    units: tuple[float, ...] = ()
    relative_units: tuple[float, ...] = ()
    sensed_in: tuple[str, ...] = ()
    score_name: str = "final distance"
    summary: str = ""
    file: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not _NAME.fullmatch(self.name):
            raise InvalidData(f"a task's name has small letters, digits and dashes only, not {self.name!r}")
        for field in ("inputs", "target_bearings", "names"):
            values = getattr(self, field)
            if isinstance(values, str) or not isinstance(values, Sequence):
                raise InvalidData(f"task {self.name}: {field} must be a tuple, not {values!r}")
            object.__setattr__(self, field, tuple(values))
        for field in ("inputs", "names"):
            for text in getattr(self, field):
                if not isinstance(text, str) or not text.isprintable() or not 0 < len(text) <= 40:
                    raise InvalidData(f"task {self.name}: {field} must be short texts, not {text!r}")
        if not 1 <= len(self.inputs) <= MAX_INPUTS:
            raise InvalidData(f"task {self.name}: 1 to {MAX_INPUTS} inputs, not {len(self.inputs)}")
        self._set_units()
        object.__setattr__(self, "sensed_in", tuple(self.sensed_in) or ("",) * len(self.inputs))
        if len(self.sensed_in) != len(self.inputs) or not set(self.sensed_in) <= {"m", "rad", ""}:
            raise InvalidData(f"task {self.name}: sensed_in has an 'm', 'rad' or '' for every input")
        if not 1 <= len(self.target_bearings) <= MAX_TARGETS:
            raise InvalidData(f"task {self.name}: 1 to {MAX_TARGETS} target_bearings")
        if self.names and len(self.names) != len(self.target_bearings):
            raise InvalidData(
                f"task {self.name}: {len(self.names)} names for {len(self.target_bearings)} targets"
            )
        for v in (self.target_distance, *self.target_bearings):
            if not isinstance(v, int | float) or not math.isfinite(v):
                raise InvalidData(f"task {self.name}: a target's distance and bearing are numbers, not {v!r}")
        if not self.target_distance > 0.0:
            raise InvalidData(f"task {self.name}: target_distance must be positive")
        for field in ("sense", "walls", "score"):
            if not callable(getattr(self, field)):
                raise InvalidData(f"task {self.name}: {field} must be a function")

    def _set_units(self) -> None:
        object.__setattr__(self, "units", self.units or (1.0,) * len(self.inputs))
        object.__setattr__(self, "relative_units", self.relative_units or self.units)
        for field in ("units", "relative_units"):
            factors = getattr(self, field)
            if isinstance(factors, str) or not isinstance(factors, Sequence):
                raise InvalidData(f"task {self.name}: {field} must be a tuple, not {factors!r:.80}")
            if len(factors) != len(self.inputs):
                raise InvalidData(f"task {self.name}: {len(factors)} {field} for {len(self.inputs)} inputs")
            for f in factors:
                if not isinstance(f, int | float) or not math.isfinite(f):
                    raise InvalidData(f"task {self.name}: {field} are finite numbers, not {f!r:.80}")
            object.__setattr__(self, field, tuple(map(float, factors)))

    def sensing(self, sensors: Sensors) -> Task:
        """Return this task as it is sensed in one of the units; the other's ``units`` are no longer known."""
        return self if sensors == "centimetres" else dataclasses.replace(self, units=self.relative_units)

    @property
    def n_inputs(self) -> int:
        """How many numbers the controller senses."""
        return len(self.inputs)

    @property
    def n_targets(self) -> int:
        """How many targets every solution is tried on."""
        return len(self.target_bearings)

    @property
    def target_names(self) -> tuple[str, ...]:
        """The targets' names, such as ``45° left``."""
        return self.names or tuple(map(bearing_name, self.target_bearings))


def target_offsets(task: Task, bearings: Sequence[float] | None = None) -> np.ndarray:
    """Return the (targets, 2) target positions in the settled head's frame: x ahead, y left."""
    bearings = task.target_bearings if bearings is None else bearings
    return task.target_distance * np.array([cosine_and_sine(b) for b in bearings])


def worlds(task: Task, n_modules: int) -> list[tuple[Wall, ...]]:
    """Return the walls for each target in the settled head's frame, the same number for every target.

    Raises:
        TaskError: the task's ``walls`` fails or returns something else.
    """
    found = []
    for target in range(task.n_targets):
        walls = _call(task, "walls", target, n_modules)
        if not isinstance(walls, Sequence) or not all(isinstance(w, Wall) for w in walls):
            raise TaskError(f"{_where(task)}: walls must return a tuple of Wall, not {walls!r:.80}")
        if len(walls) > MAX_WALLS:
            raise TaskError(f"{_where(task)}: at most {MAX_WALLS} walls, not {len(walls)}")
        found.append(tuple(walls))
    most = max(map(len, found))
    return [(*walls, *[BURIED] * (most - len(walls))) for walls in found]


def sensed(task: Task, view: View, alive: np.ndarray) -> np.ndarray:
    """Return what the controllers sense, (robots, copies, inputs), in the task's units.

    Args:
        task: whose sensors.
        view: of the simulations.
        alive: (robots, copies) whether a simulation has not failed; what a failed one senses is not checked.

    Raises:
        TaskError: the task's ``sense`` fails, or returns another shape or a number that is not finite.
    """
    return _checked(task, "sense", view, (*view.shape, task.n_inputs), alive) * np.array(task.units)


def scores(task: Task, view: View, alive: np.ndarray) -> np.ndarray:
    """Return the scores of the simulations, (robots, copies) in m.

    Args:
        task: whose score.
        view: of the simulations at their end.
        alive: (robots, copies) whether a simulation has not failed.

    Raises:
        TaskError: the task's ``score`` fails, or returns another shape or a number that is not finite.
    """
    values = _checked(task, "score", view, view.shape, alive)
    if (np.abs(values[alive]) > LARGEST_SCORE).any():
        raise TaskError(f"{_where(task)}: score returned a number beyond {LARGEST_SCORE:g}")
    return values


def _checked(task: Task, what: str, view: View, shape: tuple[int, ...], alive: np.ndarray) -> np.ndarray:
    values = _call(task, what, view)
    try:
        values = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise TaskError(f"{_where(task)}: {what} must return numbers, not {values!r:.80}") from None
    if values.shape != shape:
        raise TaskError(f"{_where(task)}: {what} must return an array {shape}, not {values.shape}")
    if not np.isfinite(values).all() and not np.isfinite(values[alive]).all():
        raise TaskError(f"{_where(task)}: {what} returned a number that is not finite")
    return values


def _call(task: Task, what: str, *arguments: object) -> object:
    """Call a function of a task; any error in a user's file becomes a ``TaskError``."""
    if not task.file:
        return getattr(task, what)(*arguments)
    try:
        with time_limit(f"{_where(task)}: {what}"):
            return getattr(task, what)(*arguments)
    except TooLong as e:
        raise TaskError(f"{_where(task)}: {what} {describe(e, task.file)}") from None
    except Exception as e:
        raise TaskError(f"{_where(task)}: {what} fails: {describe(e, task.file)}") from None


def _where(task: Task) -> str:
    return task.file or f"task {task.name}"


def describe(error: BaseException, file: str) -> str:
    """Return an error as one line of text, with the line of the file that raised it."""
    line, trace = None, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    if isinstance(error, TooLong):
        return (
            f"has not returned after {timeout():g} s"
            + (f" (line {line})" if line else "")
            + f"; if it needs longer, say how many seconds in {TIMEOUT_VARIABLE}"
        )
    text = " ".join(str(error).split())[:300].replace("Task.__init__() ", "Task is ")
    kind = "" if isinstance(error, InvalidData) else f"{type(error).__name__}: "
    return f"{kind}{text}" + (f" (line {line})" if line else "")


def bearing_name(bearing: float) -> str:
    """Return a bearing in rad as text, such as ``45° left``."""
    degrees = round(abs(math.degrees(bearing)))
    side = "left" if bearing > 0 else "right"
    return "straight ahead" if degrees == 0 else f"{degrees}° {side}"


def fitness(distances: np.ndarray) -> float:
    """Return the fitness in m, to be minimised (Zardini et al. 2021, equation 1).

    Args:
        distances: (targets, seeds) scores in m, for most tasks final distances.
    """
    per_target = np.asarray(distances).mean(axis=1)
    mean = per_target.mean()
    # never -0.0, whose sign a run file would not keep
    return float(mean + 0.5 * (per_target.max() - mean)) + 0.0
