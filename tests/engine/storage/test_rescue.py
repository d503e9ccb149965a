"""The run file is removed, replaced or overwritten while it is written."""

import os
import shutil
import sqlite3

import pytest

import engine.runs.evolve
from engine.config import create_algorithm, replaced
from engine.errors import RunFileError
from engine.storage.check import check_run
from engine.storage.lock import lock_path
from engine.storage.reader import RunReader
from engine.storage.rows import statistics
from engine.storage.writer import RunWriter
from tests.support.made_up import MADE_UP, MadeUpEvaluator, made_up_evaluation
from tests.support.run_hash import hash_of

CONFIG = replaced(MADE_UP, evaluations=44)


@pytest.fixture(autouse=True)
def _made_up(monkeypatch):
    monkeypatch.setattr(engine.runs.evolve, "create_evaluator", lambda *_: MadeUpEvaluator())


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """A finished run, from beginning to end."""
    path = tmp_path_factory.mktemp("undisturbed") / "run.tsmr"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine.runs.evolve, "create_evaluator", lambda *_: MadeUpEvaluator())
        engine.runs.evolve.evolve(path, CONFIG)
    return path


def remove(path, _):
    path.unlink()


def remove_all(path, _):
    for p in path.parent.iterdir():
        p.unlink()


def remove_folder(path, _):
    shutil.rmtree(path.parent)


def move(path, _):
    path.rename(path.with_name("moved.tsmr"))


def replace(path, other):
    shutil.copy(other, path.with_name("new"))
    path.with_name("new").replace(path)


def evolve_until(path, n, happens, other):
    """Evolve, and let something happen to the file when n evaluations are saved."""
    waiting = [True]

    def observe(progress):
        if progress.n_evaluations >= n and waiting.pop() if waiting else False:
            happens(path, other)

    engine.runs.evolve.evolve(path, CONFIG, observer=observe)


@pytest.mark.parametrize(
    ("happens", "n"),
    [(remove, 20), *[(happens, 30) for happens in (remove_all, remove_folder, move)], (replace, 44)],
)
def test_a_file_that_is_lost_is_noticed_and_its_content_saved(tmp_path, small_run, undisturbed, happens, n):
    path = tmp_path / "runs" / "run.tsmr"
    before = small_run.read_bytes()
    with pytest.raises(RunFileError) as caught:
        evolve_until(path, n, happens, small_run)
    what = "replaced by another file" if happens is replace else "removed"
    saved = path.with_name("run-rescued.tsmr")
    assert str(caught.value) == (
        f"{path} was {what} while this process wrote it; what was finished is saved in {saved}:"
        f" continue with 'tensatlas resume {saved}'"
    )
    # neither a log that SQLite would add to another file, nor a lock
    names = {"run-rescued.tsmr", *{replace: ["run.tsmr"], move: ["moved.tsmr"]}.get(happens, [])}
    assert {p.name for p in path.parent.iterdir()} == names
    if happens is replace:
        assert path.read_bytes() == before
    assert [f.text for f in check_run(saved) if f.verdict == "problem"] == []
    with RunReader(saved) as reader:
        assert reader.n_evaluations() >= n
    engine.runs.evolve.resume(saved)
    assert hash_of(saved) == hash_of(undisturbed)


def written(path, until, *, seed=1):
    """Return a writer of a run of some generations, and its algorithm."""
    config = replaced(CONFIG, seed=seed)
    algorithm, writer = create_algorithm(config), RunWriter.create(path, config, {"tensatlas": "0"})
    for _ in range(until):
        close_one(writer, algorithm)
    return writer, algorithm


def close_one(writer, algorithm):
    evaluations = [made_up_evaluation(s) for s in algorithm.ask()]
    writer.add_evaluations(algorithm.generation, evaluations)
    algorithm.tell(evaluations)
    writer.close_generation(algorithm, statistics(algorithm, 0.45), 1.0)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_file_that_is_overwritten_is_noticed(tmp_path, seed):
    path, older = tmp_path / "run.tsmr", tmp_path / "older.tsmr"
    written(older, 2, seed=seed)[0].close()
    writer, algorithm = written(path, 3)
    writer._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")  # as from time to time
    writer._place.note()
    shutil.copyfile(older, path)
    with pytest.raises(RunFileError, match=r"run\.tsmr was overwritten while"):
        close_one(writer, algorithm)
    writer.close()
    # what was put there is as it was put there
    assert path.read_bytes() == older.read_bytes()
    assert not path.with_name("run.tsmr-wal").exists()


def test_a_time_stamp_alone_is_no_change(tmp_path):
    writer, algorithm = written(tmp_path / "run.tsmr", 2)
    os.utime(tmp_path / "run.tsmr", (1e9, 1e9))
    close_one(writer, algorithm)
    writer.close()
    with RunReader(tmp_path / "run.tsmr") as reader:
        assert reader.last_generation() == 2


def test_a_run_that_took_the_place_is_left_alone(tmp_path):
    """A second process starts a run of the same name: its file, log and lock stay its own."""
    path = tmp_path / "run.tsmr"
    writer, algorithm = written(path, 2)
    remove_all(path, None)
    second, other = written(path, 1, seed=2)
    with pytest.raises(RunFileError, match=r"was replaced by another file.*run-rescued\.tsmr"):
        close_one(writer, algorithm)
    writer.close()
    assert lock_path(path).exists()
    close_one(second, other)
    second.close()
    with RunReader(path) as reader:
        assert (reader.config.seed, reader.last_generation()) == (2, 1)
    with RunReader(tmp_path / "run-rescued.tsmr") as reader:
        assert (reader.config.seed, reader.last_generation()) == (1, 1)
        assert reader.n_evaluations() == 20 + 6 + 6  # those that were to be added too


def test_a_second_rescue_does_not_overwrite_the_first(tmp_path):
    for _ in range(2):
        writer, _ = written(tmp_path / "run.tsmr", 1)
        (tmp_path / "run.tsmr").unlink()
        with pytest.raises(RunFileError, match="was removed"):
            writer.close()
    assert {p.name for p in tmp_path.iterdir()} == {"run-rescued.tsmr", "run-rescued-2.tsmr"}


def test_what_cannot_be_saved_is_said(tmp_path, monkeypatch):
    writer, _ = written(tmp_path / "run.tsmr", 1)
    (tmp_path / "run.tsmr").unlink()

    def full(*_):
        raise sqlite3.OperationalError("database or disk is full")

    monkeypatch.setattr("engine.storage.rescue._settle", full)
    with pytest.raises(
        RunFileError, match=r"removed while .*, and it cannot be saved elsewhere: .*disk is full"
    ):
        writer.close()
