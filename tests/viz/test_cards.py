from __future__ import annotations

import math
import random
from xml.etree import ElementTree

import pytest

from engine.controller import Neat
from engine.reader import RunReader
from engine.tasks import bearing_name
from viz import network_diagram, robot_card


def test_card_says_what_the_robot_is(small_reader: RunReader) -> None:
    evaluation = small_reader.evaluation(0)
    card = robot_card.render(small_reader.config, evaluation, "<here>", 3)
    body = evaluation.solution.morphology
    assert "Robot 0" in card
    assert "&lt;here&gt;" in card
    assert " ".join(map(str, body.faces)) in card
    assert f"{100 * (0.45 - evaluation.fitness):.1f} cm" in card
    assert card.count("cm</span></div>") == 4  # one line per target
    assert "nobody (random)" in card


@pytest.mark.parametrize(
    ("bearing", "name"),
    [(math.pi / 2, "90° left"), (-math.pi / 4, "45° right"), (0.0, "straight ahead")],
)
def test_targets_are_named_for_people(bearing: float, name: str) -> None:
    assert bearing_name(bearing) == name


@pytest.mark.parametrize("n_modules", [2, 10])
def test_network_is_drawn_with_all_its_expressed_links(n_modules: int) -> None:
    neat, rng = Neat(n_inputs=2), random.Random(4)
    controller = neat.random(rng)
    for _ in range(25):
        controller = neat.mutate(controller, rng)
    svg = ElementTree.fromstring(network_diagram.render(controller, n_modules))
    outputs = set(range(2 * n_modules))
    texts = [t.text for t in svg.iter("text")]
    assert sum("freq." in (t or "") for t in texts) == n_modules
    direct = [c for c in controller.connections if c.enabled and c.target in outputs]
    assert len(list(svg.iter("line"))) >= len(direct)
