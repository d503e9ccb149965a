"""What a step of the kernel computes, counted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from benchmarks import counting, steps
from engine.simulation.kernel.lanes import algebra, simd
from engine.simulation.kernel.physics.state import State
from engine.simulation.kernel.step import run
from engine.tasks.walls import Wall


def crawling(n: int, walls: Sequence[Wall]) -> tuple[steps.Model, State]:
    """Return a robot that is under way, and its lanes."""
    robot, model = steps._robot(n, 0, 0)
    state = steps._settled(robot, model, walls)
    for lengths in steps._commands(n, 10, 0):
        steps._command(state, lengths)
        run(model, state, 8)
    return model, state


@pytest.mark.parametrize("walls", [steps.OPEN, steps.CORRIDOR])
def test_a_counted_step_has_the_bits_of_a_compiled_one(walls: Sequence[Wall]) -> None:
    model, counted = crawling(2, walls)
    same, compiled = crawling(2, walls)
    work = counting.count_step(model, counted)
    run(same, compiled, 1)
    for field in ("rods", "link_force", "contact_force", "pair_force"):
        assert np.array_equal(simd.by_lane(getattr(counted, field)), simd.by_lane(getattr(compiled, field)))
    assert sum(work.parts.values()) == work.operations
    assert all(work.parts.values())


def test_operations_loads_and_stores_are_counted_one_by_one() -> None:
    counting.count_step(*crawling(2, steps.OPEN))  # nothing of it is left for the next count
    counting._work = work = counting.Work()
    vectors = simd.reals(3, width=8)
    point = counting._translated(algebra.load3)(vectors, 0)
    squared = counting._translated(algebra.dot)(point, point)
    counting._translated(algebra.store3)(vectors, 0, (squared / 2.0, squared, np.sqrt(squared)))
    assert (work.cheap, work.dear, work.loads, work.stores) == (5, 2, 3, 3)
    assert len(work.touched) == 3


def test_more_modules_cost_more_operations_in_proportion() -> None:
    cables = []
    for n in (2, 4):
        work = counting.count_step(*crawling(n, steps.OPEN))
        cables.append(work.parts["cables"])
    assert cables[1] == 2 * cables[0]
