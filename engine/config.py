"""A run's configuration: everything that decides its outcome, and the presets."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import sys
import typing
from collections.abc import Sequence
from typing import Annotated, Any, Final, Literal

from engine.body.feet import FEET_TEXT, BodyConfig
from engine.body.morphology import HeadSearch, StiffnessMode
from engine.errors import InvalidData
from engine.search.algorithm import Algorithm
from engine.search.body_space import BodySpace
from engine.search.dm_me import DoubleMapMapElites, MorphologyMapElites, RandomSearch
from engine.search.map_elites import MapElites
from engine.search.map_search import MapSearch, MapSearchConfig, check_overlap
from engine.search.variation import PUBLISHED, GivenRobot, VariationConfig
from engine.search.vie_neat import VieNeat, VieNeatConfig
from engine.simulation.physics import Physics, physics_to_json
from engine.simulation.trials import TrialConfig
from engine.tasks import Bonus, Sensors, Task, get_task
from engine.tasks.sides import sides_of

INLINE: Final = "inline"
"""Marks a table of the configuration whose fields stand among those of the run, in files and as flags."""

_MAX_COUNT: Final = 2**40
"""Largest number of a node or an innovation of a given robot: the run counts on from there."""

AlgorithmName = Literal["dm-me", "map-elites", "map-elites-2d", "vie-neat", "random"]


_MAP_SEARCHES: Final[dict[str, type[MapSearch]]] = {
    "dm-me": DoubleMapMapElites,
    "map-elites": MapElites,
    "map-elites-2d": MorphologyMapElites,
    "random": RandomSearch,
}


MAX_EVALUATIONS: Final = 10_000_000
"""200 times the published number; what counts evaluations stays within a machine's memory."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class RunConfig:
    """What to evolve, with which algorithm, how long. Equal configurations give equal archives.

    Whether robots survive the physics is checked where they are simulated, not here: older run files whose
    time steps are too large for today's bodies can still be viewed.

    Raises:
        InvalidData: numbers that contradict each other.
    """

    task: str = "goal-reaching"
    """What the robots are asked to do: goal-reaching, squeezing, or a Python file with a task of your own."""
    algorithm: AlgorithmName = "dm-me"
    """How bodies and controllers are searched."""
    evaluations: int = 45_000
    """Number of solutions to evaluate in all."""
    map_search: Annotated[MapSearchConfig, INLINE] = MapSearchConfig()
    """Sizes of DM-ME's and MAP-Elites' generations, and what describes a controller."""
    stiffness: StiffnessMode = "shared"
    """One stiffness for all modules of a robot, as published, or one for each."""
    head_search: HeadSearch = "together"
    """How the head is found: all modules pulse together, or each by a rhythm of its own that evolves."""
    body: BodyConfig = BodyConfig()
    """What bodies have beyond modules."""
    sensors: Sensors = "relative"
    """Units of the built-in sensors: relative (to the distance at the start and to pi), or as published."""
    bonus: Bonus = "depth"
    """Squeezing's bonus is for a head 4 cm past the entrance (depth), or past it and 4 cm off its middle."""
    variation: VariationConfig = VariationConfig()
    """How new solutions come about."""
    vie_neat: VieNeatConfig = VieNeatConfig()
    """Sizes and rates of ViE-NEAT's two populations."""
    overlap: int = 0
    """Generations begun before the oldest is finished, so that many workers never idle; not for ViE-NEAT."""
    seed: int = 0
    """Seed of everything random."""
    trials: TrialConfig = TrialConfig()
    """How long and how often a solution is tried."""
    physics: Physics = Physics()
    """How robots are simulated."""

    def __post_init__(self) -> None:
        get_task(self.task)
        if self.evaluations > MAX_EVALUATIONS:
            raise InvalidData(f"evaluations must be at most {MAX_EVALUATIONS}, not {self.evaluations:.6g}")
        if self.algorithm == "vie-neat":
            self.vie_neat.check_budget(self.evaluations)
        else:
            self.map_search.check_schedule(self.evaluations)
        check_overlap(self.overlap)
        if self.overlap and self.algorithm == "vie-neat":
            raise InvalidData("generations of vie-neat do not overlap; overlap is for the other algorithms")
        if self.map_search.cell_capacity > 1 and self.algorithm != "dm-me":
            raise InvalidData(f"cell_capacity above 1 is for dm-me only; {self.algorithm} has no deep grid")
        if (
            self.map_search.controller_share != MapSearchConfig().controller_share
            and self.algorithm != "dm-me"
        ):
            raise InvalidData(
                f"controller_share is for dm-me only; parents of {self.algorithm} are from one map"
            )
        if self.body.feet != "none" and self.physics.simulator != "kernel":
            raise InvalidData(
                f"{self.physics.simulator} knows no directional feet; use --physics.simulator kernel or"
                " --body.feet none"
            )
        period = self.physics.control_period
        for name in ("settle_time", "open_loop_time", "trial_time"):
            updates = getattr(self.trials, name) / period
            if abs(updates - round(updates)) > 1e-6:
                raise InvalidData(f"{name} must be a whole number of control periods ({period} s)")
        if not 0 <= self.seed < 2**32:
            raise InvalidData(f"seed must be from 0 to {2**32 - 1}, not {self.seed}")


