"""What is computed for somebody else."""

import dataclasses

import numpy as np
import pytest

from engine.body.morphology import Morphology
from engine.errors import ClusterError, InvalidData
from engine.simulation.divergence import Failure
from engine.simulation.evaluation import FailedTrial, Solution
from engine.simulation.provenance import Computer, differing, this_computer
from engine.storage.layouts.plain import to_row
from engine.storage.reader import RunReader
from engine.storage.writer import RunWriter
from engine.workers.job import compute, unfinished, world_of
from tests.support.made_up import TINY, made_up_evaluation, some_controller
from tests.support.run_hash import hash_of


def test_a_job_gives_what_the_run_has(tiny_run):
    with RunReader(tiny_run[0]) as reader:
        expected = reader.evaluation(3)
    (result,) = compute(world_of(TINY), [expected.solution])
    assert to_row(0, result.evaluation) == to_row(0, expected)
    assert result.failed is None
    assert result.origin.computer == this_computer()
    assert result.origin.seconds > 0
    assert hash_of(tiny_run[0]) == tiny_run[1]


def test_solutions_computed_together_give_what_the_run_has(tiny_run):
    with RunReader(tiny_run[0]) as reader:
        expected = {e.solution.number: e for e in reader.all_evaluations()}
    results = compute(world_of(TINY), [e.solution for e in expected.values()])
    assert len(results) == len(expected)
    for result in results:
        number = result.evaluation.solution.number
        assert to_row(0, result.evaluation) == to_row(0, expected[number])
    assert len({r.origin for r in results}) == 1


class OddOnesFail:
    """An evaluator whose robots of odd numbers fail."""

    def __init__(self, *, keep_failure, **_):
        self._keep = keep_failure

    def evaluate(self, solutions):
        for s in solutions:
            if s.number % 2:
                failure = Failure("flew", 1, np.zeros(1), np.zeros((1, 10)))
                self._keep(
                    FailedTrial(
                        solution=s,
                        head_is_end=False,
                        stage="settling",
                        target=None,
                        repeat=None,
                        failure=failure,
                    )
                )
        yield [made_up_evaluation(s) for s in reversed(solutions)]


def test_each_failure_comes_with_its_solution(monkeypatch):
    monkeypatch.setattr("engine.workers.job.LocalEvaluator", OddOnesFail)
    solutions = [
        Solution(number=k, morphology=Morphology(5, (1, 1)), controller=some_controller()) for k in range(4)
    ]
    found = {r.evaluation.solution.number: r.failed for r in compute(world_of(TINY), solutions)}
    assert {k: failed and failed.solution.number for k, failed in found.items()} == {
        0: None,
        1: 1,
        2: None,
        3: 3,
    }


def test_another_body_is_refused(tiny_run):
    with RunReader(tiny_run[0]) as reader:
        solution = reader.evaluation(0).solution
    with pytest.raises(ClusterError, match="another version"):
        compute(dataclasses.replace(world_of(TINY), body="another"), [solution])


def test_what_no_worker_survives_can_be_stored(tiny_run, tmp_path):
    with RunReader(tiny_run[0]) as reader:
        solution = reader.evaluation(0).solution
    with RunWriter.create(tmp_path / "run.tsmr", TINY, {}) as writer:
        writer.add_evaluations(0, [unfinished(TINY, solution, "died of \x1b[2J")])
    with RunReader(tmp_path / "run.tsmr") as reader:
        e = reader.evaluation(0)
    assert (e.solution, e.fitness, e.failure) == (solution, None, "died of ~1b[2J")


def test_computers_that_differ_are_told_apart():
    one = Computer(machine="x86_64", simd="avx2 fma", mujoco="4.0.0", numpy="2.4.6")
    other = dataclasses.replace(one, simd="")
    assert differing([one, one]) == []
    assert differing([one, other]) == ["simd: avx2 fma | unknown"]
    assert Computer.from_json(dataclasses.asdict(one)) == one
    for data in ([], {"machine": "x"}, dataclasses.asdict(one) | {"numpy": 3}):
        with pytest.raises(InvalidData, match="a computer"):
            Computer.from_json(data)


def test_this_computer_is_described():
    here = this_computer()
    assert here.mujoco[0].isdigit()
    assert here.machine in str(here)
