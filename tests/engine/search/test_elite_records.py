"""What a search remembers of its elites, worked out by hand and against a search."""

import dataclasses
import random
from collections import Counter

import pytest

from engine.config import create_algorithm, replaced
from engine.search.elite_records import MAX_SAMPLES, Curiosity, Samples
from engine.simulation.evaluation import Solution
from tests.support.made_up import MADE_UP, evaluation, generation, made_up_evaluation


def child(number, parent):
    made = evaluation(number).solution
    return Solution(number=number, morphology=made.morphology, controller=made.controller, parent=parent)


# ---- curiosity


def test_scores_rise_by_1_and_fall_by_half_down_to_a_tenth():
    c = Curiosity()
    assert c.score(7) == 1.0
    c.learn([child(10, 7), child(11, 7), child(12, 8), child(13, None)], held={7, 8, 10})
    assert (c.score(7), c.score(8), c.score(10)) == (1.5, 0.5, 1.0)
    c.learn([child(14, 8), child(15, 8)], held={7, 8, 10})
    assert c.score(8) == 0.1
    c.learn([child(16, 8)], held={7, 8, 16})
    assert c.score(8) == 1.1


def test_who_lost_its_place_is_forgotten():
    c = Curiosity()
    c.learn([child(10, 7), child(11, 7)], held={7, 10, 11})
    assert c.state() == {"7": 3.0}
    c.learn([], held={10, 11})
    assert c.state() == {}
    assert c.score(7) == 1.0


def test_parents_are_drawn_in_proportion():
    c = Curiosity()
    c.learn([child(10, 1), child(11, 1), child(12, 2)], held={1, 2, 3, 10, 11})
    elites = [evaluation(number) for number in (1, 2, 3)]
    n = 6000
    drawn = Counter(e.solution.number for e in c.draw(elites, n, random.Random(1)))
    for number, score in ((1, 3.0), (2, 0.5), (3, 1.0)):
        assert drawn[number] / n == pytest.approx(score / 4.5, abs=0.03)
    with pytest.raises(IndexError):
        c.draw([], 1, random.Random(1))


def test_a_search_learns_from_what_its_archives_hold():
    config = replaced(MADE_UP, parents="curiosity")
    algorithm, expected = create_algorithm(config), {}
    for _ in range(9):
        told = generation(algorithm)
        held = {e.solution.number for a in algorithm.archives.values() for e in a.elites()}
        for e in told:
            if (parent := e.solution.parent) is not None:
                step = 1.0 if e.solution.number in held else -0.5
                expected[parent] = max(0.1, expected.get(parent, 1.0) + step)
        expected = {number: score for number, score in expected.items() if number in held}
        assert algorithm.state()["curiosity"] == {str(n): s for n, s in expected.items()}
    assert max(expected.values()) > 1.0 > min(expected.values())


# ---- samples


def again(number, first, fitness):
    made = evaluation(number, fitness)
    solution = dataclasses.replace(made.solution, parent=first, operator="again")
    return dataclasses.replace(made, solution=solution)


def test_an_elite_counts_with_its_mean():
    samples, first = Samples(), evaluation(3, 0.30)
    assert samples.fitness(first) == 0.30
    assert samples.representative(first) is first is samples.first(first)
    worse = again(8, 3, 0.40)
    samples.add(first, worse)
    # both are equally far from the mean: the worse stands for them
    assert samples.fitness(first) == samples.fitness(worse) == pytest.approx(0.35)
    assert samples.representative(first) is worse
    assert samples.first(worse) is first
    middle = again(9, 3, 0.34)
    samples.add(worse, middle)
    assert samples.fitness(worse) == pytest.approx((0.30 + 0.40 + 0.34) / 3)
    assert samples.representative(worse) is middle
    assert samples.state() == [[3, 8, 9]]