def task_of(config: RunConfig) -> Task:
    """Return a run's task as its robots sense it; whatever drives a controller takes it from here."""
    return get_task(config.task, config.sensors, config.bonus)


def bodies_of(config: RunConfig) -> BodySpace:
    """Return the bodies that a run draws."""
    return BodySpace(
        stiffness=config.stiffness,
        rhythms=config.head_search == "rhythms",
        feet=config.body.feet_genes,
        feet_axis=config.body.feet_axis,
    )


def create_algorithm(config: RunConfig, given: Sequence[GivenRobot] = ()) -> Algorithm:
    """Return a fresh algorithm for a configuration.

    Args:
        config: of the run.
        given: robots that it starts from.

    Raises:
        InvalidData: a given robot does not fit the configuration, or they are too many.
    """
    for robot in given:
        _check_given(config, robot)
    algorithm = _create_algorithm(config)
    algorithm.begin_with(given)
    return algorithm


def _check_given(config: RunConfig, robot: GivenRobot) -> None:
    """Make sure that a given robot could be one of the run's own."""
    body, controller = robot.morphology, robot.controller
    n_inputs = get_task(config.task).n_inputs
    if config.algorithm == "vie-neat":
        raise InvalidData("vie-neat pairs bodies with controllers anew and cannot start from given robots")
    if controller.n_inputs != n_inputs:
        raise InvalidData(
            f"{robot.origin} senses {controller.n_inputs} numbers; robots of {config.task} sense {n_inputs}"
        )
    if body.stiffness_mode != config.stiffness:
        raise InvalidData(
            f"{robot.origin} is of a run with --stiffness {body.stiffness_mode}; this one has"
            f" {config.stiffness}"
        )
    search = "rhythms" if body.rhythms else "together"
    if search != config.head_search:
        raise InvalidData(
            f"{robot.origin} is of a run with --head-search {search}; this one has {config.head_search}"
        )
    if body.feet not in config.body.feet_genes:
        allowed = ", ".join(FEET_TEXT[f] for f in config.body.feet_genes)
        raise InvalidData(f"{robot.origin} has feet {FEET_TEXT[body.feet]}; this run's are {allowed}")
    numbers = [n.key for n in controller.nodes] + [link.innovation for link in controller.connections]
    if max(map(abs, numbers)) > _MAX_COUNT:
        raise InvalidData(f"{robot.origin} has a node or an innovation with a number above {_MAX_COUNT}")


