"""Ctrl-C at moments when nothing of the project runs yet: no traceback, and the status of an interruption."""

import io
import os
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from rich.console import Console

import tensatlas
from app.cli import evolve
from app.worker_flags import WorkerFlags
from engine.children import command_line
from tests.support.faulty import ENVIRONMENT, SHORT, wait_until


def imports_numpy(process):
    """Tell whether a process has begun to import what the commands need."""
    of_process = Path(f"/proc/{process.pid}")
    try:
        # until it is a program of its own, it is a copy of this one, which has NumPy
        started = b"tensatlas.py" in (of_process / "cmdline").read_bytes()
        return started and "_multiarray_umath" in (of_process / "maps").read_text()
    except OSError:
        return False


def has_workers(process):
    """Tell whether a process has started another one, which imports for a while now."""
    return bool(psutil.Process(process.pid).children())


@pytest.mark.parametrize(
    ("is_there", "said"), [(False, "Stopped. Nothing had begun."), (True, "continue with")]
)
def test_only_a_run_that_is_there_is_to_be_continued(tmp_path, monkeypatch, is_there, said):
    path, console = tmp_path / "run.tsmr", Console(file=io.StringIO(), width=200)
    if is_there:
        path.touch()

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(evolve, "compute_run", interrupted)
    with pytest.raises(KeyboardInterrupt):
        evolve._compute(path, None, WorkerFlags(), console, prefix="")
    assert said in console.file.getvalue()


@pytest.mark.parametrize("is_time", [imports_numpy, has_workers])
def test_an_interruption_prints_no_traceback(tmp_path, is_time):
    line = command_line("evolve", str(tmp_path / "run.tsmr"), *SHORT, "--workers", "2")
    process = subprocess.Popen(
        line, env=ENVIRONMENT, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    wait_until(lambda: is_time(process) or process.poll() is not None)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all of them
    _, said = process.communicate(timeout=60)
    assert "Traceback" not in said
    assert "KeyboardInterrupt" not in said
    assert process.returncode == 130


def test_a_compiled_module_may_report_an_interruption_as_its_own_failure(monkeypatch):
    """As pybind11's do: an error whose cause is the interruption."""

    class Interrupted:
        def find_spec(self, name, _path=None, _target=None):
            if name == "app.cli.main":
                raise ImportError("initialization failed") from KeyboardInterrupt()

    monkeypatch.setattr(sys, "meta_path", [Interrupted(), *sys.meta_path])
    monkeypatch.delitem(sys.modules, "app.cli.main", raising=False)
    monkeypatch.setattr(sys, "argv", ["tensatlas", "--help"])
    with pytest.raises(SystemExit) as ended:
        tensatlas.main()
    assert ended.value.code == tensatlas.INTERRUPTED
