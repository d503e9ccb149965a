from __future__ import annotations

import dataclasses
import html
import math
import random
import re
from collections import Counter
from xml.etree import ElementTree

import numpy as np
import pytest

from engine.analysis.robustness import Robustness
from engine.body.morphology import Morphology
from engine.control.operators import Neat
from engine.export import robot_id
from engine.storage.reader import RunReader
from engine.tasks import bearing_name
from viz import words
from viz.robot import robot_card
from viz.robot.network_diagram import NetworkDiagram


def test_card_says_what_the_robot_is(small_reader: RunReader) -> None:
    evaluation = small_reader.evaluation(0)
    card = robot_card.render(small_reader.config, evaluation, "<here>", 3)
    body = evaluation.solution.morphology
    assert "Robot 0" in card
    assert "&lt;here&gt;" in card
    assert " ".join(map(str, body.faces)) in card
    f_s = 100 * (0.45 - evaluation.fitness)
    assert f"f<sub>s</sub> {f_s:.2f} cm</span>, as it was evaluated" in card
    assert words.gained(f_s, 0.79) in card
    for sentence in (words.F_S, words.FACES, words.HEAD):
        assert html.escape(words.plain(sentence)) in card
    assert "nobody (random)" in card
    assert robot_id(small_reader.config, evaluation.solution) in card


def test_bars_and_numbers_say_how_much_closer_a_robot_comes(small_reader: RunReader) -> None:
    gains = np.array([6.0, -2.0, 0.01, 3.0])
    evaluation = dataclasses.replace(
        small_reader.evaluation(0), distances=(0.45 - gains / 100)[:, None].astype(np.float32)
    )
    card = robot_card.render(small_reader.config, evaluation, "here", 0)
    for said in ("6.0 cm closer", "2.0 cm farther", "no closer", "3.0 cm closer"):
        assert f">{said}</span>" in card
    bars = re.findall(r'class="ta-gain" style="position:absolute;left:([\d.]+)%;width:([\d.]+)%', card)
    # 8 cm of ground, 2 of them behind where it began
    assert np.array(bars, float) == pytest.approx(
        np.array([[25, 75], [0, 25], [25, 0.1], [25, 37.5]]), abs=0.11
    )


def test_what_to_expect_comes_before_what_was_recorded(small_reader: RunReader) -> None:
    evaluation = small_reader.evaluation(0)
    assert evaluation.fitness is not None
    robust = Robustness("", {}, {0: evaluation.fitness}, {0: {1: 0.43, 2: None, 3: 0.41}})
    card = robot_card.render(small_reader.config, evaluation, "here", 0, robust)
    assert "3.0 cm closer<small> ± 1.4</small>" in card
    assert "mean of 2 trials under fresh noise; recorded" in card
    elsewhere = robot_card.render(small_reader.config, small_reader.evaluation(1), "here", 0, robust)
    assert "as it was evaluated" in elsewhere


def test_the_verdict_names_the_material_and_what_is_wrong() -> None:
    assert "can be built from &lt;x&gt;" in robot_card.render_verdict("<x>", ())
    assert ", <latex> is taken" not in robot_card.render_verdict("tpu", ("It breaks.",), "<latex>")
    assert "not from tpu, latex is taken instead: It" in robot_card.render_verdict("tpu", ("It.",), "latex")
    said = robot_card.render_verdict("tpu", ("It is <thin>.", "It breaks.", "It melts."))
    assert "not from tpu: It is &lt;thin&gt;. And 2 more." in said
    assert "It melts." in said


def test_card_says_where_a_given_robot_is_from(small_reader: RunReader) -> None:
    evaluation = small_reader.evaluation(0)
    solution = dataclasses.replace(evaluation.solution, operator="given", source="<a>.tsmr robot 3")
    card = robot_card.render(
        small_reader.config, dataclasses.replace(evaluation, solution=solution), "here", 0
    )
    assert "&lt;a&gt;.tsmr robot 3" in card
    assert "random" not in card


def test_card_says_which_way_feet_slide(small_reader: RunReader) -> None:
    evaluation = small_reader.evaluation(0)
    assert "feet" not in robot_card.render(small_reader.config, evaluation, "here", 0)
    body = dataclasses.replace(evaluation.solution.morphology, feet="start")
    solution = dataclasses.replace(evaluation.solution, morphology=body)
    footed = dataclasses.replace(evaluation, solution=solution)
    assert "toward the start · 0.3 / 0.8" in robot_card.render(small_reader.config, footed, "here", 0)


@pytest.mark.parametrize(
    ("operator", "said"),
    [
        ("both", "7, body and controller mutated"),
        ("paired", "7, body mutated; the controller is NEAT's"),
        ("exchange", "7, its body with another elite's controller"),
        ("switch", "7 for targets at the left, another network of its body for those at the right"),
    ],
)
def test_card_says_whom_a_robot_descends_from(small_reader: RunReader, operator: str, said: str) -> None:
    evaluation = small_reader.evaluation(0)
    solution = dataclasses.replace(evaluation.solution, parent=7, operator=operator)
    card = robot_card.render(
        small_reader.config, dataclasses.replace(evaluation, solution=solution), "there", 3
    )
    assert said in card


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
    svg = ElementTree.fromstring(
        NetworkDiagram(controller, n_modules, ("far <", "bearing"), head_is_end=True).render()
    )
    outputs = set(range(2 * n_modules))
    assert {"far <", "bearing"} <= {t.text for t in svg.iter("text")}
    texts = [t.text for t in svg.iter("text")]
    assert sum(t == "0.5 Hz" for t in texts) == n_modules
    assert {str(k + 1) for k in range(n_modules)} <= set(texts)
    assert "0" not in texts
    enabled = [c for c in controller.connections if c.enabled]
    leading = set(outputs)
    while more := {c.source for c in enabled if c.target in leading} - leading:
        leading |= more
    expressed = Counter(f"{c.weight:.3f}" for c in enabled if c.target in leading)
    drawn = Counter(line.find("title").text.rsplit(": ")[-1] for line in svg.iter("line"))
    assert drawn == expressed
    # some lead through hidden nodes, and some lead nowhere that is drawn, or are switched off
    assert any(c.target not in outputs for c in enabled if c.target in leading)
    assert expressed.total() < len(controller.connections)


def test_card_lists_unlike_stiffnesses(small_reader: RunReader) -> None:
    evaluation = small_reader.evaluation(0)
    own = dataclasses.replace(
        evaluation, solution=dataclasses.replace(evaluation.solution, morphology=Morphology((3, 10), (1, 2)))
    )
    assert "0.3 1.0 (first to last)" in robot_card.render(small_reader.config, own, "", 3)
    shared = Morphology(3, (1, 2))
    same = dataclasses.replace(
        evaluation, solution=dataclasses.replace(evaluation.solution, morphology=shared)
    )
    assert "0.3 · 34.6 N/m" in robot_card.render(small_reader.config, same, "", 3)
