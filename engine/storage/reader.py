"""Reading a run file, finished or live. Files may come from strangers: everything is checked."""

from __future__ import annotations

import bisect
import hashlib
import json
import math
import threading
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, Self

from engine.body.morphology import Morphology
from engine.config import RunConfig, from_json, to_json
from engine.errors import DamagedRunFile, InvalidData, RunFileError, TensAtlasError
from engine.files import compact_json
from engine.search.archive import Cell, cell_name, parse_cell
from engine.search.variation import GivenRobot
from engine.simulation.evaluation import Evaluation
from engine.simulation.provenance import Computer, Origin, versions
from engine.storage.database import Damage, RunDatabase
from engine.storage.layouts import tables_of
from engine.storage.layouts.plain import to_row
from engine.storage.layouts.tables import Change, Closed, Record, count, in_chunks, short
from engine.storage.lock import is_being_written
from engine.storage.rows import MAX_LINE, Ancestor, Generation, Slimmed, Summary
from engine.tasks import get_task, task_version

MAX_FACTS: Final = 100
MAX_FACT: Final = 2000
"""Facts about a run that are read, and characters of each: a stranger's file may have more."""
_FIRST_ROBOTS: Final = 64
"""Robots of the first generation that say whether two runs began with the same."""


class RunReader:
    """A run file opened for reading; may be shared by threads and used while the run is written.

    Raises:
        RunFileError: the file is missing, empty, cut short, of another program or a newer version, or its
            task is not known here.
        TaskError: a user's task file, which may hold its task, has an error.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._db = RunDatabase(path)
        self.format_version = self._db.format_version
        self._tables = tables_of(self._db.query, self.format_version)
        self._mutex = threading.Lock()
        self._changes: dict[str, list[tuple[int, Cell, int | None]]] = {}
        self._changes_until = -1
        self._bodies: list[Record] = []
        self._bodies_until = -1
        try:
            with self.guard():
                meta = self._tables.meta()
                self.config: RunConfig = from_json(meta.get("config"))
                self.projection = None if "projection" not in meta else _strings(meta["projection"])
                """What a projected run was made of, as ``RunWriter.create`` was told; None for others."""
                self.versions: dict[str, str] = _strings(meta.get("versions", {}))
                self.created_at = short(str(meta.get("created_at", "")), "the date")
                self.slimmed = Slimmed.from_json(meta["slimmed"]) if "slimmed" in meta else None
                """What is left in a slimmed run; None for others."""
                self._given = meta.get("given", [])
        except TensAtlasError:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    def given(self) -> list[GivenRobot]:
        """Return the robots that the run starts from.

        Raises:
            RunFileError: they are damaged.
        """
        with self.guard():
            return [GivenRobot.from_json(robot) for robot in self._given]

    @property
    def is_live(self) -> bool:
        """Whether a living process is writing the run."""
        return is_being_written(self.path)

    @property
    def task_change(self) -> str | None:
        """A warning if the file of the run's task has changed since the run was started, else None."""
        now = task_version(self.config.task)
        if all(self.versions.get(key) == version for key, version in now.items()):
            return None
        return f"the file of task {self.config.task} has changed since this run was started"

    def last_generation(self) -> int | None:
        """Return the number of the last closed generation, or None if there is none yet."""
        with self.guard():
            last = self._tables.last_generation()
            return None if last is None else count(last)

    def n_evaluations(self) -> int:
        """Return the number of saved evaluations, those of an open generation included."""
        with self.guard():
            return count(self._tables.n_evaluations())

    def generations(self, after: int = -1) -> list[Generation]:
        """Return the closed generations with a greater number, in order."""
        with self.guard():
            return [Generation.of(c) for c in self._tables.closed(after)]

    def last_closed(self) -> Generation | None:
        """Return the last closed generation, or None before the first."""
        last = self.last_generation()
        return None if last is None else next(iter(self.generations(last - 1)), None)

    def finished_generation(self, archive: str | None = None) -> Generation:
        """Return the last closed generation.

        Args:
            archive: that it must have; None if any will do.

        Raises:
            RunFileError: there is none yet, or it has no such archive.
        """
        last = self.last_closed()
        if last is None:
            raise RunFileError(f"{self.path} has no finished generation yet")
        if archive is not None and archive not in last.archives:
            found = ", ".join(sorted(last.archives))
            raise RunFileError(f"{self.path} has no {archive} archive, but {found}")
        return last

    def placements(self, archive: str, generation: int) -> dict[Cell, int]:
        """Return the evaluation that each filled cell held at the end of a generation."""
        held: dict[Cell, int] = {}
        for g, cell, number in self.placement_changes(archive):
            if g > generation:
                break
            if number is None:
                held.pop(cell, None)
            else:
                held[cell] = number
        return dict(sorted(held.items()))

    def elite_at(self, archive: str, cell: Cell) -> int:
        """Return the number of the evaluation that a cell holds after the last closed generation.

        Raises:
            RunFileError: there is no closed generation yet, or it has no such archive.
            InvalidData: the cell is empty, lies outside the map or has another number of indices.
        """
        last = self.last_closed()
        if last is None:
            raise RunFileError(f"{self.path} has no {archive} archive yet")
        if archive not in last.archives:
            found = " and ".join(last.archives)
            raise RunFileError(f"{self.path} has no {archive} archive; choose with --archive: {found}")
        shape = tuple(a.n for a in last.archives[archive].axes)
        limits = ", ".join(f"0..{n - 1}" for n in shape)
        if len(cell) != len(shape):
            raise InvalidData(
                f"a cell of the {archive} map has {len(shape)} indices ({limits}), not {len(cell)}:"
                f" {cell_name(cell)}"
            )
        if any(i >= n for i, n in zip(cell, shape, strict=True)):
            raise InvalidData(f"cell {cell_name(cell)} lies outside the {archive} map ({limits})")
        placed = self.placements(archive, last.number)
        if cell not in placed:
            raise InvalidData(f"cell {cell_name(cell)} of the {archive} map is empty")
        return placed[cell]

    def placement_changes(self, archive: str, after: int = -1) -> list[tuple[int, Cell, int | None]]:
        """Return the changes of an archive in order: generation, cell, its new evaluation or None.

        Args:
            archive: its name.
            after: the generation whose changes and those before it are left out.
        """
        with self._mutex, self.guard():
            # those of closed generations stay what they are
            new = [(g, name, parse_cell(c), n) for g, name, c, n in self._tables.changes(self._changes_until)]
            for g, name, cell, number in new:
                self._changes.setdefault(name, []).append((g, cell, number))
                self._changes_until = g
            changes = self._changes.get(archive, [])
        return changes[bisect.bisect_right(changes, after, key=lambda c: c[0]) :]

    def elites(self, generation: Generation) -> dict[str, dict[Cell, tuple[int, Summary]]]:
        """Return the number and the summary of every elite at the end of a generation, by archive and cell.

        Raises:
            RunFileError: the file cannot be read or is damaged.
        """
        placed = {name: self.placements(name, generation.number) for name in generation.archives}
        known = self.summaries({n for cells in placed.values() for n in cells.values()})
        for name, cells in placed.items():
            axes = generation.archives[name].axes
            for cell, number in cells.items():
                if number not in known:
                    raise DamagedRunFile(self.path, f"is damaged: evaluation {number} holds a cell of a map")
                if len(cell) != len(axes) or any(i >= a.n for i, a in zip(cell, axes, strict=True)):
                    raise DamagedRunFile(self.path, f"is damaged: cell {cell} lies outside a map")
        return {name: {cell: (n, known[n]) for cell, n in cells.items()} for name, cells in placed.items()}

    def contents(self, archive: str, generation: int) -> dict[Cell, Evaluation]:
        """Return the elites of an archive at the end of a generation, by cell."""
        placed = self.placements(archive, generation)
        known = self.evaluations(set(placed.values()))
        return {cell: known[n] for cell, n in placed.items()}

    def members(self, archive: str) -> dict[Cell, list[int]]:
        """Return the individuals that each filled cell holds after the last generation.

        A cell holds its elite; in a deep grid it holds several, in their places, the elite among them.
        """
        last = self.last_generation()
        if last is None:
            return {}
        state = self.algorithm_state()
        with self.guard():
            deep = (state or {}).get("members", {}).get(archive)
            if deep is not None:
                return {parse_cell(cell): [int(n) for n in held] for cell, held in deep.items()}
        return {cell: [n] for cell, n in self.placements(archive, last).items()}

    def summaries(self, numbers: set[int]) -> dict[int, Summary]:
        """Return what a map shows of some evaluations, by number; failed ones are left out."""
        with self.guard():
            return {
                r.number: Summary(r.generation, r.fitness, r.morphology)
                for condition, part in in_chunks(numbers)
                for r in self._tables.records(condition, part)
                if r.fitness is not None
            }

    def bodies(self, generation: int) -> dict[Morphology, int]:
        """Return how many evaluations up to a generation had each body; failed ones are left out."""
        with self._mutex, self.guard():
            last = self._tables.last_generation()
            new = []
            if generation > self._bodies_until:
                new = self._tables.records(
                    "generation > ? AND generation <= ?", (self._bodies_until, generation)
                )
            if new and last is not None:
                # those of closed generations stay what they are
                known = self._bodies + [r for r in new if r.generation <= last]
                self._check_number(len(known), min(generation, last))
                self._bodies, self._bodies_until = known, max(self._bodies_until, min(generation, last))
            counted = [*self._bodies, *(r for r in new if r.generation > self._bodies_until)]
            return dict(
                Counter(r.morphology for r in counted if r.generation <= generation and r.fitness is not None)
            )

    def _check_number(self, n: int, generation: int) -> None:
        """Make sure that there are as many evaluations up to a generation as it says."""
        for closed in self._tables.closed(generation - 1)[:1]:
            if self.projection is None and n != closed.n_evaluations:
                raise InvalidData(f"{closed.n_evaluations} evaluations were counted, {n} are there")

    def generation_of(self, number: int) -> int | None:
        """Return the generation that an evaluation belongs to, or None if there is no such one."""
        with self.guard():
            records = self._tables.records("number = ?", (number,))
            return records[0].generation if records else None

    def evaluation(self, number: int) -> Evaluation:
        """Return one evaluation.

        Raises:
            RunFileError: there is none of that number, or it is damaged.
        """
        return self.evaluations({number})[number]

    def evaluations(self, numbers: set[int]) -> dict[int, Evaluation]:
        """Return some evaluations by number.

        Raises:
            RunFileError: one does not exist or is damaged.
        """
        if self.slimmed is not None and (gone := numbers - set(self.numbers())):
            raise RunFileError(
                f"{self.path} is slimmed and does not hold robot {min(gone)}, only its figures; take the run"
                " that it was made from"
            )
        with self.guard():
            found = {e.solution.number: self._checked(e) for _, e in self._tables.evaluations(numbers)}
        if missing := numbers - set(found):
            raise RunFileError(f"{self.path} has no evaluation {min(missing)}")
        return found

    def lineage(self, number: int) -> list[Ancestor]:
        """Return a robot and its ancestors, back to a random one, as far as the file goes or ``MAX_LINE``.

        Raises:
            RunFileError: there is no evaluation of that number, or one of the line is damaged.
        """
        with self.guard():
            records = self._tables.records(
                "number IN (WITH RECURSIVE line(n) AS (SELECT ? UNION SELECT e.parent FROM evaluations AS e"
                # a parent is older; a file that says otherwise must not cause an endless loop
                f" JOIN line ON e.number = line.n WHERE e.parent < e.number LIMIT {MAX_LINE})"
                " SELECT n FROM line)",
                (number,),
            )
            line = [Ancestor.of(r) for r in reversed(records)]
        if not line or line[0].number != number:
            raise RunFileError(f"{self.path} has no evaluation {number}")
        oldest = line[-1]
        if (
            self.format_version > 2
            and len(line) < MAX_LINE
            and oldest.parent is not None
            and oldest.parent < oldest.number
        ):
            raise DamagedRunFile(self.path, f"is damaged: evaluation {oldest.parent} is missing")
        return line

    def lacks_trajectories(self) -> bool:
        """Tell whether any evaluation is without its trajectory, as in a file made smaller."""
        with self.guard():
            return self._tables.lacks_trajectories()

    def computers(self) -> dict[Computer, int]:
        """Return each computer that took part and its number of evaluations; older files have none."""
        with self.guard():
            return {Computer.from_json(json.loads(facts)): n for facts, n in self._tables.computers()}

    def all_evaluations(self) -> list[Evaluation]:
        """Return every saved evaluation in the order of their numbers."""
        return [e for _, e in self.each_evaluation()]

    def each_evaluation(self) -> Iterator[tuple[int, Evaluation]]:
        """Yield the generation of every saved evaluation, and the evaluation, in the order of their numbers.

        Raises:
            RunFileError: one is damaged or missing, or the run is slimmed.
        """
        if self.slimmed is not None:
            raise RunFileError(
                f"{self.path} is slimmed: it holds {self.slimmed.n_kept} of {self.n_evaluations()} robots;"
                " take the run that it was made from"
            )
        numbers = self.numbers()
        with self.guard():
            found = self._tables.evaluations(numbers)
        while True:
            with self.guard():
                generation, e = next(found, (0, None))
                if e is None:
                    return
                self._checked(e)
            yield generation, e

    def numbers(self) -> list[int]:
        """Return the numbers of the evaluations whose robots it holds: all, unless it is slimmed.

        Raises:
            RunFileError: one is missing.
        """
        n = self.n_evaluations() if self.slimmed is None else self.slimmed.n_kept
        table = "evaluations" if self.slimmed is None else "details"
        found = [r[0] for r in self._db.query(f"SELECT number FROM {table} ORDER BY number")]
        with self.guard():
            if len(found) < n:
                raise InvalidData(f"{n - len(found)} of {n} evaluations are missing")
        return found

    def first_robots(self, first: Generation) -> list[int]:
        """Return the numbers of some robots of the first generation, by which runs are told apart."""
        return sorted(self.summaries(set(range(first.n_evaluations))))[:_FIRST_ROBOTS]

    def records(self) -> list[Record]:
        """Return every evaluation without its controller, distances and trajectory, in order."""
        n = self.n_evaluations()
        with self.guard():
            found = self._tables.records("1", ())
            if len(found) < n:
                raise InvalidData(f"{n - len(found)} of {n} evaluations are missing")
        return found

    def origins(self, numbers: set[int]) -> dict[int, Origin]:
        """Return what computed each evaluation, as far as that is known, by number."""
        with self.guard():
            return self._tables.origins(numbers)

    def recorded(self) -> list[tuple[Closed, list[Change]]]:
        """Return every closed generation as it is recorded, and its changes of maps."""
        with self.guard():
            changes: dict[int, list[Change]] = defaultdict(list)
            closed = self._tables.closed(-1)
            for change in self._tables.changes(-1):
                changes[change[0]].append(change)
            return [(c, changes[c.generation]) for c in closed]

    def algorithm_state(self) -> dict[str, Any] | None:
        """Return what resuming needs as of the last closed generation, or None before the first."""
        state = self.recorded_state()
        with self.guard():
            return None if state is None else json.loads(state[1])

    def recorded_state(self) -> tuple[int, str] | None:
        """Return the generation of the state to resume from and the state, JSON, or None if there is none."""
        with self.guard():
            return self._tables.state()

    def differing(self) -> list[tuple[str, list[Any]]]:
        """Return each table with rows that are not what was written, and the keys of these."""
        with self.guard():
            return list(self._tables.differing())

    def canonical_hash(self) -> str:
        """Return the SHA-256 of everything that equal runs share: no dates, times or versions.

        It is that of the values that format 1 held, whatever the format. A slimmed run has that of the run it
        was made from.
        """
        if self.slimmed is not None:
            return self.slimmed.hash
        digest = hashlib.sha256(compact_json(to_json(self.config)).encode())
        for generation, e in self.each_evaluation():
            row = [v.hex() if isinstance(v, bytes) else v for v in to_row(generation, e)]
            digest.update(compact_json(row).encode())
        recorded, state = self.recorded(), self.recorded_state()
        for c, _ in recorded:
            digest.update(compact_json([c.generation, c.n_evaluations, c.n_failed, c.archives]).encode())
        for archive, cell, g, n in sorted((a, c, g, n) for _, cs in recorded for g, a, c, n in cs):
            digest.update(compact_json([archive, cell, g, n]).encode())
        if state is not None:
            digest.update(compact_json(list(state)).encode())
        return digest.hexdigest()

    def guard(self) -> Damage:
        """Return a context that reports unexpected data as damage to this file."""
        return self._db.guard()

    def _checked(self, e: Evaluation) -> Evaluation:
        check_fits(self.config, e)
        return e


