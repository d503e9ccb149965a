from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from engine.body.morphology import Morphology
from viz.maps import elite_list
from viz.maps.contents import Content, ShownElite


def elite(number: int, f_s: float, level: int = 3) -> ShownElite:
    return ShownElite(number, f_s, 2, Morphology(level, (1, 2, 5)))


CONTENTS = {
    "morphology": Content((), {(1, 3): elite(7, 2.5), (2, 2): elite(9, 4.0, 8)}),
    "controller": Content((), {(0, 5): elite(7, 2.5), (4, 4): elite(1207, -1.0)}),
}


def test_elites_are_listed_once_each_and_the_best_first() -> None:
    found = elite_list.listed(CONTENTS)
    assert [e.elite.number for e in found] == [9, 7, 1207]
    assert found[1].places == (("morphology", (1, 3)), ("controller", (0, 5)))


def test_what_to_expect_of_elites_comes_before_what_was_recorded() -> None:
    found = elite_list.listed(CONTENTS, {1207: 1.25, 9: -3.0})
    assert [e.elite.number for e in found] == [1207, 9, 7]
    text = elite_list.render(found, 3, "js()")
    assert re.search(r">1\.25 cm<[^>]*>recorded -1\.00<", text)
    assert re.search(r">2\.50 cm</span>", text)


def test_a_search_wants_every_word_and_the_filter_an_f_s() -> None:
    found = elite_list.listed(CONTENTS)

    def numbers(search: str, least: float | None = None) -> list[int]:
        return [e.elite.number for e in elite_list.searched(found, search, least)]

    assert numbers("") == [9, 7, 1207]
    assert numbers("stiffness 0.8") == [9]
    assert numbers("Robot 1207") == numbers("controller 4,4") == [1207]
    assert numbers("3 modules", 0.0) == [9, 7]
    assert numbers("nothing") == []


def test_the_list_says_what_each_is_and_how_many_there_are() -> None:
    found = elite_list.listed(CONTENTS)
    text = elite_list.render(elite_list.searched(found, "", 0.0), 3, "js()")
    assert "2 of 3 elites" in text
    assert "4.00 cm" in text
    assert "morphology 1,3 · controller 0,5" in text
    assert 'data-c="elite:0,9"' in text
    assert '"elite:1,207"' in elite_list.mark(1207)
    assert elite_list.mark(None) == ""


@given(st.integers(0, 999_999))
def test_a_click_says_a_number(number: int) -> None:
    name, index = elite_list.click_name(number).split(":")
    assert elite_list.clicked_number(name, tuple(map(int, index.split(",")))) == number
    assert elite_list.clicked_number("cell", (0, 1)) is None
