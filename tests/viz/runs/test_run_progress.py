from __future__ import annotations

import re

import pytest

from viz.runs.run_progress import duration, render, render_failures, render_trouble


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.2, "1 s"),
        (89, "89 s"),
        (600, "10 min"),
        (7200, "2 h"),
        (7300, "2 h 2 min"),
        (200_000, "2 days 7 h"),
    ],
)
def test_durations_are_for_people(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_progress_speed_and_failures_are_said_if_there_are_any() -> None:
    assert _text(render(1200, 45_000, speed=0.5, n_failed=3)) == (
        "1,200 of 45,000 evaluations · 30.0 per min · 24 h 20 min left · 3 failed"
    )
    assert _text(render(5, 10, speed=None, n_failed=0)) == "5 of 10 evaluations"
    assert _text(render(5, 10, speed=None, n_failed=0, n_kept=3)) == (
        "5 of 10 evaluations · slimmed: it holds 3 robots and cannot be resumed"
    )


def test_what_a_log_or_a_file_name_says_is_escaped() -> None:
    assert "<script>" not in render_trouble(["<script>alert(1)</script>"])
    assert "log" not in _text(render_trouble([]))
    shown = render_failures(["evaluation-000012-target-1-repeat-0", "evaluation-000003-settling", "<b>"], "x")
    assert "robot 12, target 2, seed 1" in _text(shown)
    assert "robot 3, settling" in _text(shown)
    assert "<b>" not in shown
    assert re.findall(r'data-c="(.*?)"', shown) == ["dump:0", "dump:1", "dump:2"]


def _text(content: str) -> str:
    return re.sub(r"<.*?>", "", content).replace("&lt;", "<").strip()
