import dataclasses
import math

import pytest

from engine.analysis.steering import mirrored_pairs, steers
from engine.body.morphology import Morphology
from engine.config import preset, replaced
from engine.control.genome import ConnectionGene, Controller, NodeGene
from engine.simulation.evaluation import Solution


def test_mirrored_pairs():
    quarter = math.pi / 4
    assert mirrored_pairs((2 * quarter, quarter, -quarter, -2 * quarter)) == [(0, 3), (1, 2)]
    assert mirrored_pairs((0.0, 1.0, 2.0)) == []


def controller(source, target, n_inputs=2):
    """Return one with a single link, strong enough to tell the signs of what it senses apart."""
    outputs = tuple(NodeGene(key=k, bias=0.0, response=1.0) for k in range(20))
    return Controller(
        n_inputs=n_inputs,
        nodes=outputs,
        connections=(ConnectionGene(source=source, target=target, weight=5.0, enabled=True, innovation=0),),
    )


@pytest.mark.parametrize("task", ["goal-reaching", "squeezing"])
def test_a_controller_steers_if_it_feels_the_bearing(task):
    config = replaced(preset("smoke"), task=task)
    n_inputs = 2 if task == "goal-reaching" else 5
    robots = {
        "bearing": controller(-2, 3, n_inputs),
        "distance": controller(-1, 3, n_inputs),
        "a module that the robot has not": controller(-2, 6, n_inputs),
    }
    solutions = [
        Solution(number=k, morphology=Morphology(5, (1, 2, 3)), controller=c)
        for k, c in enumerate(robots.values())
    ]
    assert dict(zip(robots, steers(config, solutions), strict=True)) == {
        "bearing": True,
        "distance": False,
        "a module that the robot has not": False,
    }


def test_outputs_that_a_run_leaves_silent_do_not_steer():
    # the bearing reaches the output beside a neuron without an input
    links = [(-2, 3, 5.0), (20, 3, 1.0)]
    both = Controller(
        n_inputs=2,
        nodes=tuple(NodeGene(key=k, bias=0.0, response=1.0) for k in range(21)),
        connections=tuple(ConnectionGene(a, b, w, True, k) for k, (a, b, w) in enumerate(links)),
    )
    solution = Solution(number=0, morphology=Morphology(5, (1, 2, 3)), controller=both)
    for unfed, feels in (("bias", True), ("zero", False)):
        config = preset("smoke")
        trials = dataclasses.replace(config.trials, unfed_outputs=unfed)
        assert steers(replaced(config, trials=trials), [solution]) == [feels]


def test_raw_centimetres_can_drown_the_bearing():
    links = tuple(
        ConnectionGene(source=source, target=3, weight=weight, enabled=True, innovation=k)
        for k, (source, weight) in enumerate([(-1, 1.0), (-2, 2.0)])
    )
    both = dataclasses.replace(controller(-1, 3), connections=links)
    solution = Solution(number=0, morphology=Morphology(5, (1, 2, 3)), controller=both)
    config = preset("smoke")
    for sensors, feels in (("relative", True), ("centimetres", False)):
        assert steers(replaced(config, sensors=sensors), [solution]) == [feels]
