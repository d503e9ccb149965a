"""The project as a user runs it: in processes, from any folder."""

from __future__ import annotations

import os
import socket
from pathlib import Path


def environment() -> dict[str, str]:
    """Return an environment in which a process finds the project from any folder."""
    return {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[2])}


def free_port() -> int:
    """Return a port that nobody listens on at this moment."""
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]
