from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.limits import SimulationBudget
from engine.errors import InvalidData


@given(st.lists(st.tuples(st.floats(0, 30), st.floats(0, 50)), max_size=40))
def test_no_window_ever_holds_more_than_the_limit(steps: list[tuple[float, float]]) -> None:
    now = 0.0
    budget = SimulationBudget(100.0, window=60.0, clock=lambda: now)
    taken: list[tuple[float, float]] = []
    for wait, cost in steps:
        now += wait
        recent = sum(c for t, c in taken if t > now - 60.0)
        if recent + cost > 100.0:
            with pytest.raises(InvalidData, match="wait"):
                budget.spend(cost)
        else:
            budget.spend(cost)
            taken.append((now, cost))


def test_who_is_no_visitor_has_no_limit() -> None:
    budget = SimulationBudget(None)
    for _ in range(100):
        budget.spend(1e9)
    with pytest.raises(InvalidData, match="that much"):
        SimulationBudget(10.0).spend(11.0)
