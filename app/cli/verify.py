"""The command ``verify``: simulates an elite again, as evolved or as it would be built."""

from __future__ import annotations

import dataclasses
import functools
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from app.worker_flags import check_workers
from engine.analysis.verify import MAX_SEEDS, Motion, Samples, Verification, changed_physics, verify
from engine.body.feet import feet_note
from engine.config import RunConfig
from engine.errors import InvalidData, printable
from engine.files import readable_json
from engine.search.archive import Cell, cell_name, parse_cell
from engine.simulation.evaluation import Evaluation
from engine.simulation.physics import Simulator, check_timestep, physics_to_json
from engine.storage.reader import RunReader
from engine.tasks import get_task

if TYPE_CHECKING:  # the libraries that shape parts take a while to import
    from engine.analysis.as_built import AsBuilt
    from engine.fabrication.as_built import Deviation, Twin


@dataclasses.dataclass(frozen=True, kw_only=True)
class Verify:
    """Simulate an elite again, with fresh noise and, if asked for, another physics or as it would be built.

    Prints its fitness as recorded and as simulated again, and how the robot moves. Without another
    physics only the noise is new.
    """

    path: tyro.conf.Positional[Path]
    """Run file."""
    archive: str = "morphology"
    """Map to take the elite from: morphology or controller, or of MAP-Elites grid."""
    cell: str | None = None
    """Cell of the map, such as 3,7 or 3,7,0,4; all count from 0."""
    inertia_scale: float | None = None
    """Factor on every inertia; 1 is the real one. The time step follows it to stay stable."""
    timestep_factor: float | None = None
    """Factor on the time step, such as 0.25."""
    simulator: Simulator | None = None
    """Another simulator: kernel, or mujoco (Newton's method), the reference."""
    as_built: bool = False
    """Simulate the robot with all that differs when it is built, and say which difference costs most."""
    materials: str = "latex-sheet"
    """For --as-built, what it is built from: latex-sheet, tpu-85a, silicone-sheet, or your TOML file."""
    samples: int = 20
    """For --as-built, how many robots of the design are simulated, each as inexact as tolerances allow."""
    best: int | None = None
    """For --as-built, in place of --cell: a table of so many of the map's best robots."""
    seeds: int = 5
    """Evaluations with fresh noise, each of all targets and repeats."""
    workers: int = os.cpu_count() or 1
    """Threads that simulate; the result does not depend on it."""
    json: bool = False
    """Print JSON, with every single evaluation."""

    def run(self, _: Console) -> None:
        """Simulate the elite again and print the results to standard output, as text or as JSON.

        Raises:
            InvalidData: a number is out of range, or the cell is empty or lies outside the map.
            RunFileError: the run cannot be read or has no such archive.
        """
        check_workers(self.workers)
        if not 1 <= self.seeds <= MAX_SEEDS:
            raise InvalidData(f"seeds must be from 1 to {MAX_SEEDS}, not {self.seeds}")
        if (self.cell is None) == (self.best is None):
            raise InvalidData("name one robot by --cell, or --best of the map with --as-built")
        if self.best is not None and not self.as_built:
            raise InvalidData("--best needs --as-built")
        with RunReader(self.path) as reader:
            config = reader.config
            if self.best is not None:
                from engine.analysis.as_built import best_elites

                self._table_of_best(config, best_elites(reader, self.archive, self.best))
                return
            evaluation = reader.evaluation(reader.elite_at(self.archive, parse_cell(self.cell or "")))
        if self.as_built:
            self._as_built(config, evaluation)
            return
        physics = changed_physics(
            config.physics,
            inertia_scale=self.inertia_scale,
            timestep_factor=self.timestep_factor,
            simulator=self.simulator,
        )
        found = verify(
            config,
            evaluation,
            physics=None if physics == config.physics else physics,
            n_seeds=self.seeds,
            n_threads=self.workers,
        )
        if self.json:
            print(readable_json(_facts(self, config, found)))
        else:
            _print(self, config, found)

    def _simulate(self, config: RunConfig, evaluation: Evaluation) -> tuple[Twin, AsBuilt]:
        """Simulate a robot as it would be built."""
        from engine.analysis.as_built import check_samples, simulate_as_built
        from engine.fabrication.as_built import twin_of_robot
        from engine.fabrication.materials import load_materials

        check_samples(self.samples)
        if (self.inertia_scale, self.timestep_factor, self.simulator) != (None, None, None):
            raise InvalidData("--as-built has the run's physics; it does not go with another one")
        check_timestep(config.physics)
        twin = twin_of_robot(config, evaluation, load_materials(self.materials))
        return twin, simulate_as_built(
            config,
            evaluation,
            nominal=twin.nominal,
            robots=twin.samples(self.samples),
            alone=twin.alone(),
            pairs=twin.feet_pairs(),
            n_seeds=self.seeds,
            n_threads=self.workers,
        )

    def _facts(self, cell: str | None, number: int, twin: Twin, found: AsBuilt) -> dict[str, Any]:
        """Return how a robot does as built, as JSON-ready values."""
        from engine.analysis.as_built import as_built_facts

        place = {"path": str(self.path), "archive": self.archive, "cell": cell}
        of = {"number": number, "materials": self.materials}
        return place | of | as_built_facts(found) | {"deviations": [d.to_json() for d in twin.deviations]}

    def _as_built(self, config: RunConfig, evaluation: Evaluation) -> None:
        """Simulate a robot as it would be built and print how it does."""
        twin, found = self._simulate(config, evaluation)
        if self.json:
            print(readable_json(self._facts(self.cell, evaluation.solution.number, twin, found)))
            return
        _print_head(self, evaluation)
        _print_as_built(self.materials, twin.deviations, found)

    def _table_of_best(self, config: RunConfig, best: Sequence[tuple[Cell, Evaluation]]) -> None:
        """Simulate robots as they would be built and print a row for each as soon as it is known.

        The rows are Markdown, for a page of results.
        """
        if not self.json:
            print(
                f"| cell | robot | body | evolved | as designed | {self.samples} robots | kept | costs most |"
            )
            print("| --- | --- | --- | --- | --- | --- | --- | --- |")
        facts = []
        for cell, evaluation in best:
            twin, found = self._simulate(config, evaluation)
            facts.append(self._facts(cell_name(cell), evaluation.solution.number, twin, found))
            if not self.json:
                print(_row(cell, evaluation, twin.deviations, found), flush=True)
        if self.json:
            print(readable_json({"robots": facts}))


