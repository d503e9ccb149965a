from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from app.cli.main import main
from tests.support.command_line import Command


@pytest.fixture
def tensatlas(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """Run a command in an empty folder; return exit status, standard output, standard error."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> tuple[int, str, str]:
        status = 0
        try:
            main([str(a) for a in arguments])
        except SystemExit as e:
            status = int(e.code or 0)
        out, err = capsys.readouterr()
        return status, out, err

    return run


@pytest.fixture
def copy(small_run: Path, tmp_path: Path) -> Path:
    """A copy of the small run, to be written to."""
    return Path(shutil.copy(small_run, tmp_path / "small.tsmr"))
