"""An experiment of many runs, described in one file: a grid of tasks, algorithms and seeds."""

from __future__ import annotations

import dataclasses
import itertools
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from engine.config import PRESETS, RunConfig, from_json, preset, to_json
from engine.errors import InvalidData, TensAtlasError
from engine.files import read_toml
from engine.runs.described import merged
from engine.storage.schema import SUFFIX

MAX_RUNS: Final = 10_000
_TABLES: Final = ("preset", "tasks", "algorithms", "seeds", "repetitions", "first_seed", "config", "variants")
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,40}")


@dataclasses.dataclass(frozen=True, slots=True)
class PlannedRun:
    """One run of a campaign: the name of its file, without a folder, and its configuration."""

    file: str
    config: RunConfig


def read_campaign(path: Path) -> list[PlannedRun]:
    """Read a TOML file that describes a campaign; docs/clusters.md describes the file.

    Raises:
        InvalidData: it cannot be read, or a value is missing, unknown or does not fit the rest.
    """
    data = read_toml(path)
    try:
        return plan(data)
    except TensAtlasError as e:
        raise InvalidData(f"{path}: {e}") from None


def plan(data: dict[str, Any]) -> list[PlannedRun]:
    """Return the runs of a campaign, one repetition of all its kinds after the other.

    Args:
        data: ``tasks`` and ``algorithms``, each a list, and ``seeds``, a list that every kind of run uses, or
            ``repetitions``, how many runs of each kind there are, no two of the campaign with the same seed,
            from ``first_seed`` (1) on; optionally ``preset``, and ``config`` with fields that all runs share.
            ``algorithms`` may also name entries of ``variants``: tables of further fields, one of them
            ``algorithm``.

    Raises:
        InvalidData: a value is missing, unknown or does not fit the rest.
    """
    if unknown := set(data) - set(_TABLES):
        raise InvalidData(f"unknown {min(unknown)!r}; known are {', '.join(_TABLES)}")
    tasks, algorithms = (_names(data, key) for key in ("tasks", "algorithms"))
    for key, values in (("tasks", tasks), ("algorithms", algorithms)):
        if len(set(values)) < len(values):
            raise InvalidData(f"{key} names something twice")
    kinds = list(itertools.product(tasks, algorithms))
    seeds = _seeds(data, len(kinds))
    if len(seeds) * len(kinds) > MAX_RUNS:
        raise InvalidData(f"more than {MAX_RUNS} runs")
    chosen = data.get("preset", "paper")
    if not isinstance(chosen, str) or chosen not in PRESETS:
        raise InvalidData(f"preset must be one of {', '.join(PRESETS)}, not {chosen!r}")
    base = to_json(preset(chosen))
    common, variants = (_table(data, key) for key in ("config", "variants"))
    runs = []
    for (task, algorithm), seed in ((kind, s) for row in seeds for kind, s in zip(kinds, row, strict=True)):
        own = {"algorithm": algorithm}
        if algorithm in variants:
            own = _table(variants, algorithm)
            if not _NAME.fullmatch(algorithm) or "algorithm" not in own:
                raise InvalidData(f"variants.{algorithm}: needs a simple name and an algorithm")
        fields = merged(merged(base, common), own) | {"task": task, "seed": seed}
        runs.append(PlannedRun(f"{task}_{algorithm}_{seed}{SUFFIX}", from_json(fields)))
    return runs


def _seeds(data: dict[str, Any], n_kinds: int) -> list[Sequence[int]]:
    """Return for each repetition the seeds of its runs."""
    if ("seeds" in data) == ("repetitions" in data):
        raise InvalidData("either seeds or repetitions must be given")
    if "repetitions" in data:
        n = data["repetitions"]
        if type(n) is not int or not 1 <= n <= MAX_RUNS:
            raise InvalidData(f"repetitions must be a whole number from 1 to {MAX_RUNS}, not {n!r}")
        first = data.get("first_seed", 1)
        if type(first) is not int or first < 0:
            raise InvalidData(f"first_seed must be a whole number of at least 0, not {first!r}")
        return [range(first + k * n_kinds, first + (k + 1) * n_kinds) for k in range(n)]
    if "first_seed" in data:
        raise InvalidData("first_seed belongs to repetitions; seeds names every seed itself")
    seeds = data["seeds"]
    if not isinstance(seeds, list) or not seeds or not all(type(s) is int for s in seeds):
        raise InvalidData("seeds must be a list of whole numbers, such as [1, 2, 3]")
    if len(set(seeds)) < len(seeds):
        raise InvalidData("seeds names something twice")
    return [[seed] * n_kinds for seed in seeds]


def _names(data: dict[str, Any], key: str) -> list[str]:
    names = data.get(key)
    if not isinstance(names, list) or not names or not all(isinstance(n, str) for n in names):
        raise InvalidData(f"{key} must be a list of names")
    return names


def _table(data: dict[str, Any], key: str) -> dict[str, Any]:
    table = data.get(key, {})
    if not isinstance(table, dict):
        raise InvalidData(f"{key} must be a table")
    return table
