"""Runs on read-only media: a disk that was taken away, a folder that somebody else owns."""

import shutil
import subprocess

import pytest

from engine.errors import RunFileError
from engine.runs import evolve
from engine.storage.check import check_run
from engine.storage.migration import migrate
from engine.storage.reader import RunReader
from tests.support.faulty import line_of, tensatlas
from tests.support.killed import run_until_killed
from tests.support.made_up import MADE_UP
from tests.support.run_hash import hash_of


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """The folder of a run that was killed, its log beside it."""
    folder = tmp_path_factory.mktemp("killed")
    run_until_killed(folder / "run.tsmr", MADE_UP, 40, made_up=True)
    assert (folder / "run.tsmr-wal").stat().st_size
    return folder


@pytest.fixture
def medium(tmp_path):
    """Return a function that makes a folder read-only, as a disk of its own."""
    disk = tmp_path / "disk"
    mounted = []

    def make(folder, *, left_out=()):
        shutil.copytree(folder, disk)
        for name in left_out:
            (disk / name).unlink()
        bound = ["mount", "--bind", disk, disk], ["mount", "-o", "remount,ro,bind", disk]
        for command in bound:
            if subprocess.run(command, capture_output=True, check=False).returncode:
                pytest.skip("only root can make a read-only disk")
            mounted.append(True)
        return disk

    yield make
    if mounted:
        subprocess.run(["umount", disk], check=True)


@pytest.mark.parametrize("left_out", [(), ["run.tsmr-shm"], ["run.tsmr-shm", "run.tsmr.lock"]])
def test_a_killed_run_is_read_whole(killed, medium, tmp_path, left_out):
    disk = medium(killed, left_out=left_out)
    path, names = disk / "run.tsmr", sorted(p.name for p in disk.iterdir())
    with RunReader(path) as reader:
        assert reader.n_evaluations() >= 40
        assert len(reader.all_evaluations()) == reader.n_evaluations()
        assert not reader.is_live
    findings = list(check_run(path))
    assert [f.text for f in findings if f.verdict == "problem"] == []
    # resuming must write
    remedies = " ".join(f.remedy for f in findings)
    assert "copy run.tsmr and run.tsmr-wal to a folder that can be written to" in remedies
    assert f"tensatlas resume {path}" not in remedies
    with pytest.raises(
        RunFileError, match=r"Read-only .*; copy it and run\.tsmr-wal to a folder that can be"
    ):
        evolve.resume(path)
    with pytest.raises(RunFileError, match="has the present format"):
        migrate(path, tmp_path / "new.tsmr")
    assert sorted(p.name for p in disk.iterdir()) == names
    # the advice works
    for name in ("run.tsmr", "run.tsmr-wal"):
        shutil.copy(disk / name, tmp_path / name)
    assert hash_of(tmp_path / "run.tsmr") == hash_of(path)


def test_a_finished_run_is_no_problem(small_run, medium):
    path = medium(small_run.parent) / small_run.name
    assert hash_of(path) == hash_of(small_run)
    done = tensatlas("doctor", path)
    assert "problem" not in done.stdout.replace("No problem", "")
    assert "note     nothing can be written in" in done.stdout
    assert done.returncode == 0
    assert "copy it to a folder that can be written to" in line_of(tensatlas("resume", path))


def test_there_is_no_room_for_a_copy(killed, medium, tmp_path, monkeypatch):
    path = medium(killed, left_out=["run.tsmr-shm"]) / "run.tsmr"
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "nowhere"))
    with pytest.raises(
        RunFileError, match=r"nor copied to .*nowhere: No such.*; copy it and run\.tsmr-wal to"
    ):
        RunReader(path)