def _row(cell: Cell, evaluation: Evaluation, deviations: Sequence[Deviation], found: AsBuilt) -> str:
    """Return a robot's row of the table of the best; f_s in cm."""
    from engine.analysis.as_built import SPREAD

    body = evaluation.solution.morphology
    names = {d.key: d.name for d in deviations} | {SPREAD: "how robots of the design differ"}
    spread = "" if found.robots.deviation is None else f" ± {_cm(found.robots.deviation)}"
    costly = [f"{names[key]} {_cm(cost)}" for key, cost in found.all_costs[:2] if cost > 0.001]
    fields = (
        cell_name(cell),
        evaluation.solution.number,
        f"{body.n_modules} modules, {body.stiffness_text}",
        _cm(found.evolved.mean),
        _cm(found.nominal.mean),
        _cm(found.robots.mean) + spread,
        "" if found.kept is None else f"{100 * found.kept:.0f} %",
        ", ".join(costly),
    )
    return "| " + " | ".join(map(str, fields)) + " |"


def _print_head(command: Verify, evaluation: Evaluation) -> None:
    number, body = evaluation.solution.number, evaluation.solution.morphology
    Console(highlight=False).print(
        f"Robot {number} of {printable(command.path.name)}, {command.archive} cell {command.cell}:"
        f" {body.n_modules} modules, stiffness {body.stiffness_text}{feet_note(body.feet)}",
        markup=False,
        soft_wrap=True,
    )


