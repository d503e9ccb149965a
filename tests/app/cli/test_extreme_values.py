"""Figures that are finite in metres and not in centimetres or in sums, and those that are not at all."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from engine.errors import RunFileError
from engine.files import readable_json
from engine.storage.reader import RunReader
from tests.support.command_line import Command
from tests.support.run_formats import change, in_format

HUGE = np.full(16, 3e38, "<f4").tobytes()
FIGURE = """UPDATE generations SET archives =
 packed(replace(unpacked(archives), '"{0}": ', '"{0}": {1}, "x": '))"""
CHANGES = {
    "fitness": "UPDATE evaluations SET fitness = 1e308",
    "fitness below": "UPDATE evaluations SET fitness = -1e308",
    "distances": "UPDATE evaluations SET distances = replace(distances, '0.', '1e308, 0.')",
    "trajectory": f"UPDATE evaluations SET trajectory = x'{HUGE.hex()}'",
    "QD score": FIGURE.format("qd_score", "1e999"),
    "mean": FIGURE.format("mean", "NaN"),
    "time": "UPDATE generations SET seconds = 9e999",
    "number": "UPDATE generations SET n_evaluations = 9e18",
    "budget": "UPDATE meta SET value = json_set(value, '$.evaluations', 90000000000) WHERE key = 'config'",
}
COMMANDS = [
    ("info", "FILE"),
    ("info", "FILE", "--json"),
    ("compare", "FILE", "--out", "report", "--images", "none"),
    ("export", "FILE", "--cell", "CELL", "--out", "robot"),
    ("project", "FILE", "--out", "grid.tsmr"),
    ("doctor", "FILE"),
]


@pytest.fixture(params=[(1, what) for what in CHANGES] + [(3, what) for what in ("fitness", "mean", "time")])
def extreme(request: pytest.FixtureRequest, copy: Path, tmp_path: Path) -> Path:
    """A run of a format with a figure that no run has, its digests as if it had been written so."""
    version, what = request.param
    path = copy if version == 3 else in_format(copy, tmp_path / "extreme.tsmr", version)
    before = path.read_bytes()
    change(path, CHANGES[what])
    assert path.read_bytes() != before
    return path


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_it_is_refused_in_a_line(
    tensatlas: Command, small_run: Path, extreme: Path, command: tuple[str, ...]
) -> None:
    with RunReader(small_run) as reader:
        cell = ",".join(map(str, min(reader.placements("morphology", 2))))
    words = [w.replace("FILE", str(extreme)).replace("CELL", cell) for w in command]
    status, out, err = tensatlas(*words)
    assert "Traceback" not in err
    if status == 0:  # it does not show that figure
        assert "inf" not in out.replace("info", "").lower()
        assert "nan" not in out.lower()
    else:
        assert status == (1 if command[0] == "doctor" else 2)
        assert (err or out).count(str(extreme))


def test_what_a_map_shows_is_refused(small_run: Path, tmp_path: Path) -> None:
    path = Path(shutil.copy(small_run, tmp_path / "run.tsmr"))
    change(path, "UPDATE evaluations SET fitness = 1e12")
    with RunReader(path) as reader, pytest.raises(RunFileError, match="a fitness is beyond"):
        reader.summaries({0})


def test_json_has_no_other_numbers() -> None:
    text = readable_json({"a": [float("inf"), (1.5, float("nan"))], "b": -float("inf")})
    assert json.loads(text, parse_constant=pytest.fail) == {"a": [None, [1.5, None]], "b": None}
