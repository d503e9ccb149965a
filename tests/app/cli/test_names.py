"""Run files whose names are any bytes, in any locale."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from engine.storage.reader import RunReader
from tests.support.command_line import TINY, Command
from tests.support.faulty import ENVIRONMENT

NAME = b"\xff\n\x1b[31m " + "ü's.tsmr".encode()
COMMANDS = [
    ("info", "FILE"),
    ("info", "FILE", "--json"),
    ("doctor", "FILE"),
    ("resume", "FILE", "--workers", "1"),
    ("compare", "FILE", ".", "--out", "FILE.report", "--images", "none"),
    ("table", "FILE", "--out", "FILE.csv"),
    ("project", "FILE", "--out", "FILE.grid.tsmr"),
    ("recover", "FILE", "--out", "FILE.again.tsmr"),
    ("export", "FILE", "--cell", "CELL", "--out", "FILE.export"),
    ("record", "FILE", "--cell", "CELL", "--out", "FILE.png"),
    ("reevaluate", "FILE", "--repeats", "1"),
]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: " ".join(c[:3:2]))
def test_any_name_will_do(
    tensatlas: Command, small_run: Path, tmp_path: Path, command: tuple[str, ...]
) -> None:
    path = tmp_path / os.fsdecode(NAME)
    shutil.copy(small_run, path)
    with RunReader(path) as reader:
        cell = ",".join(map(str, min(reader.placements("morphology", 2))))
    words = [w.replace("FILE", str(path)).replace("CELL", cell) for w in command]
    status, out, err = tensatlas(*words)
    assert (status, "Traceback" in err) == (0, False), err
    assert all(c.isprintable() or c == "\n" for c in out + err)


def test_what_is_to_be_typed_can_be_typed(tensatlas: Command, tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(NAME)
    status, _, err = tensatlas("evolve", path, "--workers", "1", *TINY)
    assert status == 0
    typed = err.rpartition("tensatlas explore ")[2].strip()
    said = subprocess.run(
        ["bash", "-c", f"printf %s {typed}"], env={"LC_ALL": "C"}, capture_output=True, check=True
    )
    assert said.stdout == os.fsencode(path)
    with RunReader(path) as reader:
        assert reader.n_evaluations() == 6


def test_a_locale_without_most_characters(small_run: Path, tmp_path: Path) -> None:
    path = shutil.copy(small_run, tmp_path / os.fsdecode(NAME))
    code = (
        "import sys; from app.cli.main import main\n"
        "for line in (['info'], ['doctor'], ['compare', '--out', 'report', '--images', 'none']):\n"
        "    try: main([line[0], sys.argv[1], *line[1:]])\n"
        "    except SystemExit as e: assert not e.code, e.code\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, path],
        cwd=tmp_path,
        env=ENVIRONMENT | {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr.decode(errors="replace")
    assert done.stdout.isascii()
    assert done.stdout.count(b"18 of 18") == 2