def _create_algorithm(config: RunConfig) -> Algorithm:
    task = task_of(config)
    common: dict[str, Any] = {
        "n_inputs": task.n_inputs,
        "bodies": bodies_of(config),
        "variation": config.variation,
        "seed": config.seed,
        "budget": config.evaluations,
    }
    if config.algorithm == "vie-neat":
        return VieNeat(config.vie_neat, **common)
    return _MAP_SEARCHES[config.algorithm](
        config.map_search, overlap=config.overlap, sides=sides_of(task), **common
    )


PRESETS: Final[dict[str, RunConfig]] = {
    "atlas": RunConfig(),
    "paper": RunConfig(
        map_search=MapSearchConfig(sensory="displacements"),
        sensors="centimetres",
        bonus="distance",
        head_search="rhythms",
        variation=dataclasses.replace(PUBLISHED, neat=dataclasses.replace(PUBLISHED.neat, version="0.92")),
        vie_neat=VieNeatConfig(maximise="inverse"),
        trials=TrialConfig(unfed_outputs="zero"),
    ),
    "quick": RunConfig(
        evaluations=600,
        map_search=MapSearchConfig(initial=240),
        vie_neat=VieNeatConfig(morphologies=24, mutants=24, controllers=28, elitism=2),
        trials=TrialConfig(repeats=1),
    ),
    "smoke": RunConfig(
        evaluations=40,
        map_search=MapSearchConfig(initial=16, batch_size=6, refit_generations=(0, 2)),
        vie_neat=VieNeatConfig(morphologies=8, mutants=8, controllers=10, elitism=1),
        trials=TrialConfig(repeats=2, settle_time=0.4, open_loop_time=0.6, trial_time=1.0),
    ),
}
"""Presets for every algorithm; options such as ``cell_capacity`` are added to them.

``atlas``: ours, with gentle mutations and relative sensors. ``paper``: the published experiment. ``quick``: a
short ``atlas``, with one simulation per target instead of two and 600 evaluations. ``smoke``: seconds, the
whole machinery, no science."""


DEFAULT_PRESET: Final = "atlas"


def preset(name: str) -> RunConfig:
    """Return a preset by name.

    Raises:
        InvalidData: there is no such preset.
    """
    if name not in PRESETS:
        raise InvalidData(f"unknown preset {name!r}; choose from {', '.join(PRESETS)}")
    return PRESETS[name]


def every_value(config: RunConfig) -> dict[str, Any]:
    """Return a configuration as JSON-ready values; the fields of ``INLINE`` tables stand at its top."""
    inline = inline_tables(RunConfig)
    found: dict[str, Any] = {}
    for name, value in dataclasses.asdict(config).items():
        found |= value if name in inline else {name: value}
    return found | {"physics": physics_to_json(config.physics)}


def to_json(config: RunConfig) -> dict[str, Any]:
    """Return a configuration as run files hold it: ``every_value`` without those that older runs lack."""
    found = every_value(config)
    if not config.trials.trajectory_bits:
        # runs from before positions were rounded keep their hash
        del found["trials"]["trajectory_bits"]
    if not config.variation.exchange_weight:
        # and so do those from before controllers were exchanged
        del found["variation"]["exchange_weight"]
        if config.variation.donors == PUBLISHED.donors:
            del found["variation"]["donors"]
    if not config.variation.switch_weight:
        # and those from before specialists were joined
        del found["variation"]["switch_weight"]
    # runs from before there were feet keep theirs
    for table, default in ((found["physics"], Physics()), (found["variation"]["body"], PUBLISHED.body)):
        for name in ("feet_forward", "feet_backward", "feet_rate"):
            if name in table and config.body.feet == "none" and table[name] == getattr(default, name):
                del table[name]
    if config.body == BodyConfig():
        del found["body"]
    elif not config.body.feet_axis:
        del found["body"]["feet_axis"]
    return found


