"""The children of chosen robots: who is shown where, and what is said of them."""

from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from engine.body.morphology import Morphology
from engine.storage.layouts.tables import Record
from viz.robot import breeding_strip
from viz.robot.breeding_strip import render_children, tiles_of

BODY, LONGER = Morphology(3, (1, 2)), Morphology(3, (1, 2, 5))


def record(
    number: int,
    fitness: float | None,
    parent: int | None = None,
    operator: str = "both",
    body: Morphology = BODY,
    source: str | None = None,
) -> Record:
    failure = None if fitness is not None else "it broke"
    return Record(number, 0, body, parent, operator, source, fitness, True, failure)


RECORDS = [
    record(0, 0.44, None, "given", source="other<b>.tsmr robot 7"),
    record(1, 0.40, 0, "both", LONGER),
    record(2, None, 0, "controller"),
    record(3, 0.45, 1, "controller", LONGER),
    record(1204, 0.38, 3, "controller", LONGER),
]


def html_of(**changes: object) -> str:
    parents, born = tiles_of(RECORDS, 0.45)
    choices: dict[str, object] = {
        "kept": (),
        "dropped": (),
        "shown": None,
        "heading": "breed-1",
        "handler": "js()",
    }
    return render_children(parents, born, **{**choices, **changes})  # type: ignore[arg-type]


def test_children_stand_with_the_best_first_and_a_gain_over_their_parents() -> None:
    parents, born = tiles_of(RECORDS, 0.45)
    assert [t.number for t in parents] == [0]
    assert [t.number for t in born] == [1204, 1, 3, 2]
    assert [None if t.gain is None else round(t.gain, 6) for t in born] == [7.0, 4.0, -5.0, None]
    assert born[1].about == "from robot 0, module 3 added · network mutated"
    assert [t.head for t in born] == [2, 2, 2, 1]
    text = html_of(shown=1, kept={3}, dropped={2})
    assert re.findall(r'data-number="(\d+)" data-shown="(\d)" data-kept="(\d)"', text) == [
        ("1204", "0", "0"),
        ("1", "1", "0"),
        ("3", "0", "1"),
        ("0", "0", "0"),
    ]
    assert "+7.0 cm" in text
    assert "+4.0 to parent" in text
    assert "-5.0 to parent" in text
    assert "other&lt;b&gt;.tsmr robot 7" in text
    assert "failed" in html_of()


def test_only_the_best_are_shown() -> None:
    born = tiles_of([record(k, 0.001 * k, 0) for k in range(1, 60)], 0.45)[1]
    text = render_children([], born, kept=(), dropped={1}, shown=None, heading="x", handler="js()")
    shown = [int(n) for n in re.findall(r'data-number="(\d+)"', text)]
    assert shown == list(range(2, 2 + breeding_strip.MOST))
    assert f"and {58 - breeding_strip.MOST} more" in text


@given(st.integers(0, 999_999))
def test_a_click_names_its_robot(number: int) -> None:
    parents, born = tiles_of([record(number, 0.4, None, "both")], 0.45)
    text = render_children(parents, born, kept=(), dropped=(), shown=None, heading="x", handler="js()")
    for what in ("replay", "keep", "drop"):
        found = re.search(rf'data-c="{what}:(\d+),(\d+)"', text)
        assert found is not None
        assert breeding_strip.clicked_number((int(found[1]), int(found[2]))) == number


def test_what_names_no_robot_is_nobody() -> None:
    assert breeding_strip.clicked_number((3,)) is None
    assert breeding_strip.clicked_number((1, 1000)) is None


def test_parents_can_be_taken_out() -> None:
    assert "Breed from the robot that you see" in breeding_strip.render_parents([], "js()")
    text = breeding_strip.render_parents([("a <b>", BODY, 0), ("c 7", LONGER, 2)], "js()")
    assert re.findall(r'data-c="(unmark:\d)"', text) == ["unmark:0", "unmark:1"]
    assert "<b>" not in text
