"""Code in processes of its own, forked from one that has imported the engine: each begins at once.

A start of Python that imports what a run needs takes two seconds of a processor.
"""

from __future__ import annotations

import atexit
import dataclasses
import functools
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[2]
PATIENCE: Final = 120
"""Seconds after which a process is ended."""

_PARENT: Final = """
import json, os, signal, sys, traceback
import sklearn.decomposition, sklearn.preprocessing
import benchmarks.faults, engine.runs.evolve, engine.simulation.kernel.loop.closed_loop, tests.support.made_up

for line in sys.stdin:
    code, arguments, out, err, patience = json.loads(line)
    child = os.fork()
    if not child:
        for stream, path in (0, os.devnull), (1, out), (2, err):
            os.dup2(os.open(path, os.O_RDWR), stream)
        signal.alarm(patience)
        sys.argv, status = ["-c", *arguments], 0
        try:
            exec(compile(code, "<code>", "exec"), {"__name__": "__main__"})
        except BaseException:
            traceback.print_exc()
            status = 1
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


@dataclasses.dataclass(frozen=True, slots=True)
class Done:
    """What came of a process; a negative status is the signal that ended it."""

    returncode: int
    stdout: str
    stderr: str


def run_forked(code: str, *arguments: object) -> Done:
    """Run code to its end, with arguments in ``sys.argv``, in a process without threads of ours."""
    parent = _parent()
    assert parent.stdin is not None
    assert parent.stdout is not None
    with tempfile.NamedTemporaryFile() as out, tempfile.NamedTemporaryFile() as err:
        job = [code, [str(a) for a in arguments], out.name, err.name, PATIENCE]
        print(json.dumps(job), file=parent.stdin, flush=True)
        status = int(parent.stdout.readline())
        return Done(status, out.read().decode(), err.read().decode())


@functools.cache
def _parent() -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, "-c", _PARENT],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    atexit.register(process.communicate)  # the end of its input is its end
    return process
