"""What the timing benchmarks share: this machine in a line, and CPU time inside the kernel."""

from __future__ import annotations

import dataclasses
import os
import platform
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mujoco

from engine.simulation.kernel.loop import dropped, trials
from engine.simulation.provenance import processor_facts


@dataclasses.dataclass
class Clock:
    """Seconds that a block took.

    Attributes:
        cpu: of all threads.
        inside: of those, inside the kernel's compiled code.
    """

    cpu: float = 0.0
    inside: float = 0.0

    @property
    def outside(self) -> float:
        """Share of the CPU time outside compiled code, 0 to 1."""
        return 1.0 - self.inside / self.cpu


@contextmanager
def timed() -> Iterator[Clock]:
    """Time a block on one thread; what it computes is the same with and without."""
    clock = Clock()
    entries = [
        (module, name, getattr(module, name)) for module in (trials, dropped) for name in ("begin", "run")
    ]

    def watched(entry: Callable[..., None]) -> Callable[..., None]:
        def run(*args: Any) -> None:
            started = time.process_time()
            entry(*args)
            clock.inside += time.process_time() - started

        return run

    for module, name, entry in entries:
        setattr(module, name, watched(entry))
    started = time.process_time()
    try:
        yield clock
    finally:
        clock.cpu = time.process_time() - started
        for module, name, entry in entries:
            setattr(module, name, entry)


def machine() -> str:
    """Return processor, cores and versions in one line."""
    model = processor_facts().get("model name", platform.processor() or platform.machine())
    return (
        f"{model}, {os.cpu_count()} cores, Python {platform.python_version()},"
        f" MuJoCo {mujoco.mj_versionString()}"
    )
