"""The gene of feet that grip one way."""

import dataclasses
import json
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.body.feet import FEET, BodyConfig, feet_note
from engine.body.morphology import (
    BodyRates,
    Morphology,
    body_changes,
    mutate_morphology,
    random_morphology,
    with_face,
    with_feet,
    with_modules,
    with_stiffness,
)
from engine.errors import InvalidData
from tests.support.made_up import examples

modes = st.sampled_from(["shared", "per-module"])


def test_which_feet_a_run_allows():
    assert BodyConfig().feet_genes == ("none",)
    assert BodyConfig(feet="directional").feet_genes == ("end",)
    assert BodyConfig(feet="directional", feet_toward="start").feet_genes == ("start",)
    assert BodyConfig(feet="evolved").feet_genes == FEET


@pytest.mark.parametrize("feet", FEET)
def test_files_keep_them(feet):
    body = Morphology(5, (1, 2), (), feet)
    assert Morphology.from_json(json.loads(json.dumps(body.to_json()))) == body
    assert ("feet" in body.to_json()) == (feet != "none")


def test_bodies_of_before_have_none():
    assert Morphology.from_json({"stiffness_level": 5, "faces": [1, 2]}).feet == "none"


@pytest.mark.parametrize("feet", ["", "END", "sideways", None, 1, ["end"]])
def test_other_feet_are_refused(feet):
    with pytest.raises(InvalidData, match="feet must be one of none, start, end, not"):
        Morphology.from_json({"stiffness_level": 5, "faces": [1, 2], "feet": feet})


@examples(60)
@given(st.integers(0, 2**32), modes, st.booleans())
def test_where_there_is_no_choice_nothing_is_drawn(seed, mode, rhythms):
    """So robots of runs without feet are those of before."""
    for feet in FEET:
        one, other = random.Random(seed), random.Random(seed)
        body = random_morphology(one, mode, rhythms=rhythms, feet=(feet,))
        plain = random_morphology(other, mode, rhythms=rhythms)
        assert body == dataclasses.replace(plain, feet=feet)
        for _ in range(5):
            body, plain = mutate_morphology(body, one, feet=(feet,)), mutate_morphology(plain, other)
            assert body == dataclasses.replace(plain, feet=feet)
        assert one.getstate() == other.getstate()


@pytest.mark.parametrize("mode", ["shared", "per-module"])
def test_evolved_feet_are_drawn_evenly_and_mutate_at_their_rate(mode):
    rng, n = random.Random(1), 9000
    drawn = [random_morphology(rng, mode, feet=FEET).feet for _ in range(n)]
    for feet in FEET:
        assert abs(drawn.count(feet) - n / 3) < 5 * (n * 2 / 9) ** 0.5
    parent = random_morphology(random.Random(2), mode, feet=("start",))
    rates = BodyRates(feet_rate=0.3)
    children = [mutate_morphology(parent, rng, rates, FEET).feet for _ in range(n)]
    for feet in ("none", "end"):
        assert abs(children.count(feet) - 0.1 * n) < 5 * (0.09 * n) ** 0.5


@pytest.mark.parametrize("rate", [-0.1, 1.1, float("nan")])
def test_an_impossible_rate_is_refused(rate):
    with pytest.raises(InvalidData, match="feet_rate must be from 0 to 1"):
        BodyRates(feet_rate=rate)


@examples(40)
@given(st.integers(0, 2**32), modes)
def test_other_changes_keep_them(seed, mode):
    body = random_morphology(random.Random(seed), mode, feet=("end",))
    for changed in (with_modules(body, 2), with_modules(body, 10), with_face(body, 0, 8)):
        assert changed.feet == "end"
    assert with_stiffness(body, 3).feet == "end"


def test_feet_can_be_changed_by_hand():
    body = Morphology(5, (1, 2), (1, 2))
    assert with_feet(body, "start") == Morphology(5, (1, 2), (1, 2), "start")
    assert [feet_note(f) for f in FEET] == ["", ", feet toward the start", ", feet toward the end"]


def test_a_change_of_feet_is_told():
    body = Morphology(5, (1, 2, 3))
    assert body_changes(body, dataclasses.replace(body, feet="end")) == ["feet none → toward the end"]
    turned = Morphology(5, (1, 2, 3, 4, 5), (), "start")
    assert body_changes(body, turned)[-1] == "feet none → toward the start"
    assert body_changes(turned, turned) == []
