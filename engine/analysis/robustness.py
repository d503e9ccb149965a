"""How much of a map's fitness was luck: its elites evaluated again, many times, under fresh noise.

An elite is in its cell because it did better than its rivals under the noise that it happened to have.
Its mean under noise that the run never used is what it can be expected to do again; the sum of those
means over a map is the corrected QD score (as in Flageat and Cully, "Uncertain Quality-Diversity",
IEEE Transactions on Evolutionary Computation 2023). Elites stay in their cells.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from engine.analysis.elite_maps import EliteMap
from engine.errors import UNEXPECTED_DATA, InvalidData, RunFileError
from engine.files import open_file, write_files
from engine.storage.layouts.tables import score
from engine.storage.reader import RunReader

FORMAT: Final = 1
MAX_BYTES: Final = 100_000_000
"""Size of the largest file of results that is read."""
MAX_REPEATS: Final = 100
SUFFIX: Final = ".robust.json"
AS_BUILT_SUFFIX: Final = ".as_built.json"
"""Of the same for robots as they would be built."""


@dataclasses.dataclass(frozen=True, slots=True)
class Robustness:
    """The results, so far, of evaluating elites again.

    Attributes:
        created_at: when the run was made, which with the recorded fitnesses identifies it.
        versions: that simulated.
        recorded: fitness in m of each elite as the run has it, by number.
        samples: fitness in m by number of the elite and number of the repeat, from 1; None if it failed.
    """

    created_at: str
    versions: Mapping[str, str]
    recorded: Mapping[int, float]
    samples: Mapping[int, Mapping[int, float | None]]

    def fresh(self, number: int) -> np.ndarray:
        """Return the fitnesses in m of an elite's repeats that did not fail, in order."""
        found = self.samples.get(number, {})
        return np.array([f for _, f in sorted(found.items()) if f is not None])

    def mean(self, number: int) -> float | None:
        """Return the mean fitness in m of an elite under fresh noise; None if there is none."""
        return mean_of(self.fresh(number))

    def deviation(self, number: int) -> float | None:
        """Return the standard deviation of an elite's fitness in m; None for fewer than two values."""
        return deviation_of(self.fresh(number))

    def f_s(self, initial_distance: float) -> dict[int, float]:
        """Return the mean f_s in m under fresh noise of every elite that has one, by number.

        Args:
            initial_distance: d_init of f_s, in m.
        """
        return {n: initial_distance - m for n in self.recorded if (m := self.mean(n)) is not None}

    def luck(self, number: int) -> float | None:
        """Return how much better in m an elite's recorded fitness is than its mean under fresh noise."""
        mean = self.mean(number)
        return None if mean is None else mean - self.recorded[number]


@dataclasses.dataclass(frozen=True, slots=True)
class MapRobustness:
    """A map's recorded figures and those of its elites under fresh noise; lengths in m, of f_s.

    Attributes:
        archive: its name.
        n_elites: in the map.
        n_known: of them evaluated again with at least one repeat that did not fail. The other figures
            but the counts are of these alone.
        n_failed: repeats of the map's elites that failed.
        best: largest recorded f_s, and that elite's mean f_s under fresh noise.
        best_again: largest mean f_s of an elite under fresh noise.
        mean, mean_again: of the elites' f_s.
        luck, luck_deviation: mean and standard deviation over elites of recorded less fresh f_s.
        deviation: mean over elites of the standard deviation of an elite's fresh fitness; None for one
            repeat.
        qd_score, corrected_qd_score: sum over filled cells of the recorded f_s, of the fresh mean.
    """

    archive: str
    n_elites: int
    n_known: int
    n_failed: int
    best: tuple[float, float] | None
    best_again: float | None
    mean: float | None
    mean_again: float | None
    luck: float | None
    luck_deviation: float | None
    deviation: float | None
    qd_score: float
    corrected_qd_score: float


def mean_of(values: np.ndarray) -> float | None:
    """Return the mean of values; None for none."""
    return float(values.mean()) if len(values) else None


def deviation_of(values: np.ndarray) -> float | None:
    """Return the standard deviation of values as a sample's (n - 1); None for fewer than two."""
    return float(values.std(ddof=1)) if len(values) > 1 else None


def robust_path(run: Path, *, as_built: bool = False) -> Path:
    """Return the path of the file beside a run file that holds the results of its elites, or as built."""
    return run.with_name(run.stem + (AS_BUILT_SUFFIX if as_built else SUFFIX))


def robust_stamp(run: Path) -> tuple[int, int] | None:
    """Return time in ns and size of the results' files, which show when one changes; None without any."""
    found = []
    for as_built in (False, True):
        with contextlib.suppress(OSError):
            found.append(robust_path(run, as_built=as_built).stat())
    if not found:
        return None
    return max(f.st_mtime_ns for f in found), sum(f.st_size for f in found)


