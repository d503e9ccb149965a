"""A projection written as a new run file, which every command opens like any other."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from engine.analysis.elite_maps import (
    CONTROLLER,
    GRID,
    MORPHOLOGY,
    CountObserver,
    EliteMap,
    double_elites,
    lift,
)
from engine.errors import RunFileError, printable
from engine.runs.evolve import check_physics
from engine.search.archive import Cell, GridArchive
from engine.search.axes import Axis, body_axes, trajectory_axes
from engine.simulation.evaluation import Evaluation
from engine.storage.reader import RunReader
from engine.storage.rows import Generation, statistics
from engine.storage.writer import RunWriter
from engine.tasks import get_task
from engine.workers.evaluator import create_evaluator

DOWN: Final = "the 4-D archive as its two 2-D maps"
UP: Final = "the two 2-D archives as one 4-D map"


@dataclasses.dataclass(frozen=True, slots=True)
class ProjectionReport:
    """The result of projecting a run.

    Attributes:
        kind: ``DOWN`` or ``UP``.
        filled: filled cells by archive of the new run.
        n_elites: of the source, by archive.
        n_resimulated: how many elites lacked a trajectory and were simulated again.
        n_differing: how many of those did not repeat their recorded fitness to the last bit.
        n_clipped: how many elites lie outside the final bounds of the components.
    """

    kind: str
    filled: Mapping[str, int]
    n_elites: Mapping[str, int]
    n_resimulated: int = 0
    n_differing: int = 0
    n_clipped: int = 0


@dataclasses.dataclass(frozen=True, slots=True)
class _Projected:
    """A ``Snapshot``: the projected archives at the end of a generation of the source."""

    generation: int
    archives: Mapping[str, GridArchive]
    all_axes: Mapping[str, tuple[Axis, ...]]
    saved: dict[str, Any]

    def axes(self, archive: str) -> tuple[Axis, ...]:
        return self.all_axes[archive]

    def state(self) -> dict[str, Any]:
        return self.saved


def project_run(
    source: Path, out: Path, *, n_threads: int = 1, observer: CountObserver | None = None
) -> ProjectionReport:
    """Write the projection of a run: a 4-D archive's two 2-D maps, or two 2-D archives' 4-D map.

    All evaluations are copied, so that ancestors can still be looked up. Downwards every generation is
    projected; upwards the last one alone, since earlier PCAs are not kept.

    Args:
        source: run file with the archive ``grid``, or with ``morphology`` and ``controller``.
        out: run file to create.
        n_threads: for simulating elites that lack a trajectory; the result does not depend on it.
        observer: told how far that is.

    Raises:
        RunFileError: the run cannot be read or projected, or the new one cannot be written.
    """
    if out.exists():
        raise RunFileError(f"{out} exists; choose another name for the projection")
    with RunReader(source) as reader:
        generations = reader.generations()
        if not generations:
            raise RunFileError(f"{source} has no finished generation to project")
        if GRID in generations[-1].archives:
            return _project_down(reader, generations, out)
        return _project_up(reader, generations, out, n_threads, observer)


def _project_down(reader: RunReader, generations: list[Generation], out: Path) -> ProjectionReport:
    changes = reader.placement_changes(GRID)
    elites = reader.evaluations({n for _, _, n in changes if n is not None})
    distance = get_task(reader.config.task).target_distance
    held: dict[Cell, int] = {}
    filled: dict[str, int] = {}
    position = 0
    saved = _saved_state(reader)
    with _new_run(reader, out, DOWN) as writer:
        for generation, before in _with_starts(generations):
            _copy(reader, writer, generation, before)
            while position < len(changes) and changes[position][0] <= generation.number:
                _, cell, number = changes[position]
                if number is None:
                    held.pop(cell, None)
                else:
                    held[cell] = number
                position += 1
            with reader.guard():
                axes = generation.archives[GRID].axes
                shown = EliteMap(axes, {c: (_fitness(reader, elites[n]), n) for c, n in held.items()})
                archives, all_axes = {}, {}
                for name, keep in ((MORPHOLOGY, body_axes(axes)), (CONTROLLER, trajectory_axes(axes))):
                    part = shown.project(keep)
                    all_axes[name] = part.axes
                    archives[name] = _archive(part, elites)
            view = _Projected(generation.number + 1, archives, all_axes, saved)
            writer.close_generation(view, statistics(view, distance), generation.seconds)
            filled = {name: len(archive) for name, archive in archives.items()}
    return ProjectionReport(DOWN, filled, {GRID: len(held)})


def _project_up(
    reader: RunReader,
    generations: list[Generation],
    out: Path,
    n_threads: int,
    observer: CountObserver | None,
) -> ProjectionReport:
    last = generations[-1]
    elites = double_elites(reader, last)
    again = resimulate_missing(reader, elites, n_threads=n_threads, observer=observer)
    differing = sum(again[n].fitness != elites[n].fitness for n in again)
    # what was recorded stays as it is; only the trajectory is new
    completed = elites | {
        n: dataclasses.replace(elites[n], trajectory=e.trajectory) for n, e in again.items()
    }
    lifted = lift(reader, last, completed)
    archive = _archive(lifted.map, completed)
    view = _Projected(last.number + 1, {GRID: archive}, {GRID: lifted.map.axes}, _saved_state(reader))
    distance = get_task(reader.config.task).target_distance
    with _new_run(reader, out, UP) as writer:
        for generation, before in _with_starts(generations):
            _copy(reader, writer, generation, before, completed)
        writer.close_generation(view, statistics(view, distance), last.seconds)
    return ProjectionReport(
        UP,
        {GRID: len(archive)},
        {n: len(reader.placements(n, last.number)) for n in (MORPHOLOGY, CONTROLLER)},
        n_resimulated=len(again),
        n_differing=differing,
        n_clipped=lifted.n_clipped,
    )


def resimulate_missing(
    reader: RunReader,
    elites: Mapping[int, Evaluation],
    *,
    n_threads: int = 1,
    observer: CountObserver | None = None,
) -> dict[int, Evaluation]:
    """Evaluate the elites that lack a trajectory again, with the run's own physics and seeds.

    Raises:
        RunFileError: such a simulation fails here, so that it has no trajectory.
    """
    missing = [e.solution for _, e in sorted(elites.items()) if not e.trajectory.size]
    found: dict[int, Evaluation] = {}
    if missing:
        check_physics(reader.config)
    for group in create_evaluator(reader.config, n_threads).evaluate(missing):
        for e in group:
            if e.fitness is None:
                raise RunFileError(
                    f"{reader.path} cannot be projected: robot {e.solution.number} has no trajectory, and"
                    f" simulating it again fails here ({e.failure})"
                )
            found[e.solution.number] = e
        if observer:
            observer(len(found), len(missing))
    return found


@contextlib.contextmanager
def _new_run(reader: RunReader, out: Path, kind: str) -> Iterator[RunWriter]:
    """Write a new run file, and delete it if anything fails: half a projection is useless."""
    meta = {"kind": kind, "source": printable(reader.path.name), "created_at": reader.created_at}
    # if this fails, whatever lies there is not ours
    writer = RunWriter.create(out, reader.config, reader.versions, meta)
    try:
        with writer:
            yield writer
    except BaseException:
        out.unlink(missing_ok=True)
        raise


def _with_starts(generations: list[Generation]) -> Iterable[tuple[Generation, int]]:
    """Return every generation with the number of evaluations before it."""
    return zip(generations, [0, *(g.n_evaluations for g in generations[:-1])], strict=True)


def _copy(
    reader: RunReader,
    writer: RunWriter,
    generation: Generation,
    before: int,
    completed: Mapping[int, Evaluation] | None = None,
) -> None:
    """Copy a generation's evaluations; their numbers follow those of the generations before."""
    found = reader.evaluations(set(range(before, generation.n_evaluations)))
    found |= {n: e for n, e in (completed or {}).items() if n in found}
    writer.add_evaluations(generation.number, [found[n] for n in sorted(found)])


def _archive(shown: EliteMap, elites: Mapping[int, Evaluation]) -> GridArchive:
    """Return a map as an archive of evaluations."""
    archive = GridArchive(shape=tuple(a.n for a in shown.axes), n_possible=shown.n_cells)
    for cell, (_, n) in shown.elites.items():
        archive.add(cell, elites[n])
    return archive


def _fitness(reader: RunReader, e: Evaluation) -> float:
    if e.fitness is None:
        raise RunFileError(f"{reader.path} is damaged: evaluation {e.solution.number} holds a cell of a map")
    return e.fitness


def _saved_state(reader: RunReader) -> dict[str, Any]:
    """Return the part of the source's state that projecting back needs: the PCA."""
    state = reader.algorithm_state()
    with reader.guard():
        return {"descriptor": None if state is None else state.get("descriptor")}
