"""``info`` as a user types it."""

from __future__ import annotations

from pathlib import Path

from tests.support.command_line import Command


def test_info_is_readable(tensatlas: Command, small_run: Path) -> None:
    status, out, _ = tensatlas("info", small_run)
    assert status == 0
    assert "goal-reaching" in out
    assert "18 of 18" in out
    assert "QD score" in out