def load_robust(path: Path) -> Robustness:
    """Read the results of evaluating a run's elites again.

    Raises:
        InvalidData: the file is missing, damaged, of something else or of a newer version.
    """
    try:
        with open_file(path) as f:
            content = f.read(MAX_BYTES + 1)
        if len(content) > MAX_BYTES:
            raise InvalidData(f"{path} is too large for results of reevaluate")
        data = json.loads(content)
    except FileNotFoundError:
        raise InvalidData(f"{path} does not exist; make it with 'tensatlas reevaluate'") from None
    except OSError as e:
        raise InvalidData(f"{path} cannot be read: {e.strerror}") from None
    except (ValueError, RecursionError):
        raise InvalidData(f"{path} is damaged: it is not JSON") from None
    try:
        if data["format"] > FORMAT:
            raise InvalidData("it was written by a newer TensAtlas; update TensAtlas")
        recorded = {_count(n): _fitness(e["recorded"]) for n, e in data["elites"].items()}
        samples = {
            _count(n): {
                _count(k): None if f is None else _fitness(f) for k, f in sorted(e["repeats"].items())
            }
            for n, e in data["elites"].items()
        }
        for found in samples.values():
            if found and not 1 <= min(found) <= max(found) <= MAX_REPEATS:
                raise InvalidData(f"repeats are numbered from 1 to {MAX_REPEATS}")
        return Robustness(
            created_at=str(data["created_at"]),
            versions={str(k): str(v) for k, v in data["versions"].items()},
            recorded=dict(sorted(recorded.items())),
            samples=dict(sorted(samples.items())),
        )
    except InvalidData as e:
        raise InvalidData(f"{path}: {e}") from None
    except UNEXPECTED_DATA as e:
        raise InvalidData(f"{path} is damaged: {e!r}") from None


def load_robust_of(reader: RunReader, *, as_built: bool = False) -> Robustness | None:
    """Return the results that lie beside a run file, or None if there are none.

    Args:
        reader: of the run.
        as_built: whether those of its robots as they would be built.

    Raises:
        InvalidData: the file is damaged or of another run.
    """
    path = robust_path(reader.path, as_built=as_built)
    if not path.exists():
        return None
    robust = load_robust(path)
    check_robust(robust, reader, path)
    return robust


def check_robust(robust: Robustness, reader: RunReader, path: Path) -> None:
    """Check that results belong to a run.

    Raises:
        InvalidData: they are of another run, or recorded fitnesses differ.
    """
    if robust.created_at != reader.created_at:
        raise InvalidData(f"{path} is not of {reader.path}; delete it to evaluate this run's elites")
    known = reader.summaries(set(robust.recorded))
    for n, fitness in robust.recorded.items():
        if n not in known or known[n].fitness != fitness:
            raise InvalidData(f"{path} is not of {reader.path}: robot {n} differs; delete it")


def map_robustness(
    archive: str, shown: EliteMap, robust: Robustness, initial_distance: float
) -> MapRobustness:
    """Return how much of a map's fitness was luck.

    Args:
        archive: name of the map.
        shown: the map.
        robust: the results of its elites.
        initial_distance: d_init of f_s, in m.
    """
    known = [(f, n) for f, n in shown.elites.values() if robust.mean(n) is not None]
    recorded = np.array([initial_distance - f for f, _ in known])
    again = np.array([initial_distance - m for _, n in known if (m := robust.mean(n)) is not None])
    luck = recorded - again
    deviations = [d for _, n in known if (d := robust.deviation(n)) is not None]
    best = int(recorded.argmax()) if len(known) else None
    return MapRobustness(
        archive=archive,
        n_elites=len(shown.elites),
        n_known=len(known),
        n_failed=sum(f is None for _, n in shown.elites.values() for f in robust.samples.get(n, {}).values()),
        best=None if best is None else (float(recorded[best]), float(again[best])),
        best_again=float(again.max()) if len(known) else None,
        mean=mean_of(recorded),
        mean_again=mean_of(again),
        luck=mean_of(luck),
        luck_deviation=deviation_of(luck),
        deviation=float(np.mean(deviations)) if deviations else None,
        qd_score=float(recorded.sum()),
        corrected_qd_score=float(again.sum()),
    )


def save_robust(robust: Robustness, path: Path) -> None:
    """Write results in one step, so that no reader sees half of them.

    Raises:
        RunFileError: the file cannot be written.
    """
    data = {
        "format": FORMAT,
        "created_at": robust.created_at,
        "versions": dict(robust.versions),
        "elites": {
            str(n): {
                "recorded": robust.recorded[n],
                "repeats": {str(k): f for k, f in robust.samples[n].items()},
            }
            for n in robust.recorded
        },
    }
    try:
        write_files({path: json.dumps(data, indent=1, allow_nan=False)})
    except OSError as e:
        raise RunFileError(f"{path} cannot be written: {e.strerror}") from None


def _count(text: Any) -> int:
    if not isinstance(text, str) or not text.isdecimal() or len(text) > 10:
        raise InvalidData(f"expected a whole number, not {text!r}")
    return int(text)


def _fitness(value: Any) -> float:
    if type(value) not in (int, float):
        raise InvalidData(f"expected a number, not {value!r}")
    return score(value)
