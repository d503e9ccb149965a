"""Which runs repeat each other, and what the groups of those that do are called.

Runs repeat each other if their configurations agree in all but the seed. A group is called by what sets it
apart from the others.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import Any, Final

from engine.config import RunConfig, inline_tables
from engine.control.rates import PUBLISHED_RATES
from engine.search.map_search import MapSearchConfig

ALGORITHM_NAMES: Final = {
    "random": "random search",
    "map-elites-2d": "MAP-Elites in 2-D",
    "vie-neat": "ViE-NEAT",
    "map-elites": "MAP-Elites",
    "dm-me": "DM-ME",
}
"""For people, the paper's three last and in its order."""
BUDGET: Final = "evaluations"
_UNREAD: Final = ("task", "seed")
_OF_MAPS: Final = {f.name for f in dataclasses.fields(MapSearchConfig)} | {"overlap"}
_OF_VIE_NEAT: Final = "vie_neat."
_PUBLISHED_NEAT: Final = {
    f"variation.neat.{name}": value for name, value in dataclasses.asdict(PUBLISHED_RATES).items()
}

Settings = Mapping[str, Hashable]
"""What decides a run's outcome, by the name in a configuration file, such as ``trials.repeats``."""


def settings(config: RunConfig, at: int | None = None) -> dict[str, Hashable]:
    """Return what decides a run's outcome besides its task and seed.

    Settings that its algorithm does not read are left out. Of a file that is older than a setting, the
    configuration has the value that leaves the run as it was.

    Args:
        config: of the run.
        at: evaluations that the run is compared at. A larger budget makes no difference then: what a run has
            found by any moment does not depend on how long it goes on.
    """
    inline = inline_tables(RunConfig)
    found = {
        key: value
        for name, own in dataclasses.asdict(config).items()
        for key, value in _flatten(own, "" if name in inline else name)
        if key not in _UNREAD
    }
    for key in list(found):
        of_vie_neat = config.algorithm == "vie-neat"
        if key in _OF_MAPS if of_vie_neat else key.startswith(_OF_VIE_NEAT):
            del found[key]
    if at is not None:
        found[BUDGET] = min(config.evaluations, at)
    return found


def differing(groups: Iterable[Settings]) -> list[str]:
    """Return the settings in which some groups differ, in the order of the configuration."""
    every = list(groups)
    keys = dict.fromkeys(k for g in every for k in g)
    return [k for k in keys if len({g.get(k) for g in every}) > 1]


def name_groups(groups: Sequence[Settings]) -> list[str]:
    """Return a name for each of some groups that all differ.

    A name begins with the algorithm. Where several groups have one, as few settings as tell them apart
    follow. A usual value is not named, but for the number of evaluations: the default if a group has it, else
    that of more than half of the groups.
    """
    names = [""] * len(groups)
    for algorithm in dict.fromkeys(g["algorithm"] for g in groups):
        members = [k for k, g in enumerate(groups) if g["algorithm"] == algorithm]
        own = [groups[k] for k in members]
        chosen = _telling(own)
        usual = {key: _usual(key, own) for key in chosen}
        for k in members:
            named = [key for key in chosen if key in groups[k] and groups[k][key] != usual[key]]
            # once for all of a table that has the published values
            parts = list(dict.fromkeys(_part(key, groups[k]) for key in named))
            names[k] = ", ".join([ALGORITHM_NAMES.get(str(algorithm), str(algorithm)), *parts])
    return names


def _part(key: str, group: Settings) -> str:
    """Return what a group's name says of a setting."""
    if key in _PUBLISHED_NEAT and all(group.get(k) == v for k, v in _PUBLISHED_NEAT.items()):
        return "NEAT as published"
    return setting_text(key, group[key], group)


def setting_text(key: str, value: Hashable, among: Iterable[str]) -> str:
    """Return a setting as a few words, such as ``sensors relative`` or ``2,000 evaluations``.

    Args:
        key: its name.
        value: of it.
        among: all names; as much of the name is said as no other ends in.
    """
    if key == BUDGET:
        return f"{value:,} evaluations"
    parts = key.split(".")
    others = [k.split(".") for k in among if k != key]
    n = next((n for n in range(1, len(parts)) if all(o[-n:] != parts[-n:] for o in others)), len(parts))
    words = " ".join(parts[-n:]).replace("_", " ")
    if isinstance(value, bool):
        return words if value else f"no {words}"
    return f"{words} {value_text(value)}"


def value_text(value: Hashable) -> str:
    """Return the value of a setting for people."""
    if isinstance(value, tuple):
        return " ".join(map(value_text, value)) or "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return short if float(short := f"{value:g}") == value else repr(value)
    return f"{value:,}" if isinstance(value, int) else str(value).replace("_", " ")


def _telling(groups: Sequence[Settings]) -> list[str]:
    """Return settings that tell groups apart, none of which could be left out."""
    chosen = differing(groups)
    # words say more than numbers, and what stands first in a configuration more than what follows
    backwards = chosen[::-1]
    words = [k for k in backwards if all(isinstance(g.get(k), str) for g in groups)]
    for key in [k for k in backwards if k not in words] + words:
        fewer = [k for k in chosen if k != key]
        if len({tuple(g.get(k) for k in fewer) for g in groups}) == len(groups):
            chosen = fewer
    return chosen


def _usual(key: str, groups: Sequence[Settings]) -> Hashable:
    """Return the value of a setting that goes without saying among groups of one algorithm, or None."""
    values = [g.get(key) for g in groups]
    if key == BUDGET:
        return None
    default = settings(RunConfig(algorithm=groups[0]["algorithm"])).get(key)  # type: ignore[arg-type]
    if default in values:
        return default
    return next((v for v in values if 2 * values.count(v) > len(values)), None)


def _flatten(value: Any, name: str) -> Iterable[tuple[str, Hashable]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flatten(inner, f"{name}.{key}" if name else key)
    else:
        yield name, value
