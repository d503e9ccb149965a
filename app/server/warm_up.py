"""The compiled simulation made ready in the background, so that no click has to wait for it."""

from __future__ import annotations

import contextlib
import logging
import subprocess
import sys
import threading
from pathlib import Path
from typing import Final

import viser
from numba.core.compiler_lock import global_compiler_lock

from engine.simulation.compile_kernel import NOTICE, compile_kernel, is_compiled, kept_in

log = logging.getLogger(__name__)

_ROOT: Final = Path(__file__).resolve().parents[2]
_COMPILE: Final = f"""
import sys
sys.path.insert(0, {str(_ROOT)!r})
from engine.simulation.compile_kernel import compile_kernel
compile_kernel()
"""
"""Program of the process that compiles, wherever it is started."""


class WarmUp:
    """Loads the compiled simulation, and has it compiled first if this machine has none.

    A process of its own compiles: it takes half a minute, in which this one answers browsers, and 250 MB.
    Whoever wants to simulate meanwhile waits, for Numba compiles one thing at a time.
    """

    def __init__(self) -> None:
        self._mutex = threading.Lock()
        self._compiling: bool | None = None  # not known before the thread has looked
        self._closed = False
        self._unknowing: list[viser.ClientHandle] = []
        self._notices: list[viser.NotificationHandle] = []
        self._compiler: subprocess.Popen[bytes] | None = None
        self._thread = threading.Thread(target=self._run, name="warm-up", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def tell(self, client: viser.ClientHandle) -> None:
        """Show a browser a notice while it has to wait for the simulation."""
        with self._mutex:
            # what is only loaded is there before anybody has read a notice
            if self._compiling:
                self._notify(client)
            elif self._compiling is None:
                self._unknowing.append(client)

    def _notify(self, client: viser.ClientHandle) -> None:
        self._notices.append(
            client.add_notification(
                "One moment",
                f"{NOTICE}. Robots move as soon as it is done.",
                loading=True,
            )
        )

    def wait(self) -> None:
        """Wait until the simulation is ready."""
        self._thread.join()

    def close(self) -> None:
        """Give up."""
        with self._mutex:
            self._closed = True
            if self._compiler is not None:
                self._compiler.terminate()

    def _run(self) -> None:
        try:
            if self._has_to_compile():
                print(NOTICE, flush=True)
                if kept_in() is not None:
                    with global_compiler_lock:
                        self._compile_elsewhere()
            if not self._closed:
                compile_kernel()
        except Exception:  # whoever simulates will meet it again and say so
            log.exception("the simulation could not be compiled")
        with self._mutex:
            self._compiling = False
            for notice in self._notices:
                with contextlib.suppress(Exception):  # its browser may have gone
                    notice.remove()

    def _has_to_compile(self) -> bool:
        """Load what is compiled already; return whether that is not all, and tell who has come meanwhile."""
        compiling = not is_compiled()
        with self._mutex:
            self._compiling = compiling
            if compiling:
                for client in self._unknowing:
                    with contextlib.suppress(Exception):  # its browser may have gone
                        self._notify(client)
            self._unknowing.clear()
        return compiling

    def _compile_elsewhere(self) -> None:
        """Compile in another process; what fails there is compiled here afterwards."""
        with self._mutex:
            if self._closed:
                return
            self._compiler = subprocess.Popen(
                [sys.executable, "-P", "-c", _COMPILE],
                stdin=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is meant for the app, which ends it
            )
        self._compiler.wait()
