"""A run's configuration: everything that decides its outcome, and the presets."""

from __future__ import annotations

import dataclasses
import sys
import typing
from typing import Any, Final, Literal

from engine.body.morphology import StiffnessMode
from engine.errors import InvalidData
from engine.search.dm_me import check_cell_capacity
from engine.search.map_search import PAPER_REFITS, check_overlap, check_schedule
from engine.search.vie_neat import VieNeatConfig
from engine.simulation.evaluation import TrialConfig
from engine.simulation.physics import Physics
from engine.tasks import get_task

AlgorithmName = Literal["dm-me", "map-elites", "vie-neat"]


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class RunConfig:
    """What to evolve, with which algorithm, how long. Equal configurations give equal archives.

    Whether robots survive the physics is not checked here but where they are simulated: older run files
    have time steps that today's bodies do not bear, and can still be looked at.

    Raises:
        InvalidData: numbers that contradict each other.
    """

    task: str = "goal-reaching"
    """What the robots are asked to do: goal-reaching, squeezing, or a Python file with a task of your own."""
    algorithm: AlgorithmName = "dm-me"
    """How bodies and controllers are searched."""
    evaluations: int = 45_000
    """Number of solutions to evaluate in all."""
    initial: int = 1080
    """Random solutions in generation 0."""
    batch_size: int = 24
    """Solutions per later generation; half of the parents come from each archive of DM-ME."""
    refit_generations: tuple[int, ...] = PAPER_REFITS
    """Generations at which standardiser and PCA are fitted anew."""
    sensory: Literal["positions", "displacements"] = "positions"
    """What of the head's 1 Hz trajectory describes a controller."""
    cell_capacity: int = 1
    """Individuals per cell of DM-ME's controller archive; the published deep grid: 50."""
    stiffness: StiffnessMode = "shared"
    """One stiffness for all modules of a robot, as published, or one for each."""
    vie_neat: VieNeatConfig = VieNeatConfig()
    """Sizes and rates of ViE-NEAT's two populations."""
    overlap: int = 0
    """Generations begun before the oldest is finished, so that many workers never idle; not of ViE-NEAT."""
    seed: int = 0
    """Seed of everything random."""
    trials: TrialConfig = TrialConfig()
    """How long and how often a solution is tried."""
    physics: Physics = Physics()
    """How robots are simulated."""

    def __post_init__(self) -> None:
        get_task(self.task)
        if self.algorithm == "vie-neat":
            self.vie_neat.check_budget(self.evaluations)
        else:
            check_schedule(self.evaluations, self.initial, self.batch_size, self.refit_generations)
        check_overlap(self.overlap)
        if self.overlap and self.algorithm == "vie-neat":
            raise InvalidData("overlap is for dm-me and map-elites; generations of vie-neat do not overlap")
        check_cell_capacity(self.cell_capacity)
        if self.cell_capacity > 1 and self.algorithm != "dm-me":
            raise InvalidData(f"cell_capacity above 1 is for dm-me only; {self.algorithm} has no deep grid")
        period = self.physics.control_period
        for name in ("settle_time", "open_loop_time", "trial_time"):
            updates = getattr(self.trials, name) / period
            if abs(updates - round(updates)) > 1e-6:
                raise InvalidData(f"{name} must be a whole number of control periods ({period} s)")
        if not 0 <= self.seed < 2**32:
            raise InvalidData(f"seed must be from 0 to {2**32 - 1}, not {self.seed}")


PRESETS: Final[dict[str, RunConfig]] = {
    "paper": RunConfig(),
    "quick": RunConfig(
        evaluations=600,
        initial=240,
        vie_neat=VieNeatConfig(morphologies=24, mutants=24, controllers=28, elitism=2),
        trials=TrialConfig(repeats=1),
    ),
    "smoke": RunConfig(
        evaluations=40,
        initial=16,
        batch_size=6,
        refit_generations=(0, 2),
        vie_neat=VieNeatConfig(morphologies=8, mutants=8, controllers=10, elitism=1),
        trials=TrialConfig(repeats=2, settle_time=0.4, open_loop_time=0.6, trial_time=1.0),
    ),
}
"""Of every algorithm; options such as ``cell_capacity`` are added to them.

``paper``: the published experiment. ``quick``: one simulation per target instead of two and 600
evaluations, about half an hour on two cores. ``smoke``: seconds, the whole machinery, no science."""


def preset(name: str) -> RunConfig:
    """Return a preset by name.

    Raises:
        InvalidData: there is no such preset.
    """
    if name not in PRESETS:
        raise InvalidData(f"unknown preset {name!r}; choose from {', '.join(PRESETS)}")
    return PRESETS[name]


def to_json(config: RunConfig) -> dict[str, Any]:
    """Return a configuration as JSON-ready values."""
    return dataclasses.asdict(config)


def from_json(data: Any) -> RunConfig:
    """Read a configuration back from ``to_json``'s form.

    Raises:
        InvalidData: a field is unknown, of the wrong type or contradicts another.
    """
    return typing.cast(RunConfig, _read(RunConfig, data, "configuration"))


def physics_from_json(data: Any) -> Physics:
    """Read a physics back from the form that it has in ``to_json``'s result.

    Unlike a run's, it may be one that no robot survives.

    Raises:
        InvalidData: a field is unknown, of the wrong type or contradicts another.
    """
    return typing.cast(Physics, _read(Physics, data, "physics"))


_BEFORE: Final[dict[type, dict[str, Any]]] = {Physics: {"rod_inertia": 1.0}}
"""Values of fields that are newer than a file, where they are not today's defaults."""


def _read(kind: Any, value: Any, where: str) -> Any:
    if dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        if not isinstance(value, dict) or not set(value) <= set(hints):
            raise InvalidData(f"{where}: expected a table of {', '.join(hints)}")
        # a field that is newer than the file has the value that leaves the run as it was
        value = _BEFORE.get(typing.cast(type, kind), {}) | value
        fields = {k: _read(hints[k], v, f"{where}.{k}") for k, v in value.items()}
        return typing.cast(type, kind)(**fields)
    origin = typing.get_origin(kind)
    if origin is tuple:
        if not isinstance(value, list | tuple):
            raise InvalidData(f"{where}: expected a list")
        return tuple(_read(typing.get_args(kind)[0], v, where) for v in value)
    if origin is Literal:
        if value not in typing.get_args(kind):
            raise InvalidData(f"{where}: {value!r} is not one of {typing.get_args(kind)}")
        return value
    if kind is str and isinstance(value, str):
        return value
    if kind is float and type(value) in (int, float) and abs(value) <= sys.float_info.max:
        return float(value)
    if kind is int and type(value) is int:
        return value
    raise InvalidData(f"{where}: expected {getattr(kind, '__name__', kind)}, not {value!r}")
