"""Jobs of several solutions, on workers that may die of one of them."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from engine.body.morphology import Morphology
from engine.config import RunConfig
from engine.simulation.evaluation import MOST_TOGETHER, Solution, in_groups, most_together
from engine.simulation.physics import Physics
from engine.simulation.provenance import Origin, this_computer
from engine.workers.job import Result, world_of
from engine.workers.pool import MAX_DEATHS, Died, PoolQueue
from tests.support.made_up import examples, made_up_evaluation, some_controller

CONTROLLER = some_controller()
SOLUTIONS = st.lists(st.integers(2, 10), max_size=60).map(
    lambda sizes: [sized(k, n) for k, n in enumerate(sizes)]
)


def sized(number, n_modules):
    return Solution(number=number, morphology=Morphology(5, (1,) * n_modules), controller=CONTROLLER)


@examples(100)
@given(SOLUTIONS, st.integers(1, 8))
def test_groups_have_one_size_and_the_largest_come_first(solutions, most):
    groups = in_groups(solutions, most)
    assert sorted(s.number for group in groups for s in group) == list(range(len(solutions)))
    assert all(1 <= len(group) <= most for group in groups)
    sizes = [{s.morphology.n_modules for s in group} for group in groups]
    assert all(len(size) == 1 for size in sizes)
    order = [size.pop() for size in sizes]
    assert order == sorted(order, reverse=True)
    for n in set(order):
        of_size = [len(group) for group, own in zip(groups, order, strict=True) if own == n]
        assert len(of_size) == -(-sum(of_size) // most)
        assert max(of_size) - min(of_size) <= 1


def test_few_solutions_are_spread_over_the_workers():
    kernel, mujoco = Physics(simulator="kernel"), Physics(simulator="mujoco")
    assert [most_together(240, n, kernel) for n in (1, 2, 40, 512)] == [MOST_TOGETHER, MOST_TOGETHER, 2, 1]
    assert most_together(24, 2, kernel) == 4
    assert most_together(3, 0, kernel) == 1
    assert most_together(240, 1, mujoco) == 1


class Crew:
    """One worker, which some solutions kill.

    Args:
        deadly: their numbers.
        often: how many workers each kills before it lets one live.
    """

    n_workers = 1

    def __init__(self, deadly, often=99):
        self.jobs = []
        self._left = dict.fromkeys(deadly, often)
        self._waiting = []

    def submit(self, _world, solutions):
        self._waiting.append(solutions)

    def wait(self):
        solutions = self._waiting.pop(0)
        self.jobs.append([s.number for s in solutions])
        for number in self.jobs[-1]:
            if self._left.get(number, 0):
                self._left[number] -= 1
                return [(solutions, Died("signal 9"))]
        origin = Origin(this_computer(), 0.5)
        return [(solutions, [Result(made_up_evaluation(s), None, origin) for s in solutions])]


def evaluated(crew, solutions):
    queue = PoolQueue(workers=crew, world=world_of(RunConfig()))
    found = {e.solution.number: e for group in queue.evaluate(solutions) for e in group}
    assert sorted(found) == [s.number for s in solutions]
    return found


def test_robots_of_one_size_are_evaluated_together():
    crew = Crew(())
    found = evaluated(crew, [sized(k, 2 + k % 2) for k in range(24)])
    assert [len(job) for job in crew.jobs] == [6, 6, 6, 6]
    assert all(e.failure is None for e in found.values())


def test_a_solution_that_kills_workers_takes_no_other_with_it():
    crew = Crew([4])
    found = evaluated(crew, [sized(k, 3) for k in range(24)])
    assert [k for k, e in found.items() if e.failure] == [4]
    assert found[4].failure == "its worker died each time: signal 9"
    together = next(job for job in crew.jobs if 4 in job)
    assert len(together) > 1
    # each of them by itself afterwards, the deadly one as often as any
    assert sorted(job[0] for job in crew.jobs if len(job) == 1) == sorted(together + [4] * (MAX_DEATHS - 1))


def test_a_worker_lost_by_chance_costs_no_solution():
    crew = Crew([7], often=MAX_DEATHS)
    found = evaluated(crew, [sized(k, 3) for k in range(24)])
    assert not any(e.failure for e in found.values())
