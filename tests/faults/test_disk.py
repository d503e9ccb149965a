"""A disk that fills up while a run is written: one line, nothing lost, and on it goes when there is room."""

import contextlib
import re
import subprocess

import pytest

from engine.errors import ExportError
from engine.export import write_folder
from engine.storage.reader import RunReader
from tests.support.faulty import line_of, python, tensatlas
from tests.support.run_hash import hash_of

EVOLVE = """
from engine.errors import TensAtlasError
import resource
if len(sys.argv) > 2:
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
try:
    engine.runs.evolve.resume(path) if path.exists() else engine.runs.evolve.evolve(path, SMALL)
except TensAtlasError as e:
    print(e)
"""


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 400 kB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=400k", "tmpfs", disk], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("only root can make a small disk")
    yield disk
    subprocess.run(["umount", disk], check=True)


def test_a_disk_fills_up(small_disk, made_up):
    path = small_disk / "run.tsmr"
    said = python(EVOLVE, path).stdout
    assert said.startswith(f"{path} cannot be written: ")
    assert "full" in said
    assert f"make room there, then continue with 'tensatlas resume {path}'" in said
    assert said.count("\n") == 1
    with RunReader(path) as reader:
        n = reader.n_evaluations()
        assert 5 < n < 44
        assert len(reader.all_evaluations()) == n
    # still full
    assert "make room there" in python(EVOLVE, path).stdout
    subprocess.run(["mount", "-o", "remount,size=8m", small_disk], check=True)
    assert python(EVOLVE, path).stdout == ""
    assert hash_of(path) == hash_of(made_up)


@pytest.mark.parametrize("n_free", [8192, 0])
def test_a_disk_is_full_from_the_start(small_disk, n_free):
    (small_disk / "full").write_bytes(bytes(400 * 1024 - n_free))
    path = small_disk / "run.tsmr"
    said = python(EVOLVE, path).stdout
    assert said.startswith(f"{path} cannot be written: ")
    assert "make room there" in said
    assert sorted(p.name for p in small_disk.iterdir()) == ["full"]


def test_what_was_there_before_survives_a_full_disk_and_nothing_half_written_is_left(small_disk, made_up):
    table, report = small_disk / "table.csv", small_disk / "report" / "report.html"
    report.parent.mkdir()
    for path in (table, report):
        path.write_text("from before")
    with (small_disk / "full").open("wb", buffering=0) as f, contextlib.suppress(OSError):
        while True:
            f.write(bytes(4096))
    before = sorted(small_disk.rglob("*"))
    for command in (
        ("table", made_up, "--out", table),
        ("compare", made_up, "--out", report.parent, "--images", "none"),
        ("slim", made_up, "--out", small_disk / "slim.tsmr"),
    ):
        done = tensatlas(*command)
        assert done.returncode == 2
        assert re.search("cannot be written: .*(No space left|full)", line_of(done))
    with pytest.raises(ExportError, match="cannot be written: No space left on device"):
        write_folder({"a/robot.xml": bytes(9000), "b": b"x"}, small_disk / "robot")
    assert (table.read_text(), report.read_text()) == ("from before", "from before")
    assert sorted(small_disk.rglob("*")) == before


def test_a_file_reaches_its_largest_size(tmp_path, made_up):
    path = tmp_path / "run.tsmr"
    said = python(EVOLVE, path, 120_000).stdout
    assert said.startswith(f"{path} cannot be written: ")
    assert "make room there" in said
    with RunReader(path) as reader:
        assert 0 < reader.n_evaluations() < 44
    assert python(EVOLVE, path).stdout == ""
    assert hash_of(path) == hash_of(made_up)
