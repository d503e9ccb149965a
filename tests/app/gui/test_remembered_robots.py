from __future__ import annotations

import json

from hypothesis import given
from hypothesis import strategies as st

from app.gui.remembered_robots import parse_memory

MOST = 50


entries = st.lists(st.tuples(st.text(max_size=20), st.integers(0, 10**9 - 1)), max_size=6, unique=True)


@given(entries)
def test_a_tab_remembers_its_robots(kept):
    assert parse_memory(json.dumps(kept), MOST) == (kept, False)
    assert parse_memory("*" + json.dumps(kept), MOST) == (kept, True)


json_values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=9),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
)


@given(st.text(max_size=300) | json_values.map(json.dumps) | st.lists(json_values).map(json.dumps))
def test_whatever_a_browser_claims_to_remember_becomes_names_and_numbers(text):
    for name, number in parse_memory(text, MOST)[0]:
        assert isinstance(name, str)
        assert type(number) is int
        assert number >= 0


almost = st.tuples(
    st.text(max_size=3) | json_values,
    st.integers(-5, 5) | st.sampled_from([10**9 - 1, 10**9, True, False, 1.0, "1", None]),
)


@given(st.lists(almost, max_size=8))
def test_of_what_a_browser_claims_to_remember_only_names_with_whole_numbers_are_kept(claimed):
    sound = [(n, k) for n, k in claimed if isinstance(n, str) and type(k) is int and 0 <= k < 10**9]
    assert parse_memory(json.dumps(claimed), MOST)[0] == list(dict.fromkeys(sound))


def test_a_memory_without_end_is_none():
    assert parse_memory("[" * 50_000, MOST) == ([], False)
    assert parse_memory(json.dumps([["x" * 30_000, 1]]), MOST) == ([], False)
    assert len(parse_memory(json.dumps([["a", k] for k in range(2 * MOST)]), MOST)[0]) == MOST
