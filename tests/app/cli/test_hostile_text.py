"""What a stranger's run file says never rules the terminal, nor fills it."""

from __future__ import annotations

import contextlib
import json
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.support.command_line import Command
from tests.support.run_formats import in_format

ESCAPES = "\x1b[2J\x1b]0;owned\x07\x9b31m\r\n"
MOST = 20_000
"""Characters that a command may print about such a small file."""


@pytest.fixture(scope="module")
def old_run(small_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small run in the format that has no digests."""
    return Path(in_format(small_run, tmp_path_factory.mktemp("old") / "old.tsmr", 1))


@pytest.fixture
def hostile(old_run: Path, tmp_path: Path) -> Callable[[str], Path]:
    """Change a copy of it."""

    def make(statement: str) -> Path:
        path = Path(shutil.copy(old_run, tmp_path / "hostile.tsmr"))
        with contextlib.closing(sqlite3.connect(path)) as db, db:
            for text in (ESCAPES, ESCAPES + "A" * 200_000):
                db.create_function("hostile" if text == ESCAPES else "huge", 0, lambda text=text: text)
            db.execute(statement)
        return path

    return make


@pytest.mark.parametrize("text", ["hostile()", "huge()"])
@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE meta SET value = json_object('tensatlas', {0}, {0}, '1') WHERE key = 'versions'",
        "UPDATE meta SET value = json_quote({0}) WHERE key = 'created_at'",
        "INSERT INTO meta VALUES ('projection', json_object('kind', {0}, 'source', {0}))",
        "UPDATE meta SET value = json_set(value, '$.task', {0}) WHERE key = 'config'",
        "UPDATE meta SET value = json_set(value, '$.algorithm', {0}) WHERE key = 'config'",
        "UPDATE meta SET value = json_set(value, '$.' || json_quote({0}), 1) WHERE key = 'config'",
        "UPDATE evaluations SET operator = {0}",
        "UPDATE evaluations SET source = {0}",
        "UPDATE evaluations SET failure = {0}, fitness = NULL",
        "UPDATE generations SET archives = json_set(archives, '$.' || json_quote({0}),"
        " json_extract(archives, '$.morphology'))",
        "UPDATE generations SET archives = json_set(archives, '$.morphology.axes[0].name', {0})",
        "UPDATE placements SET archive = {0} WHERE archive = 'morphology'",
        "UPDATE placements SET cell = {0} || cell",
    ],
)
def test_no_command_prints_what_a_terminal_obeys(
    statement: str, text: str, hostile: Callable[[str], Path], tensatlas: Command
) -> None:
    path = hostile(statement.format(text))
    for command in (["info"], ["info", "--json"], ["doctor"]):
        status, out, err = tensatlas(command[0], path, *command[1:])
        assert status in (0, 1, 2)
        for said in (out, err):
            assert all(c.isprintable() or c == "\n" for c in said)
            assert len(said) < MOST
        if command == ["info", "--json"] and status == 0:
            json.loads(out)


def test_nor_do_the_files_beside_a_run(small_run: Path, tmp_path: Path, tensatlas: Command) -> None:
    path = tmp_path / "beside.tsmr"
    path.write_bytes(small_run.read_bytes())
    lock = dict.fromkeys(("host", "boot", "since", "command", "key"), ESCAPES + "A" * 100000)
    path.with_name("beside.tsmr.lock").write_text(json.dumps({"pid": 1, **lock}))
    path.with_name("beside.robust.json").write_text(json.dumps({"format": ESCAPES, "elites": {ESCAPES: 1}}))
    for command in (["info"], ["doctor"], ["compare"]):
        _, out, err = tensatlas(command[0], path, *command[1:])
        for said in (out, err):
            assert all(c.isprintable() or c == "\n" for c in said)
            assert len(said) < MOST
