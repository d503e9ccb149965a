"""Reading a run file, finished or live. Files may come from strangers: everything is checked."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import Any, Self

from engine.body.morphology import Morphology
from engine.config import RunConfig, from_json, to_json
from engine.errors import DamagedRunFile, InvalidData, RunFileError, TensAtlasError
from engine.files import compact_json
from engine.search.archive import Cell, cell_name, parse_cell
from engine.simulation.evaluation import Evaluation
from engine.simulation.provenance import Computer, versions
from engine.storage.database import Damage, RunDatabase
from engine.storage.lock import is_being_written
from engine.storage.rows import Ancestor, Generation, Summary, finite, from_row
from engine.tasks import get_task, task_version


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
        try:
            with self.guard():
                meta = {k: json.loads(v) for k, v in self._db.query("SELECT key, value FROM meta")}
                self.config: RunConfig = from_json(meta.get("config"))
                self.projection = None if "projection" not in meta else _strings(meta["projection"])
                """What a projected run was made of, as ``RunWriter.create`` was told; None for others."""
                self.versions: dict[str, str] = _strings(meta.get("versions", {}))
                self.created_at = str(meta.get("created_at", ""))
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
        number = self._db.query("SELECT MAX(generation) FROM generations")[0][0]
        with self.guard():
            return None if number is None else self._count(number)

    def n_evaluations(self) -> int:
        """Return the number of saved evaluations, those of an open generation included.

        Only the open generation's are counted, because counting all reads all of a long run's pages.
        """
        closed = self._db.query(
            "SELECT generation, n_evaluations FROM generations ORDER BY generation DESC LIMIT 1"
        )
        with self.guard():
            last, n = (self._count(v) for v in closed[0]) if closed else (-1, 0)
        # numbers rise from generation to generation
        (opened,) = self._db.query(
            "SELECT COUNT(*) FROM evaluations WHERE number > COALESCE((SELECT number FROM evaluations"
            " WHERE generation <= ? ORDER BY number DESC LIMIT 1), -1)",
            (last,),
        )[0]
        return n + int(opened)

    def generations(self, after: int = -1) -> list[Generation]:
        """Return the closed generations with a greater number, in order."""
        rows = self._db.query(
            "SELECT generation, n_evaluations, n_failed, archives, seconds FROM generations"
            " WHERE generation > ? ORDER BY generation",
            (after,),
        )
        with self.guard():
            for r in rows:
                self._count(r["generation"]), self._count(r["n_evaluations"]), self._count(r["n_failed"])
            return [Generation.from_row(r) for r in rows]

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
        rows = self._db.query(
            "SELECT cell, evaluation, MAX(generation) FROM placements"
            " WHERE archive = ? AND generation <= ? GROUP BY cell",
            (archive, generation),
        )
        with self.guard():
            return {parse_cell(str(cell)): int(n) for cell, n, _ in rows if n is not None}

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
        rows = self._db.query(
            "SELECT generation, cell, evaluation FROM placements WHERE archive = ? AND generation > ?"
            " ORDER BY generation",
            (archive, after),
        )
        with self.guard():
            return [(int(g), parse_cell(str(c)), None if n is None else int(n)) for g, c, n in rows]

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
        rows = self._db.of_numbers("number, generation, fitness, morphology", numbers)
        with self.guard():
            return {int(r["number"]): Summary.from_row(r) for r in rows if r["fitness"] is not None}

    def bodies(self, generation: int) -> dict[Morphology, int]:
        """Return how many evaluations up to a generation had each body; failed ones are left out."""
        rows = self._db.query(
            "SELECT morphology, COUNT(*) FROM evaluations WHERE generation <= ? AND fitness IS NOT NULL"
            " GROUP BY morphology",
            (generation,),
        )
        with self.guard():
            return {Morphology.from_json(json.loads(r[0])): int(r[1]) for r in rows}

    def generation_of(self, number: int) -> int | None:
        """Return the generation that an evaluation belongs to, or None if there is no such one."""
        rows = self._db.query("SELECT generation FROM evaluations WHERE number = ?", (number,))
        with self.guard():
            return int(rows[0][0]) if rows else None

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
        with self.guard():
            rows = self._db.of_numbers("*", numbers)
            found = {int(r["number"]): self._checked(from_row(r)) for r in rows}
        if missing := numbers - set(found):
            raise RunFileError(f"{self.path} has no evaluation {min(missing)}")
        return found

    def lineage(self, number: int) -> list[Ancestor]:
        """Return a robot and its ancestors, back to a random one or as far as the file goes.

        Raises:
            RunFileError: there is no evaluation of that number, or one of the line is damaged.
        """
        rows = self._db.query(
            "WITH RECURSIVE line(n) AS (SELECT ? UNION SELECT e.parent FROM evaluations AS e JOIN line"
            # a parent is older; a file that says otherwise must not cause an endless loop
            " ON e.number = line.n WHERE e.parent < e.number)"
            " SELECT number, parent, generation, operator, fitness, morphology FROM evaluations"
            " WHERE number IN (SELECT n FROM line) ORDER BY number DESC",
            (number,),
        )
        with self.guard():
            line = [
                Ancestor(
                    number=int(r[0]),
                    parent=None if r[1] is None else int(r[1]),
                    generation=int(r[2]),
                    operator=str(r[3]),
                    fitness=None if r[4] is None else finite(r[4]),
                    morphology=Morphology.from_json(json.loads(r[5])),
                )
                for r in rows
            ]
        if not line or line[0].number != number:
            raise RunFileError(f"{self.path} has no evaluation {number}")
        return line

    def lacks_trajectories(self) -> bool:
        """Tell whether any evaluation is without its trajectory, as in a file made smaller."""
        return bool(self._db.query("SELECT 1 FROM evaluations WHERE length(trajectory) = 0 LIMIT 1"))

    def computers(self) -> dict[Computer, int]:
        """Return each computer that took part and its number of evaluations; older files have none."""
        if not self._db.query("SELECT 1 FROM sqlite_master WHERE name = 'computed'"):
            return {}
        rows = self._db.query(
            "SELECT facts, COUNT(*) FROM computed JOIN computers ON id = computer"
            " GROUP BY facts ORDER BY 2 DESC, 1"
        )
        with self.guard():
            return {Computer.from_json(json.loads(facts)): int(n) for facts, n in rows}

    def all_evaluations(self) -> list[Evaluation]:
        """Return every saved evaluation in the order of their numbers."""
        with self.guard():
            rows = self._db.query("SELECT * FROM evaluations ORDER BY number")
            return [self._checked(from_row(r)) for r in rows]

    def algorithm_state(self) -> dict[str, Any] | None:
        """Return what resuming needs as of the last closed generation, or None before the first."""
        rows = self._db.query("SELECT algorithm FROM state")
        with self.guard():
            return json.loads(rows[0][0]) if rows else None

    def canonical_hash(self) -> str:
        """Return the SHA-256 of everything that equal runs share: no dates, times or versions."""
        digest = hashlib.sha256()
        with self.guard():
            digest.update(compact_json(to_json(self.config)).encode())
            for row in self._db.query("SELECT * FROM evaluations ORDER BY number"):
                values = [v.hex() if isinstance(v, bytes) else v for v in tuple(row)]
                digest.update(compact_json(values).encode())
            for query in (
                "SELECT generation, n_evaluations, n_failed, archives FROM generations ORDER BY 1",
                "SELECT archive, cell, generation, evaluation FROM placements ORDER BY 1, 2, 3",
                "SELECT generation, algorithm FROM state",
            ):
                for row in self._db.query(query):
                    digest.update(compact_json(list(row)).encode())
        return digest.hexdigest()

    def guard(self) -> Damage:
        """Return a context that reports unexpected data as damage to this file."""
        return self._db.guard()

    def _count(self, value: Any) -> int:
        """Return a number of evaluations, or of generations; whatever counts to it must come to an end."""
        if not 0 <= int(value) <= 2 * self.config.evaluations:
            raise InvalidData(f"{value!r} evaluations or generations of {self.config.evaluations} planned")
        return int(value)

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
    ):
        raise InvalidData(f"evaluation {e.solution.number} does not fit the run's configuration")


def _strings(data: Any) -> dict[str, str]:
    if not isinstance(data, dict):
        raise InvalidData("expected a table of names and texts")
    return {str(k): str(v) for k, v in data.items()}


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
