"""Processes of the project, and runs whose evaluations are made up, so that writing is all they do."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

from tests.support.forked import run_forked

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}

PREAMBLE = """
import dataclasses, sys
from pathlib import Path
import engine.runs.evolve
from engine.config import replaced
from engine.simulation.trials import TrialConfig
from tests.support.made_up import MADE_UP, TINY, MadeUpEvaluator
engine.runs.evolve.create_evaluator = lambda *_: MadeUpEvaluator()
SMALL = replaced(MADE_UP, evaluations=44, refit_generations=(0, 2))
path = Path(sys.argv[1])
"""

SHORT = (
    "--preset smoke --evaluations 14 --initial 8 --batch-size 2 --workers 1 --trials.repeats 1"
    " --trials.settle-time 0.2 --trials.open-loop-time 0.2 --trials.trial-time 1"
).split()
"""Flags of an evolution of real simulations that takes seconds."""


def python(code, *arguments):
    """Run code with ``PREAMBLE`` before it; its first argument is ``path``."""
    done = run_forked(PREAMBLE + code, *arguments)
    assert done.returncode == 0, done.stderr
    return done


def command(*arguments):
    """Return a command line of the project."""
    return [sys.executable, "-m", "app", *map(str, arguments)]


def tensatlas(*arguments, env=None, **options):
    """Run the project's command to its end."""
    return subprocess.run(
        command(*arguments),
        env=ENVIRONMENT | (env or {}),
        capture_output=True,
        text=True,
        timeout=120,
        **options,
    )


def start(*arguments):
    """Start the project's command."""
    return subprocess.Popen(
        command(*arguments), env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def wait_until(condition, seconds=60.0):
    """Wait until something is true."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def line_of(done):
    """Return the one line that a user's error is reported in."""
    lines = done.stderr.strip().splitlines()
    assert "Traceback" not in done.stderr
    assert lines[-1].startswith("tensatlas: "), done.stderr
    return lines[-1]
