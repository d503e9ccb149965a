"""A Dask cluster on this machine: a real scheduler, worker processes that are really killed."""

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

import engine.runs.evolve
from engine.errors import ClusterError
from engine.storage.reader import RunReader
from engine.workers.dask_workers import DaskWorkers, local_cluster
from tests.support.made_up import TINY
from tests.support.run_hash import hash_of

pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def cluster():
    """A scheduler with two workers."""
    with local_cluster(2) as cluster:
        yield cluster


def test_a_cluster_gives_the_same_run_though_a_worker_is_killed_at_work(tiny_run, cluster, tmp_path):
    path = tmp_path / "run.tsmr"
    killed = []
    with DaskWorkers(cluster.scheduler_address) as workers:
        assert workers.n_workers == 2

        def kill_one(progress):
            if progress.n_new >= 2 and not killed:
                pid = next(iter(cluster.workers.values())).pid
                killed.append(pid)
                os.kill(pid, signal.SIGKILL)

        engine.runs.evolve.evolve(path, TINY, workers=workers, observer=kill_one)
    assert killed
    assert hash_of(path) == tiny_run[1]


def test_a_robot_that_kills_its_worker_twice_has_failed_and_the_run_goes_on(cluster, bad_task, tmp_path):
    config = bad_task("deadly", "os.kill(os.getpid(), signal.SIGKILL)")
    path = tmp_path / "run.tsmr"
    with DaskWorkers(cluster.scheduler_address) as workers:
        engine.runs.evolve.evolve(path, config, workers=workers)
    with RunReader(path) as reader:
        failures = {e.solution.morphology.n_modules: e.failure for e in reader.all_evaluations()}
    assert "its worker died each time: a worker of the Dask cluster was lost" in failures.pop(3)
    assert set(failures.values()) == {None}


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch):
    monkeypatch.setattr("engine.workers.dask_workers.CONNECT_TIMEOUT", 0.5)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{probe.getsockname()[1]}"
        with pytest.raises(ClusterError, match=f"no Dask scheduler answers at {address}"):
            DaskWorkers(address)


def test_without_the_package_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ClusterError, match=r"pip install 'tensatlas\[cluster\]'"):
        DaskWorkers("tcp://127.0.0.1:1")


@pytest.mark.parametrize("shadowed", ["scheduler", "worker"])
def test_who_would_import_another_package_of_our_name_is_named(tmp_path, tiny_run, shadowed):
    (tmp_path / "engine.py").write_text("")
    ours = os.environ | {"PYTHONPATH": str(Path(engine.__file__).parents[1])}
    env = {
        who: ours | ({"PYTHONPATH": str(tmp_path)} if who == shadowed else {})
        for who in ("scheduler", "worker")
    }
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{probe.getsockname()[1]}"
    dask = [sys.executable, "-P", "-m"]
    lines = {
        "scheduler": [*dask, "distributed.cli.dask_scheduler", "--host", address, "--no-dashboard"],
        "worker": [*dask, "distributed.cli.dask_worker", address, "--no-nanny", "--no-dashboard"],
    }
    started = [subprocess.Popen(line, env=env[who], cwd=tmp_path) for who, line in lines.items()]
    try:
        with (
            pytest.raises(
                ClusterError, match=rf"{shadowed} .*imports another package called engine \(.*engine.py\)"
            ),
            DaskWorkers(address) as workers,
        ):
            engine.runs.evolve.evolve(tmp_path / "run.tsmr", TINY, workers=workers)
    finally:
        for process in started:
            process.kill()
            process.wait()
