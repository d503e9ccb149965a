"""The genes by which modules pulse while the head is searched."""

import dataclasses
import json
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.body import servo
from engine.body.morphology import (
    BodyRates,
    Morphology,
    body_changes,
    mutate_morphology,
    random_morphology,
    with_face,
    with_modules,
    with_stiffness,
)
from engine.errors import InvalidData
from tests.support.made_up import examples

seeds = st.integers(0, 2**32)
modes = st.sampled_from(["shared", "per-module"])


def drawn(seed, mode="shared"):
    return random_morphology(random.Random(seed), mode, rhythms=True)


def test_without_rhythms_all_modules_pulse_at_half_a_hertz():
    assert Morphology(5, (1, 2, 3)).open_loop == (4, 4, 4)
    assert (servo.FREQUENCIES[4 // 4], servo.PHASES[4 % 4]) == (0.5, 0.0)
    assert Morphology(5, (1, 2), (7, 0)).open_loop == (7, 0)


@examples(60)
@given(seeds, modes)
def test_files_keep_them(seed, mode):
    body = drawn(seed, mode)
    assert len(body.rhythms) == body.n_modules
    assert Morphology.from_json(json.loads(json.dumps(body.to_json()))) == body
    plain = dataclasses.replace(body, rhythms=())
    assert "rhythms" not in plain.to_json()
    assert Morphology.from_json(plain.to_json()) == plain


@pytest.mark.parametrize("rhythms", [(1,), (1, 2, 3), (1, 8), (-1, 0), (1.0, 2.0), [1, 2]])
def test_other_rhythms_are_refused(rhythms):
    with pytest.raises(InvalidData, match="rhythm"):
        Morphology(5, (1, 2), rhythms)


@examples(100)
@given(seeds, modes)
def test_every_module_keeps_one_through_mutations(seed, mode):
    rng, body = random.Random(seed), drawn(seed, mode)
    for _ in range(10):
        body = mutate_morphology(body, rng)
        assert len(body.rhythms) == body.n_modules


def test_modules_take_their_rhythms_along():
    body = Morphology(5, (1, 2, 3, 4), (0, 1, 2, 3))
    rng = random.Random(1)
    only = BodyRates(body_rate=1.0, face_rate=0.0)
    fewer = [c for c in (mutate_morphology(body, rng, only) for _ in range(300)) if c.n_modules == 3]
    assert {tuple(zip(c.faces, c.rhythms, strict=True)) for c in fewer} == {
        tuple((f, f - 1) for f in (1, 2, 3, 4) if f != gone) for gone in (1, 2, 3, 4)
    }
    more = [c for c in (mutate_morphology(body, rng, only) for _ in range(300)) if c.n_modules == 5]
    assert len({c.rhythms for c in more}) > 20
    for c in more:
        pairs = list(zip(c.faces, c.rhythms, strict=True))
        assert any(pairs[:i] + pairs[i + 1 :] == [(f, f - 1) for f in (1, 2, 3, 4)] for i in range(5))


@pytest.mark.parametrize(
    ("level", "rate"), [(5, {"face_rate": 0.3}), ((5,) * 6, {"module_rate": 0.2})], ids=["shared", "own"]
)
def test_rhythms_are_redrawn_as_often_as_faces_and_never_with_them(level, rate):
    rng = random.Random(2)
    parent = Morphology(level, (3,) * 6, (5,) * 6)
    children = [mutate_morphology(parent, rng, BodyRates(**rate)) for _ in range(8000)]
    same = [c for c in children if c.n_modules == 6]
    (share,) = rate.values()
    # an eighth of the redraws gives the same again
    rhythms = [r != 5 for c in same for r in c.rhythms]
    assert sum(rhythms) / len(rhythms) == pytest.approx(share * 7 / 8, abs=0.01)
    both = [f != 3 and r != 5 for c in same for f, r in zip(c.faces, c.rhythms, strict=True)]
    assert not any(both)


def test_editing_a_body_keeps_them():
    body = Morphology(5, (1, 2), (6, 7))
    assert with_modules(body, 4).rhythms == (6, 7, 7, 7)
    assert with_modules(Morphology(5, (1, 2, 3), (4, 6, 7)), 2).rhythms == (4, 6)
    assert with_face(body, 0, 8).rhythms == with_stiffness(body, 9).rhythms == (6, 7)
    assert body_changes(body, dataclasses.replace(body, rhythms=(6, 5))) == ["rhythms"]


def test_bodies_without_rhythms_are_drawn_as_before():
    for mode in ("shared", "per-module"):
        plain = random_morphology(random.Random(3), mode)
        assert (
            dataclasses.replace(random_morphology(random.Random(3), mode, rhythms=True), rhythms=()) == plain
        )