def check_fits(config: RunConfig, e: Evaluation) -> None:
    """Make sure that an evaluation fits a configuration.

    Raises:
        InvalidData: its arrays have the shape of another task or trial.
    """
    task, trials = get_task(config.task), config.trials
    if (
        e.distances.shape != (task.n_targets, trials.repeats)
        # trajectories may have been removed to make a file smaller
        or e.trajectory.shape[1] not in (0, math.floor(trials.trial_time + 1e-9))
        or e.solution.controller.n_inputs != task.n_inputs
        or e.solution.morphology.stiffness_mode != config.stiffness
        or bool(e.solution.morphology.rhythms) != (config.head_search == "rhythms")
        or e.solution.morphology.feet not in config.body.feet_genes
    ):
        raise InvalidData(f"evaluation {e.solution.number} does not fit the run's configuration")


def _strings(data: Any) -> dict[str, str]:
    if not isinstance(data, dict):
        raise InvalidData("expected a table of names and texts")
    if len(data) > MAX_FACTS:
        raise InvalidData(f"a table of names and texts has at most {MAX_FACTS} rows, not {len(data)}")
    return {short(str(k), "a name"): short(str(v), f"{k}", MAX_FACT) for k, v in data.items()}


def changed_versions(path: Path) -> list[str]:
    """Return what differs between the versions that started a run and those that would resume it.

    Raises:
        RunFileError: the file is no run file or is damaged.
    """
    with RunReader(path) as reader:
        # the first files did not say how their bodies were modelled
        before = {"physics": "unknown"} | reader.versions
        now_installed = versions(reader.config.task, reader.config.physics.simulator)
    return [
        f"{name} {before[name]} -> {now}"
        for name, now in now_installed.items()
        if name in before and before[name] != now and name != "python"
    ]
