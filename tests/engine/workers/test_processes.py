"""Worker processes of this machine: real ones, killed and hung for real."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import psutil
import pytest

import engine.runs.evolve
from engine.errors import ClusterError, InvalidData, TaskError
from engine.simulation.provenance import this_computer
from engine.storage.reader import RunReader
from engine.storage.writer import RunWriter
from engine.workers.processes import ProcessWorkers
from tests.support.made_up import TINY
from tests.support.run_formats import in_format
from tests.support.run_hash import hash_of


def test_two_processes_give_the_same_run_though_one_is_killed_at_work(tiny_run, tmp_path):
    _, expected = tiny_run
    path = tmp_path / "run.tsmr"
    killed = []
    with ProcessWorkers(2) as workers:
        workers.start()
        pids = workers.pids

        def kill_one(progress):
            if progress.n_new >= 2 and not killed:
                killed.append(pids[0])
                os.kill(pids[0], signal.SIGKILL)

        engine.runs.evolve.evolve(path, TINY, workers=workers, observer=kill_one)
        assert killed
        assert pids[0] not in workers.pids
        assert pids[1] in workers.pids
        assert workers.n_workers == 2
    assert not any(psutil.pid_exists(pid) for pid in pids)
    assert hash_of(path) == expected
    with RunReader(path) as reader:
        assert reader.computers() == {this_computer(): TINY.evaluations}


def test_workers_that_are_killed_while_they_start_are_replaced(tiny_run, tmp_path):
    _, expected = tiny_run
    path = tmp_path / "run.tsmr"
    with ProcessWorkers(2) as workers:
        workers.start()
        first = workers.pids
        for pid in first:
            os.kill(pid, signal.SIGKILL)
        engine.runs.evolve.evolve(path, TINY, workers=workers)
        assert not set(first) & set(workers.pids)
    assert hash_of(path) == expected


def test_workers_that_never_start_end_the_run_with_one_line(tmp_path, monkeypatch):
    end = [sys.executable, "-I", "-S", "-c", "raise SystemExit(3)"]
    monkeypatch.setattr("engine.workers.processes.module_line", lambda *_: end)
    with (
        ProcessWorkers(2) as workers,
        pytest.raises(ClusterError, match=r"end before they can work \(status 3\)"),
    ):
        engine.runs.evolve.evolve(tmp_path / "run.tsmr", TINY, workers=workers)


def test_a_robot_that_kills_its_worker_twice_has_failed_and_the_run_goes_on(bad_task, tmp_path):
    config = bad_task("deadly", "os.kill(os.getpid(), signal.SIGKILL)")
    path = tmp_path / "run.tsmr"
    with ProcessWorkers(2) as workers:
        engine.runs.evolve.evolve(path, config, workers=workers)
    with RunReader(path) as reader:
        evaluations = reader.all_evaluations()
    of_three = [e for e in evaluations if e.solution.morphology.n_modules == 3]
    assert of_three
    for e in evaluations:
        assert (e.failure is not None) == (e in of_three), e.failure
    assert {e.failure for e in of_three} == {"its worker died each time: signal 9"}


def test_a_robot_that_hangs_is_given_up_after_the_timeout(bad_task, tmp_path):
    config = bad_task("endless", "time.sleep(1e6)")
    path = tmp_path / "run.tsmr"
    with ProcessWorkers(2, timeout=10.0) as workers:
        engine.runs.evolve.evolve(path, config, workers=workers)
    with RunReader(path) as reader:
        failures = {e.solution.morphology.n_modules: e.failure for e in reader.all_evaluations()}
    assert failures.pop(3) == "its worker died each time: not finished in 10 s"
    assert set(failures.values()) == {None}


def test_an_error_in_a_users_task_ends_the_run_with_one_line(bad_task, tmp_path):
    config = bad_task("faulty", "raise ZeroDivisionError")
    with ProcessWorkers(1) as workers, pytest.raises(TaskError, match=r"task.py.*ZeroDivisionError"):
        engine.runs.evolve.evolve(tmp_path / "run.tsmr", config, workers=workers)


def test_a_changed_task_file_is_noticed(bad_task, tmp_path):
    config = bad_task("changing", "pass")
    (tmp_path / "changing.py").write_text("# another")
    with ProcessWorkers(1) as workers, pytest.raises(TaskError, match="has changed"):
        engine.runs.evolve.evolve(tmp_path / "run.tsmr", config, workers=workers)


PARENT = """
import sys, time
from engine.workers.processes import ProcessWorkers
from tests.support.run_formats import in_format
if __name__ == "__main__":
    with ProcessWorkers(2) as workers:
        workers.start()
        print(*workers.pids, flush=True)
        time.sleep(1000)
"""


def test_workers_of_a_killed_command_end(tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    parent = subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": str(Path(engine.__file__).parents[1])},
    )
    pids = [int(pid) for pid in parent.stdout.readline().split()]
    assert len(pids) == 2
    parent.kill()
    parent.wait()
    deadline = time.monotonic() + 60
    while any(psutil.pid_exists(pid) for pid in pids) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not any(psutil.pid_exists(pid) for pid in pids)


@pytest.mark.parametrize(("n", "timeout"), [(0, 10.0), (1, 0.0), (1, -1.0), (1, float("nan")), (1, 1e12)])
def test_numbers_out_of_range_are_refused(n, timeout):
    threads = threading.active_count()
    with pytest.raises(InvalidData, match="must be"):
        ProcessWorkers(n, timeout=timeout)
    assert threading.active_count() == threads


def test_what_an_older_file_does_not_know_is_nothing(tiny_run, tmp_path):
    path = in_format(tiny_run[0], tmp_path / "old.tsmr", 1)
    with RunReader(path) as reader:
        assert reader.computers() == {}
        assert reader.canonical_hash() == tiny_run[1]
    RunWriter.open(path).close()
    with RunReader(path) as reader:
        assert reader.computers() == {}
