"""``explore`` where the app cannot be served."""

from __future__ import annotations

import socket
from pathlib import Path

from tests.support.command_line import Command


def test_a_port_in_use_gets_one_line(tensatlas: Command, small_run: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        status, _, err = tensatlas("explore", small_run, "--port", port)
    assert (status, err.count("\n")) == (2, 1)
    assert f"cannot listen on 127.0.0.1:{port}" in err
