from __future__ import annotations

from pathlib import Path

from app.runs.compare_panel import RunChoice, equal_cost
from viz.runs.run_list import RunFacts

A, B, C, D = (Path(f"{name}.tsmr") for name in "abcd")
FACTS = {
    A: RunFacts(task="goal-reaching", n_closed=80),
    B: RunFacts(task="squeezing", n_closed=40),
    C: RunFacts(problem="not a run"),
    D: RunFacts(task="goal-reaching", n_closed=0),
}


def test_the_runs_of_the_shown_runs_task_are_chosen_until_the_user_chooses() -> None:
    choice = RunChoice()
    choice.offer({A: FACTS[A], B: FACTS[B]}, "goal-reaching")
    assert choice.chosen_paths() == [A]
    choice.offer(FACTS, "goal-reaching")  # a new run joins
    assert choice.chosen_paths() == [A, D]
    choice.toggle(1)
    choice.toggle(0)
    choice.offer({**FACTS, Path("e.tsmr"): FACTS[A]}, "goal-reaching")
    assert choice.chosen_paths() == [B, D]
    choice.offer({A: FACTS[A], D: FACTS[D]}, "goal-reaching")  # what is gone is not chosen
    assert choice.chosen_paths() == [D]
    choice.offer(FACTS, "squeezing")
    assert choice.chosen_paths() == [B]


def test_a_run_that_cannot_be_read_is_never_chosen() -> None:
    choice = RunChoice()
    choice.offer(FACTS, "")  # as when no run is shown
    assert choice.chosen_paths() == []
    choice.set_all(True)
    choice.toggle(2)
    choice.toggle(99)
    assert choice.chosen_paths() == [A, B, D]
    choice.set_all(False)
    assert choice.chosen_paths() == []


def test_equal_cost_is_that_of_the_shortest_run_that_has_any() -> None:
    assert equal_cost([FACTS[p] for p in (A, B, D)]) == 40
    assert equal_cost([FACTS[D]]) is None
