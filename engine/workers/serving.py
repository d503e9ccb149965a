"""What a worker process of this machine does: ``python -P tensatlas.py -m engine.workers.serving ...``.

Its arguments are the number of its end of a pipe, the seconds that a job may take, and its parent's number.
"""

from __future__ import annotations

import contextlib
import faulthandler
import os
import signal
import sys
import threading
import time
import traceback
from multiprocessing.connection import Connection
from typing import Any, Final

from engine.errors import TensAtlasError
from engine.workers.job import Result, compute
from engine.workers.malloc import keep_memory_compact

READY: Final = "ready"
"""A worker's first message: it takes jobs from now on."""
_PARENT_POLL: Final = 1.0


def serve(connection: Connection, timeout: float, parent: int) -> None:
    """Compute jobs until the other end of the pipe is closed."""
    keep_memory_compact()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_PARENT_POLL)
        os._exit(1)  # a parent that was killed cannot end its children

    threading.Thread(target=watch, daemon=True).start()
    with open(os.devnull, "w") as nowhere, contextlib.suppress(EOFError, OSError):
        # a user's task finds there what it finds in the parent; ours come first all the same
        sys.path += [folder for folder in connection.recv() if folder not in sys.path]
        connection.send(READY)
        while True:
            job: Any = connection.recv()
            # ends the process even while it is inside MuJoCo, or in a task's endless loop
            faulthandler.dump_traceback_later(timeout, exit=True, file=nowhere)
            outcome: list[Result] | Exception
            try:
                outcome = compute(*job)
            except TensAtlasError as e:
                outcome = e
            except Exception:
                outcome = RuntimeError(traceback.format_exc())
            finally:
                faulthandler.cancel_dump_traceback_later()
            connection.send(outcome)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    serve(Connection(int(sys.argv[1])), float(sys.argv[2]), int(sys.argv[3]))