def test_the_least_known_elites_are_chosen_and_of_these_the_best():
    samples = Samples()
    a, b, c = evaluation(1, 0.3), evaluation(2, 0.2), evaluation(3, 0.4)
    held = [a, b, c, a]
    chosen = [s.number for s in samples.choose(held, 9, [])]
    assert chosen == [2, 1, 3]
    assert [s.number for s in samples.choose(held, 2, [])] == [2, 1]
    samples.add(b, again(4, 2, 0.2))
    assert [s.number for s in samples.choose(held, 9, [])] == [1, 3, 2]
    # what is under way counts as known
    assert [s.number for s in samples.choose(held, 9, [again(5, 1, 0.0).solution])] == [3, 2, 1]
    for k in range(MAX_SAMPLES - 2):
        samples.add(b, again(10 + k, 2, 0.2))
    assert [s.number for s in samples.choose(held, 9, [])] == [1, 3]


def test_samples_are_kept_over_an_interruption_and_forgotten_with_their_elite():
    samples, first, other = Samples(), evaluation(3, 0.30), again(8, 3, 0.40)
    samples.add(first, other)
    resumed = Samples()
    resumed.restore(samples.state(), lambda numbers: {n: {3: first, 8: other}[n] for n in numbers})
    assert (resumed.state(), resumed.fitness(first)) == ([[3, 8]], samples.fitness(first))
    samples.forget({4})
    assert samples.state() == []


def noisy(solution):
    """Evaluate a solution: luck outweighs what its stiffness gives; some robots fail under some noise."""
    rng = random.Random(solution.number)
    fitness = 0.2 + 0.02 * solution.morphology.stiffness_level + rng.gauss(0.0, 0.1)
    if rng.random() < 0.1:
        fitness = None
    return dataclasses.replace(made_up_evaluation(solution), fitness=fitness)


def test_a_search_evaluates_elites_again_and_keeps_them_by_their_mean():
    config = replaced(MADE_UP, evaluations=320, reevaluations=3)
    algorithm, everybody = create_algorithm(config), {}
    lost = 0
    for generation_number in range(50):
        before = {s.solution.number: s for a in algorithm.archives.values() for s in a.elites()}
        told = [noisy(s) for s in algorithm.ask()]
        repeated = [e for e in told if e.solution.operator == "again"]
        assert len(repeated) == (3 if generation_number else 0)
        for e in repeated:
            first = everybody[e.solution.parent].solution
            assert (first.morphology, first.controller) == (e.solution.morphology, e.solution.controller)
            assert first.operator != "again"
        everybody |= {e.solution.number: e for e in told}
        algorithm.tell(told)
        samples = {}
        for e in everybody.values():
            own = e.solution.parent if e.solution.operator == "again" else e.solution.number
            samples.setdefault(own, []).append(e.fitness)
        state = {numbers[0]: numbers for numbers in algorithm.state()["samples"]}
        assert all(len(numbers) > 1 for numbers in state.values())
        for archive in algorithm.archives.values():
            for _, e in archive:
                own = Samples.number(e)
                assert None not in samples[own]
                mean = sum(samples[own]) / len(samples[own])
                assert archive.judge(e) == pytest.approx(mean)
                nearest = min(abs(f - mean) for f in samples[own])
                assert abs(e.fitness - mean) == pytest.approx(nearest)
        lost += any(e.fitness is None for e in repeated)
        assert before or generation_number == 0
    assert lost > 3
    # the true fitness of what is kept is better than that of a search that trusts its luck
    trusting = create_algorithm(replaced(MADE_UP, evaluations=320))
    while solutions := trusting.ask():
        trusting.tell([noisy(s) for s in solutions])

    def optimism(a):
        held = a.archives["morphology"].elites()
        true = [0.2 + 0.02 * e.solution.morphology.stiffness_level for e in held]
        return sum(t - e.fitness for t, e in zip(true, held, strict=True)) / len(held)

    assert optimism(algorithm) < optimism(trusting) / 2
