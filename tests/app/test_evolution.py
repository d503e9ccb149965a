from __future__ import annotations

import dataclasses
import typing
from pathlib import Path

import pytest

from app import evolution
from app.evolution import NewRun, choices
from engine.config import AlgorithmName, RunConfig
from engine.errors import InvalidData

NEW = NewRun(
    name="new", task="goal-reaching", algorithm="dm-me", preset="smoke", evaluations=4, seed=1, workers=1
)


def test_the_form_offers_what_the_configuration_allows() -> None:
    assert choices("algorithm") == typing.get_args(AlgorithmName)
    assert RunConfig().task in choices("task")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("task", "/tmp/evil.py"),
        ("task", "--help"),
        ("algorithm", "none"),
        ("preset", "huge"),
        ("name", "../up"),
        ("name", ""),
    ],
)
def test_what_is_not_on_offer_starts_nothing(
    field: str, value: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    started: list[object] = []
    monkeypatch.setattr(evolution.subprocess, "Popen", lambda *a, **_: started.append(a))
    with pytest.raises(InvalidData, match=value if field not in ("name",) else "letters, digits"):
        evolution.start(dataclasses.replace(NEW, **{field: value}))
    assert not started
    assert list(tmp_path.iterdir()) == []
