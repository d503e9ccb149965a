"""A run that is killed on its way, by itself."""

import json
import signal

from engine.config import to_json
from tests.support.forked import run_forked

_RUN_UNTIL_KILLED = """
import json, os, signal, sys
from pathlib import Path
import engine.runs.evolve
from engine.config import from_json

path, config = Path(sys.argv[1]), from_json(json.loads(sys.argv[2]))
limit, made_up = int(sys.argv[3]), sys.argv[4]
if made_up == "yes":
    from tests.support.made_up import MadeUpEvaluator
    engine.runs.evolve.create_evaluator = lambda *_: MadeUpEvaluator()

def observer(progress):
    if progress.n_evaluations >= limit and progress.n_new > 0:
        os.kill(os.getpid(), signal.SIGKILL)

if path.exists():
    engine.runs.evolve.resume(path, observer=observer)
else:
    engine.runs.evolve.evolve(path, config, observer=observer)
"""


def run_until_killed(path, config, n_evaluations, *, made_up=False):
    """Evolve or resume a run in a process that kills itself when ``n_evaluations`` are saved."""
    arguments = [path, json.dumps(to_json(config)), n_evaluations, "yes" if made_up else "no"]
    done = run_forked(_RUN_UNTIL_KILLED, *arguments)
    assert done.returncode == -signal.SIGKILL, done.stderr