def _print_as_built(materials: str, deviations: Sequence[Deviation], found: AsBuilt) -> None:
    console = Console(highlight=False)
    table = Table(caption="f_s in cm under fresh noise; s.d.: standard deviation between evaluations")
    for name in ("", "f_s", "s.d.", "worst tenth", "failed"):
        table.add_column(name, justify="right" if name else "left")
    for name, scores, worst in (
        ("as evolved", found.evolved, None),
        (f"as built of {materials}", found.nominal, None),
        (f"{len(found.robots.f_s)} robots of that design", found.robots, found.worst),
    ):
        table.add_row(name, _cm(scores.mean), _cm(scores.deviation), _cm(worst), f"{scores.n_failed or ''}")
    console.print(table)
    alone = Table(caption="one difference at a time: f_s in cm, and what it costs")
    for name in ("differs", "as evolved", "as built", "source", "f_s", "costs"):
        alone.add_column(name, justify="right" if name in ("f_s", "costs") else "left", overflow="fold")
    costs = dict(found.costs)
    described = sorted(deviations, key=lambda d: -costs.get(d.key, -math.inf))
    for d in described:
        one = found.alone.get(d.key)
        built = "; ".join(part for part in (d.built, d.spread) if part)
        figures = ("", "") if one is None else (_cm(one.mean), _cm(costs.get(d.key)))
        alone.add_row(d.name, d.simulated, built, str(d.origin), *figures)
    console.print(alone)
    if found.pairs:
        feet = Table(caption="the design by the friction of its feet: f_s in cm")
        for name in ("forward", "backward", "f_s", "s.d."):
            feet.add_column(name, justify="right")
        for (forward, backward), scores in found.pairs.items():
            feet.add_row(f"{forward:g}", f"{backward:g}", _cm(scores.mean), _cm(scores.deviation))
        console.print(feet)
    for line in found.sentences({d.key: (d.name, d.remedy) for d in deviations}):
        console.print(line, markup=False, soft_wrap=True)


def _print(command: Verify, config: RunConfig, found: Verification) -> None:
    console = Console(highlight=False)
    say = functools.partial(console.print, markup=False, soft_wrap=True)
    _print_head(command, found.recorded)
    own, changed = found.own, found.changed
    same = "identical to" if found.identical else "not identical to"
    say(f"\nThe run's physics, {own.physics}: {same} what was recorded")
    console.print(_table(config, own, found.recorded))
    say(_motion_line(own.motion))
    if changed is None:
        return
    if found.plain is not None:
        say(
            "\nMuJoCo knows no feet that grip one way. So it is compared with the kernel for the robot"
            f" without its feet, with friction {own.physics.friction:g} both ways; all else is as in the run"
        )
        say(f"\nWithout feet, {found.plain.physics}")
        console.print(_table(config, found.plain, None))
        say(_motion_line(found.plain.motion))
    say(f"\nChanged physics, {changed.physics}{', without feet' if found.plain else ''}")
    if changed.physics.inertia_scale != own.physics.inertia_scale:
        say("The time step follows the inertia, so that the simulation stays stable.")
    if "kernel" in (own.physics.simulator, changed.physics.simulator) and (
        own.physics.simulator != changed.physics.simulator
    ):
        say("The kernel draws other noise from a seed than MuJoCo's runs: compare the means.")
    console.print(_table(config, changed, None))
    say(_motion_line(changed.motion))


def _table(config: RunConfig, samples: Samples, recorded: Evaluation | None) -> Table:
    task, n = get_task(config.task), len(samples.fresh)
    failed = f", {samples.n_failed} failed" if samples.n_failed else ""
    table = Table(caption="in cm; s.d.: standard deviation between evaluations")
    table.add_column("")
    columns = []
    if recorded:
        table.add_column("as recorded", justify="right")
        columns.append(_evaluation_column(config, recorded))
    table.add_column("same noise", justify="right")
    columns.append(_evaluation_column(config, samples.recorded_noise))
    table.add_column(f"fresh noise x {n}{failed}: mean", justify="right")
    table.add_column("s.d.", justify="right")
    columns += _fresh_columns(config, samples)
    names = ["f_s", *(f"to target {name}" for name in task.target_names), "head of the chain"]
    for row in zip(names, *columns, strict=True):
        table.add_row(*row)
    return table


