"""Bodies as short texts."""

import dataclasses
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.body.feet import FEET
from engine.body.morphology import Morphology, random_morphology
from engine.errors import InvalidData
from engine.storage.layouts.compact import body_of, body_text
from tests.support.made_up import examples


@examples(60)
@given(st.integers(0, 2**32), st.sampled_from(["shared", "per-module"]))
def test_a_body_survives_with_and_without_rhythms(seed, mode):
    body = random_morphology(random.Random(seed), mode, rhythms=True)
    for feet in FEET:
        footed = dataclasses.replace(body, feet=feet)
        plain = dataclasses.replace(footed, rhythms=())
        assert body_of(body_text(footed)) == footed
        assert body_of(body_text(plain)) == plain


def test_the_text_by_hand():
    assert body_text(Morphology(8, (2, 4, 3))) == "8/243"
    assert body_text(Morphology((8, 1, 10), (2, 4, 3))) == "8,1,10/243"
    assert body_text(Morphology(8, (2, 4, 3), (0, 1, 7))) == "8/243/017"
    assert body_text(Morphology(8, (2, 4, 3), (0, 1, 7), "end")) == "8/243/017/end"
    assert body_text(Morphology(8, (2, 4, 3), (), "start")) == "8/243//start"


@pytest.mark.parametrize(
    "text",
    [
        *("8/24/0", "8/24/089", "8/24/08", "8/24/00/00", "8", "8/24/", "8/24/x0", "/24"),
        *("8/24//", "8/24//none", "8/24/end", "8/24//up", "8/24/00/end/", "8/24/ 00"),
    ],
)
def test_broken_texts_are_refused(text):
    with pytest.raises(InvalidData):
        body_of(text)
