"""The pictures that follow a replay: module numbers, the network at work, the servos."""

from __future__ import annotations

import dataclasses
import math
import random
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.body import servo
from engine.body.morphology import Morphology
from engine.control.genome import ConnectionGene, Controller, NodeGene
from engine.control.operators import Neat
from engine.storage.rows import Ancestor
from engine.tasks.goal_reaching import GOAL_REACHING
from viz.robot import lineage_list, servo_plot, tension_legend
from viz.robot.geometry import full_tension
from viz.robot.network_diagram import NetworkDiagram, sensed_line
from viz.robot.stroke_font import NumberStrokes


@given(st.lists(st.integers(0, 999), min_size=1, max_size=12), st.integers(0, 2**32))
def test_numbers_stand_at_their_points_in_the_plane_of_the_screen(numbers: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = rng.normal(size=(len(numbers), 3))
    strokes = NumberStrokes(numbers, height=0.02)
    segments = strokes.place(points, axes[0], axes[1]).astype(float)
    assert segments.shape == (len(strokes.owner), 2, 3)
    for k, number in enumerate(numbers):
        own = (segments[strokes.owner == k] - points[k]) @ axes.T
        assert len(own)
        assert np.abs(own[..., 2]).max() < 1e-6  # in the plane
        assert own[..., 1].min() == pytest.approx(0.0, abs=1e-6)
        assert own[..., 1].max() == pytest.approx(0.02, abs=1e-6)
        assert np.abs(own[..., 0]).max() <= 0.02 * len(str(number))


@pytest.mark.parametrize("head_is_end", [True, False])
def test_the_style_shows_what_the_servos_get(head_is_end: bool) -> None:
    neat, rng = Neat(n_inputs=2), random.Random(4)
    controller = neat.random(rng)
    for _ in range(25):
        controller = neat.mutate(controller, rng)
    diagram = NetworkDiagram(controller, 4, ("distance", "bearing"), head_is_end=head_is_end)
    svg = ElementTree.fromstring(diagram.render())
    classes = " ".join(e.get("class") or "" for e in svg.iter()).split()
    neurons = diagram.network.neurons(np.array([30.0, -0.7]))
    style = diagram.style(neurons)
    assert len(style) < 40 * 3 * len(neurons)
    for key in neurons:
        assert classes.count(f"n{key}") == 1
        assert f".n{key}{{fill:#" in style
    for key in diagram.network.outputs:
        options = servo.PHASES if key % 2 else servo.FREQUENCIES
        (chosen,) = re.findall(rf"\.o{key}-(\d)", style)
        assert options[int(chosen)] == servo.pick(options, np.array(neurons[key]))
        assert classes.count(f"o{key}-{chosen}") == 1
        assert f".b{key}{{transform:scaleX({neurons[key]:.2f})}}" in style
    # the first pair of outputs drives the head
    assert diagram.modules == ((3, 2, 1, 0) if head_is_end else (0, 1, 2, 3))
    numbers = [e.text for e in svg.iter("text") if any(c.tag == "title" for c in e)]
    assert numbers == (["4", "3", "2", "1"] if head_is_end else ["1", "2", "3", "4"])
    assert diagram.style({}) == ""
    assert diagram.style(neurons) != diagram.style(diagram.network.neurons(np.array([1.0, 2.0])))


def test_a_network_that_nobody_could_read_is_not_drawn() -> None:
    n = 400
    nodes = [NodeGene(k, 0.0) for k in range(20 + n)]
    links = [
        ConnectionGene(a, b, 1.0, True, k)
        for k, (a, b) in enumerate(pair for h in range(20, 20 + n) for pair in ((-1, h), (h, h % 8)))
    ]
    controller = Controller(n_inputs=2, nodes=tuple(nodes), connections=tuple(links))
    diagram = NetworkDiagram(controller, 4, ("distance", "bearing"), head_is_end=True)
    picture = diagram.render()
    assert f"{n} hidden neurons and {2 * n} connections are too many" in picture
    assert len(picture) < 20_000
    neurons = diagram.network.neurons(np.array([30.0, -0.7]))
    style = diagram.style(neurons)
    assert len(style) < 3000
    assert all(f".b{key}{{" in style for key in diagram.network.outputs)


def test_senses_are_told_by_name() -> None:
    task = dataclasses.replace(
        GOAL_REACHING,
        inputs=("<far>", "bearing", "light"),
        units=(100.0, 1.0, 2.0),
        relative_units=(),
        sensed_in=("m", "rad", ""),
    )
    said = sensed_line(task, [44.51, -math.pi / 6, 1.5])
    assert "&lt;far&gt; <b>44.5 cm</b> · bearing <b>-30°</b> · light <b>1.50</b>" in said
    # a run whose sensors are relative senses other numbers, and means the same
    relative = GOAL_REACHING.sensing("relative")
    assert "distance <b>22.5 cm</b> · bearing <b>90°</b>" in sensed_line(relative, [0.5, 0.5])
    assert "settles" in sensed_line(task, None)


@given(st.floats(-5.0, 1e4), st.floats(-5.0, 0.0), st.floats(1.0, 60.0))
def test_the_page_holds_the_moment_and_ends_with_the_evaluated_time(
    moment: float, start: float, end: float
) -> None:
    moment = max(moment, start)
    page = servo_plot.page_of(moment, start, end)
    assert page[0] - 1e-6 <= moment <= page[1] + 1e-6
    assert page[0] >= start - 1e-6
    assert page[1] - page[0] == pytest.approx(servo_plot.PAGE)
    assert servo_plot.LEFT <= servo_plot.position(moment, page) <= servo_plot.RIGHT
    if moment <= end and end - start >= servo_plot.PAGE:
        assert page[1] <= end + 1e-6


def test_servos_are_drawn_row_by_row_and_not_while_they_are_off() -> None:
    times = np.arange(-1.0, 5.0, 0.1)
    commanded = np.tile(0.5 + 0.5 * np.sin(times)[:, None], (1, 3))
    commanded[times < -1e-9] = np.nan
    svg = ElementTree.fromstring(
        servo_plot.render(times, commanded, np.full((len(times), 3), 0.2), page=(-3.0, 7.0), head=2)
    )
    told = [p.get("d") for p in svg.iter("path") if p.get("stroke") == servo_plot.COMMANDED]
    done = [p.get("d") for p in svg.iter("path") if p.get("stroke") == servo_plot.REACHED]
    assert len(told) == len(done) == 3
    assert all(d and len(re.findall("[ML]", d)) == 50 for d in told)
    assert all(d and len(re.findall("[ML]", d)) == 60 for d in done)
    assert [e.text for e in svg.iter("text") if any(c.tag == "title" for c in e)] == ["1", "2", "3"]
    assert "nan" not in ElementTree.tostring(svg, "unicode")
    assert len([p for p in svg.iter("path") if p.get("class") == "ta-cursor"]) == 1


@given(st.integers(0, 999_999))
def test_a_click_on_an_ancestor_says_its_number(number: int) -> None:
    name, index = lineage_list.click_name(number).split(":")
    assert lineage_list.clicked_number(name, tuple(map(int, index.split(",")))) == number


def test_what_is_no_click_on_an_ancestor_is_nobody() -> None:
    for name, index in (("cell", (1, 2)), ("ancestor", (1,)), ("ancestor", (1, 1000))):
        assert lineage_list.clicked_number(name, index) is None


def test_a_lineage_says_what_changed_and_what_is_not_known() -> None:
    founder = Ancestor(3, None, 0, "random", 0.44, Morphology(3, (1, 2)))
    child = Ancestor(1207, 3, 5, "both", 0.40, Morphology(3, (1, 2, 5)))
    text = lineage_list.render([child, founder], 3, 0.45, "js()")
    assert 'data-c="ancestor:1,207"' in text
    assert "5.0 cm" in text
    assert "+4.0" in text
    assert "module 3 added · network mutated" in text
    assert "random: 2 modules, stiffness 0.3" in text
    assert text.count('aria-current="true"') == 1
    given = Ancestor(3, None, 0, "given", 0.44, Morphology(3, (1, 2)), "breed-1.tsmr robot 12")
    assert "breed-1.tsmr robot 12: 2 modules" in lineage_list.render([child, given], 3, 0.45, "js()")
    joined = Ancestor(1207, 3, 5, "switch", 0.40, Morphology(3, (1, 2)))
    assert "joined with another network, which acts for targets" in lineage_list.render(
        [joined, founder], 3, 0.45, "js()"
    )
    cut = lineage_list.render([Ancestor(9, 4, 5, "paired", None, Morphology(3, (1, 2)))], 9, 0.45, "js()")
    assert "does not hold its earlier ancestors" in cut
    assert "not recorded" in cut
    assert "failed" in cut


def test_the_legend_says_newtons() -> None:
    assert math.isclose(full_tension(Morphology(10, (1, 2))), 115.2 * 1.6 * 0.02067, rel_tol=1e-6)
    legend = tension_legend.render(full_tension(Morphology(10, (1, 2))))
    assert "3.8 N" in legend
    assert "0.65 N" in legend
    assert "1 cm: 0.02 N" in tension_legend.friction()


@given(st.integers(1, 3000), st.sampled_from((0.02, 0.04)), st.floats(-3.0, 0.0))
def test_a_picture_begins_with_the_frame_at_its_begin_and_is_never_empty(
    n_frames: int, period: float, start: float
) -> None:
    times = start + period * np.arange(1, n_frames + 1)
    page = servo_plot.page_of(times[-1], start, 40.0)
    shown = times[servo_plot.samples(page, start, period, n_frames, step=3)]
    assert len(shown)
    assert shown[0] <= max(page[0], times[0]) + period
    assert shown[-1] <= page[1] + period
