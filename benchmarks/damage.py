"""Run files that were damaged at random: what is read of them is what was written, or a line says otherwise.

``python -m benchmarks.damage`` damages 1,000 copies of a small run, each by a bit, a byte or a page. Of each
it reads what commands and the app show, export and go on from. It exits with 1 if a copy gives anything else
than the whole run gave, without a word. Copy N is always damaged in the same way: ``--first N --copies 1``
repeats it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final
from unittest import mock

import numpy as np
import tyro
from rich.console import Console

from app.cli.info import Info
from benchmarks.rows import Row, show
from engine.analysis.elite_table import csv_bytes, elite_table
from engine.config import RunConfig, replaced
from engine.errors import TensAtlasError
from engine.export import robot_hash
from engine.runs import evolve
from engine.simulation.evaluation import Evaluation, Solution
from engine.simulation.trials import rounded
from engine.storage.reader import RunReader
from engine.tasks import fitness

CONFIG: Final = replaced(RunConfig(), evaluations=44, initial=20, batch_size=6, refit_generations=(0, 2))
"""Of the run: five generations."""
OPEN_AT: Final = 30
"""Evaluations after which a copy for going on was interrupted."""
_PAGE: Final = 4096


@dataclasses.dataclass(frozen=True)
class Arguments:
    """Damage copies of a run file and read them."""

    copies: int = 1000
    """Copies in all."""
    first: int = 0
    """Number of the first."""


class _MadeUp:
    """Evaluates without a simulation."""

    def evaluate(self, solutions: Sequence[Solution]) -> Iterator[list[Evaluation]]:
        for s in solutions:
            rng = np.random.default_rng(s.number)
            distances = rng.uniform(0.1, 0.6, size=(4, 2))
            failed = rng.random() < 0.1
            yield [
                Evaluation(
                    solution=s,
                    fitness=None if failed else fitness(distances),
                    distances=distances,
                    trajectory=rounded(np.cumsum(rng.normal(0.0, 0.01, (4, 40, 2)), axis=1), 14),
                    head_is_end=bool(rng.random() < 0.5),
                    failure="made up" if failed else None,
                )
            ]


def _made_up() -> Any:
    return mock.patch.object(evolve, "create_evaluator", return_value=_MadeUp())


def write_runs(folder: Path) -> tuple[Path, Path]:
    """Write a finished run, and the same run as it was when it was interrupted within a generation."""
    finished, interrupted = folder / "finished.tsmr", folder / "interrupted.tsmr"

    def interrupt(progress: Any) -> None:
        if progress.n_evaluations >= OPEN_AT:
            raise KeyboardInterrupt

    with _made_up():
        evolve.evolve(finished, CONFIG)
        with contextlib.suppress(KeyboardInterrupt):
            evolve.evolve(interrupted, CONFIG, observer=interrupt)
    return finished, interrupted


def damaged(content: bytes, number: int) -> tuple[bytes, str]:
    """Return a copy with a damage, and what was damaged."""
    rng = random.Random(number)
    data = bytearray(content)
    at = rng.randrange(len(data))
    page = at - at % _PAGE
    match rng.randrange(5):
        case 0:
            data[at] ^= 1 << rng.randrange(8)
            return bytes(data), f"a bit of byte {at}"
        case 1:
            data[at] = rng.choice([v for v in range(256) if v != data[at]])
            return bytes(data), f"byte {at}"
        case 2:
            data[at : at + 4] = rng.randbytes(len(data[at : at + 4]))
            return bytes(data), f"4 bytes at {at}"
        case 3:
            data[page : page + _PAGE] = rng.choice((bytes(_PAGE), rng.randbytes(_PAGE)))
            return bytes(data), f"page {page // _PAGE + 1}"
        case _:
            other = _PAGE * rng.randrange(len(data) // _PAGE)
            data[page : page + _PAGE] = data[other : other + _PAGE]
            return bytes(data), f"page {page // _PAGE + 1}, now like {other // _PAGE + 1}"


def _info(path: Path) -> Any:
    with contextlib.redirect_stdout(io.StringIO()) as out:
        Info(path=path, json=True).run(Console(file=io.StringIO()))
    return {k: v for k, v in json.loads(out.getvalue()).items() if k != "path"}


def _table(path: Path) -> Any:
    with RunReader(path) as reader:
        return csv_bytes(elite_table(reader))


def _export(path: Path) -> Any:
    with RunReader(path) as reader:
        last = reader.finished_generation("morphology").number
        cell = min(reader.placements("morphology", last))
        e = reader.evaluation(reader.elite_at("morphology", cell))
        return robot_hash(reader.config, e.solution), e.fitness, e.distances.tobytes(), e.trajectory.tobytes()


def _maps(path: Path) -> Any:
    with RunReader(path) as reader:
        generations = reader.generations()
        elites = reader.elites(generations[-1])
        numbers = {n for cells in elites.values() for n, _ in cells.values()}
        return (
            repr(generations),
            repr(elites),
            [repr(reader.lineage(n)) for n in sorted(numbers)],
            [reader.placement_changes(name) for name in sorted(elites)],
            sorted(map(repr, reader.bodies(generations[-1].number).items())),
            reader.members("controller"),
        )


def _resume(path: Path) -> Any:
    with _made_up():
        evolve.resume(path)
    with RunReader(path) as reader:
        return reader.canonical_hash()


READINGS: Final[dict[str, Callable[[Path], Any]]] = {
    "info": _info,
    "table": _table,
    "export": _export,
    "maps": _maps,
    "resume": _resume,
}
"""What is read of a copy; the last of the interrupted run, which it goes on with."""


def try_copies(numbers: Sequence[int], folder: Path) -> tuple[Counter[str], list[str]]:
    """Damage copies and read them.

    Returns:
        How many readings gave what was written and how many were refused, by the reading's name and either;
        and a line for each that gave something else, or failed in another way than with one line.
    """
    counts: Counter[str] = Counter()
    faults = []
    finished, interrupted = (p.read_bytes() for p in write_runs(folder))
    copy = folder / "copy.tsmr"
    expected = {}
    for number in (None, *numbers):
        for name, read in READINGS.items():
            content = interrupted if name == "resume" else finished
            where = "whole"
            if number is not None:
                content, where = damaged(content, number)
            for left in folder.glob("copy.*"):
                left.unlink()
            copy.write_bytes(content)
            try:
                found = read(copy)
            except TensAtlasError as e:
                if number is None or len(str(e).splitlines()) != 1:
                    faults.append(f"{name} of copy {number} ({where}): {e!r}")
                counts[f"{name}: refused"] += 1
            except Exception as e:
                faults.append(f"{name} of copy {number} ({where}) is no line: {e!r}")
            else:
                if expected.setdefault(name, found) != found:
                    faults.append(f"{name} of copy {number} ({where}) gave something else")
                counts[f"{name}: as written"] += 1
    return counts, faults


def main(a: Arguments) -> int:
    """Print what came of the copies; 1 if anything else was read without a word."""
    console = Console()
    started = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="tensatlas-damage-") as folder:
        counts, faults = try_copies(range(a.first, a.first + a.copies), Path(folder))
    for fault in faults[:20]:
        console.print(fault, markup=False)
    rows = [
        Row(
            name,
            f"{counts[f'{name}: as written'] - 1} as written, {counts[f'{name}: refused']} refused",
            "nothing else",
            not any(f.startswith(f"{name} ") for f in faults),
        )
        for name in READINGS
    ]
    show(f"{a.copies} damaged copies, {time.monotonic() - started:.0f} s", rows, console)
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