@functools.cache
def inline_tables(kind: type) -> dict[str, type]:
    """Return the ``INLINE`` tables of a configuration's dataclass, by the names of their fields."""
    hints = typing.get_type_hints(kind, include_extras=True)
    return {
        name: typing.get_args(hint)[0]
        for name, hint in hints.items()
        if INLINE in getattr(hint, "__metadata__", ())
    }


def replaced(config: RunConfig, **changes: Any) -> RunConfig:
    """Return a configuration with some fields changed; those of ``INLINE`` tables go by their own names.

    Raises:
        InvalidData: the fields contradict each other.
    """
    for name, kind in inline_tables(RunConfig).items():
        inner = {f.name: changes.pop(f.name) for f in dataclasses.fields(kind) if f.name in changes}
        if inner:
            changes[name] = dataclasses.replace(getattr(config, name), **inner)
    return dataclasses.replace(config, **changes)


def from_json(data: Any) -> RunConfig:
    """Read a configuration back from ``to_json``'s form.

    Raises:
        InvalidData: a field is unknown, of the wrong type or contradicts another.
    """
    return typing.cast(RunConfig, _read(RunConfig, data, "configuration"))


def physics_from_json(data: Any) -> Physics:
    """Read a physics back from the form that ``to_json`` gives it.

    Unlike a run's, it may be one that no robot survives.

    Raises:
        InvalidData: a field is unknown, of the wrong type or contradicts another.
    """
    return typing.cast(Physics, _read(Physics, data, "physics"))


_BEFORE: Final[dict[type, dict[str, Any]]] = {
    Physics: {"simulator": "mujoco", "rod_inertia": 1.0},
    RunConfig: {"sensors": "centimetres", "variation": dataclasses.asdict(PUBLISHED)},
    TrialConfig: {"trajectory_bits": 0},
    VariationConfig: {"exchange_weight": 0, "switch_weight": 0},
}
"""Values for fields that a file is too old to have, where they are not today's defaults."""


def _known(name: str, names: Sequence[str]) -> str:
    alike = difflib.get_close_matches(name, names, n=1)
    return f"did you mean {alike[0]}?" if alike else f"known are {', '.join(names)}"


def _read(kind: Any, value: Any, where: str) -> Any:
    if dataclasses.is_dataclass(kind):
        kind = typing.cast(type, kind)
        hints = typing.get_type_hints(kind)
        inline = {name: [f.name for f in dataclasses.fields(t)] for name, t in inline_tables(kind).items()}
        names = [n for name in hints for n in inline.get(name, [name])]
        if not isinstance(value, dict):
            raise InvalidData(f"{where}: expected a table of {', '.join(names)}")
        if unknown := set(value) - set(names):
            raise InvalidData(f"{where}: unknown {min(unknown)!r:.60}; {_known(min(unknown), names)}")
        # a field that is newer than the file has the value that leaves the run as it was
        value = _BEFORE.get(kind, {}) | value
        fields = {k: _read(hints[k], v, f"{where}.{k}") for k, v in value.items() if k in hints}
        for name, own in inline.items():
            fields[name] = _read(hints[name], {k: v for k, v in value.items() if k in own}, where)
        return kind(**fields)
    origin = typing.get_origin(kind)
    if origin is tuple:
        if not isinstance(value, list | tuple):
            raise InvalidData(f"{where}: expected a list")
        return tuple(_read(typing.get_args(kind)[0], v, where) for v in value)
    if origin is Literal:
        if value not in typing.get_args(kind):
            raise InvalidData(f"{where}: {value!r} is not one of {typing.get_args(kind)}")
        return value
    if kind in (str, bool) and type(value) is kind:
        return value
    if kind is float and type(value) in (int, float) and abs(value) <= sys.float_info.max:
        return float(value)
    if kind is int and type(value) is int:
        return value
    raise InvalidData(f"{where}: expected {getattr(kind, '__name__', kind)}, not {value!r}")
