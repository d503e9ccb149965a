"""Ctrl-C at moments when nothing of the project runs yet: no traceback, and the status of an interruption."""

import os
import signal
import subprocess
from pathlib import Path

import psutil
import pytest

from engine.children import command_line
from tests.support.faulty import ENVIRONMENT, SHORT, wait_until


def imports_numpy(process):
    """Tell whether a process has begun to import what the commands need."""
    try:
        return "_multiarray_umath" in Path(f"/proc/{process.pid}/maps").read_text()
    except OSError:
        return False


def has_workers(process):
    """Tell whether a process has started another one, which imports for a while now."""
    return bool(psutil.Process(process.pid).children())


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
