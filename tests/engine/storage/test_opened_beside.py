"""Nothing that looks at a run may drop the locks that this process holds on its file."""

import shutil
import subprocess
import sys

import pytest

from engine.errors import RunFileError
from engine.runs import evolve
from engine.storage.check import check_run
from engine.storage.migration import migrate
from engine.storage.reader import RunReader, changed_versions
from engine.storage.recovery import recover
from engine.storage.salvage import salvage
from engine.storage.writer import RunWriter
from tests.support.opened import files_opened

OPEN = (
    "import sqlite3, sys; db = sqlite3.connect(sys.argv[1], isolation_level=None);"
    " add = 'insert into placements values (99, ?, 0, 1)'; "
)
FIRST = OPEN + (
    "db.execute('pragma journal_mode=wal'); db.execute(add, ('first',));"
    " print(flush=True); sys.stdin.readline(); db.close()"
)
SECOND = OPEN + ("[db.execute(add, ('second %d' % i,)) for i in range(300)]; db.close()")


def look(path):
    RunReader(path).close()


def read_pages(path):
    salvage(path)


def doctor(path):
    list(check_run(path))


@pytest.mark.parametrize("look", [look, changed_versions, read_pages, doctor])
def test_a_reader_survives_the_end_of_a_writer(small_run, tmp_path, look):
    path = shutil.copy(small_run, tmp_path / "run.tsmr")
    command = [sys.executable, "-c", FIRST, path]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as first:
        first.stdout.readline()
        with RunReader(path) as reader:
            assert reader.n_evaluations() == 18
            look(path)
            first.communicate(b"\n")
            subprocess.run([sys.executable, "-c", SECOND, path], check=True)
            # with its locks lost, the reader would see a damaged file, or the one of before
            ((n,),) = reader._db.query("SELECT COUNT(*) FROM placements WHERE archive LIKE 'second %'")
            assert n == 300


def cut(path):
    """Make SQLite refuse the file."""
    with open(path, "r+b") as f:
        f.truncate(30_000)


def overwrite(path):
    """Make the header unknown to SQLite."""
    with open(path, "r+b") as f:
        f.write(bytes(20))


@pytest.mark.parametrize("damage", [None, cut, overwrite])
def test_a_run_file_is_opened_by_sqlite_alone(small_run, tmp_path, damage):
    path = shutil.copy(small_run, tmp_path / "run.tsmr")
    if damage is not None:
        damage(path)
    ways = [
        lambda: RunReader(path).close(),
        lambda: changed_versions(path),
        lambda: list(check_run(path)),
        lambda: recover(path, tmp_path / "recovered.tsmr"),
        lambda: migrate(path, tmp_path / "migrated.tsmr"),
        lambda: evolve.resume(path),
        lambda: RunWriter.open(path).close(),
    ]
    with files_opened() as opened:
        for way in ways:
            try:
                way()
            except RunFileError:
                continue
    assert [p for p in opened if p.name.endswith(".lock")]  # the watch works
    assert [p for p in opened if p.suffix == ".tsmr"] == []