def _motion_line(motion: Motion) -> str:
    return (
        f"In all these trials: without ground contact {motion.airborne:.2%} of the time, a module's centre"
        f" at most {100 * motion.height:.1f} cm high and {motion.speed:.3f} m/s fast"
    )


def _evaluation_column(config: RunConfig, e: Evaluation) -> list[str]:
    end = "last" if e.head_is_end else "first"
    if e.fitness is None:
        return ["failed", *[""] * len(e.distances), end]
    return [f"{_f_s(config, e.fitness):.2f}", *(f"{100 * d:.2f}" for d in e.distances.mean(axis=1)), end]


def _fresh_columns(config: RunConfig, samples: Samples) -> list[list[str]]:
    """Return the columns of means and of standard deviations."""
    ends, n = sum(e.head_is_end for e in samples.fresh), len(samples.fresh)
    end = {0: "first", n: "last"}.get(ends, f"last in {ends} of {n}")
    n_targets = get_task(config.task).n_targets
    if samples.mean is None or samples.distances is None:
        return [["failed", *[""] * n_targets, end], [""] * (n_targets + 2)]
    found = [e.distances.mean(axis=1) for e in samples.fresh if e.fitness is not None]
    spread = np.std(found, axis=0, ddof=1) if len(found) > 1 else [None] * n_targets
    return [
        [f"{_f_s(config, samples.mean):.2f}", *(f"{100 * d:.2f}" for d in samples.distances), end],
        [*("" if s is None else f"{100 * s:.2f}" for s in (samples.deviation, *spread)), ""],
    ]


def _f_s(config: RunConfig, fitness: float) -> float:
    """Return how many cm closer to its targets a robot ends than it started."""
    return 100.0 * (get_task(config.task).target_distance - fitness)


def _cm(length: float | None) -> str:
    """Return a length in m as cm; nothing for None."""
    return "" if length is None else f"{100.0 * length:.1f}"


def _facts(command: Verify, config: RunConfig, found: Verification) -> dict[str, Any]:
    return {
        "path": str(command.path),
        "archive": command.archive,
        "cell": command.cell,
        "number": found.recorded.solution.number,
        "identical": found.identical,
        "recorded": _evaluation_facts(config, found.recorded),
        "own": _sample_facts(config, found.own),
        "changed": None if found.changed is None else _sample_facts(config, found.changed),
        "without_feet": None if found.plain is None else _sample_facts(config, found.plain),
    }


def _evaluation_facts(config: RunConfig, e: Evaluation) -> dict[str, Any]:
    worked = e.fitness is not None
    return {
        "fitness_m": e.fitness,
        "f_s_cm": None if e.fitness is None else _f_s(config, e.fitness),
        "distances_m": e.distances.tolist() if worked else None,
        "head_is_end": e.head_is_end,
        "failure": e.failure,
    }


def _sample_facts(config: RunConfig, samples: Samples) -> dict[str, Any]:
    return {
        "physics": physics_to_json(samples.physics),
        "recorded_noise": _evaluation_facts(config, samples.recorded_noise),
        "fresh_noise": [_evaluation_facts(config, e) for e in samples.fresh],
        "f_s_mean_cm": None if samples.mean is None else _f_s(config, samples.mean),
        "f_s_deviation_cm": None if samples.deviation is None else 100.0 * samples.deviation,
        "motion": {
            "airborne": samples.motion.airborne,
            "height_m": samples.motion.height,
            "speed_m_per_s": samples.motion.speed,
        },
    }
