"""The command ``info``: what a run file holds."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console

from engine.analysis.profile import Profile, threshold
from engine.body.feet import FEET_TEXT
from engine.config import RunConfig, to_json
from engine.files import readable_json
from engine.runs.described import describe
from engine.simulation.provenance import Computer, differing
from engine.storage.reader import RunReader
from engine.storage.rows import Generation
from engine.tasks import get_task


@dataclasses.dataclass(frozen=True, kw_only=True)
class Info:
    """Say what a run file holds."""

    path: tyro.conf.Positional[Path]
    """Run file."""
    json: bool = False
    """Print JSON, with the hash that equal runs share."""
    config: bool = False
    """Print the configuration as TOML, for a run that repeats this one: evolve RUN --config FILE."""

    def run(self, _: Console) -> None:
        """Print to standard output, as text or as JSON.

        Raises:
            RunFileError: the file cannot be read.
        """
        with RunReader(self.path) as reader:
            if self.config:
                print(describe(reader.config), end="")
                return
            facts = _facts(reader)
            if self.json:
                facts["config"] = to_json(reader.config)
                facts["hash"] = reader.canonical_hash()
                print(readable_json(facts))
                return
            lines = list(_lines(reader, facts))
        out = Console(highlight=False, soft_wrap=True)
        for name, text in lines:
            out.print(f"{name:<12} {text}", markup=False)


def _facts(reader: RunReader) -> dict[str, Any]:
    generations = reader.generations()
    last = generations[-1] if generations else None
    return {
        "path": str(reader.path),
        "task": reader.config.task,
        "algorithm": reader.config.algorithm,
        "feet": reader.config.body.feet,
        "evaluations": reader.n_evaluations(),
        "budget": reader.config.evaluations,
        "failed": last.n_failed if last else 0,
        "generations": len(generations),
        "seconds": round(last.seconds, 1) if last else 0.0,
        "created_at": reader.created_at,
        "projection": reader.projection,
        "slimmed": None if reader.slimmed is None else {"robots": reader.slimmed.n_kept},
        "live": reader.is_live,
        "versions": reader.versions,
        "archives": _archive_facts(reader, last),
        "computed_on": [{"evaluations": n, **dataclasses.asdict(c)} for c, n in reader.computers().items()],
    }


def _archive_facts(reader: RunReader, last: Generation | None) -> dict[str, dict[str, Any]]:
    if last is None:
        return {}
    task = get_task(reader.config.task)
    profiles = {
        name: Profile.of([task.target_distance - s.fitness for _, s in cells.values()], task)
        for name, cells in reader.elites(last).items()
    }
    return {
        name: {
            "best_cm": None if f.best is None else round(100 * f.best, 3),
            "qd_score_cm": round(100 * f.qd_score, 3),
            "coverage": round(f.coverage, 4),
            "offset_qd_score_cm": round(100 * profiles[name].offset_qd_score, 3),
            "threshold_cm": round(100 * threshold(task), 3),
            "cells_above": profiles[name].above,
        }
        for name, f in last.archives.items()
    }


def computers_differ(computers: Sequence[Computer], simulator: str) -> list[str]:
    """Return in what the computers of a run differ that its simulator's results may hang on.

    The kernel's have the same bits whatever a processor's instructions are (docs/physics.md).
    """
    if simulator == "kernel":
        computers = [dataclasses.replace(c, simd="") for c in computers]
    return differing(computers)


def _feet_text(config: RunConfig) -> str:
    """Return which feet a run's robots may have, and their friction."""
    kinds = " or ".join(FEET_TEXT[f] for f in config.body.feet_genes)
    physics = config.physics
    return (
        f"{config.body.feet} ({kinds}), friction {physics.feet_forward:g} forward,"
        f" {physics.feet_backward:g} backward"
    )


def _lines(reader: RunReader, facts: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the name and the text of every line."""
    for key in ("task", "algorithm", "generations", "created_at", "live"):
        yield key, facts[key]
    yield "evaluations", f"{facts['evaluations']} of {facts['budget']}"
    yield "physics", str(reader.config.physics)
    if reader.config.body.feet != "none":
        yield "feet", _feet_text(reader.config)
    if reader.projection is not None:
        kind, source = (reader.projection.get(k, "unknown") for k in ("kind", "source"))
        yield "projection", f"of {source}: {kind}"
    if given := reader.given():
        names = ", ".join(g.origin for g in given[:3]) + (", ..." if len(given) > 3 else "")
        yield "starts from", f"{len(given)} given robot{'s' * (len(given) > 1)}: {names}"
    if reader.slimmed is not None:
        yield (
            "slimmed",
            f"it holds {reader.slimmed.n_kept} robots, all that the explorer shows, and of the others the"
            " figures; it cannot be resumed",
        )
    yield "failed", facts["failed"]
    if reader.task_change:
        yield "note", f"{reader.task_change}: results may differ"
    computers = reader.computers()
    for computer, n in computers.items():
        yield "computed on", f"{computer}: {n} evaluations"
    for difference in computers_differ(list(computers), reader.config.physics.simulator):
        yield "note", f"computers differ in {difference}: the last bits may too"
    for name, figures in facts["archives"].items():
        if figures["best_cm"] is None:
            yield name, "empty"
        else:
            yield (
                name,
                f"best f_s {figures['best_cm']:.2f} cm, QD score {figures['qd_score_cm']:.1f} cm,"
                f" with offset {figures['offset_qd_score_cm']:.0f} cm, coverage {figures['coverage']:.0%},"
                f" {figures['cells_above']} cells above {figures['threshold_cm']:.2f} cm",
            )
