from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.runs.run_names import find_run, run_name
from app.session.address import Address
from engine.replay.trial import Aim, TrialChoice

PATHS = [Path("/a/one.tsmr"), Path("/a/two.tsmr"), Path("/b/two.tsmr"), Path("/b/my run.v2.tsmr")]
number = st.none() | st.integers(0, 10**9 - 1)
places = st.builds(
    Address,
    run=st.none() | st.text(min_size=1, max_size=60).filter(lambda t: t.isprintable()),
    archive=st.none() | st.sampled_from(["morphology", "controller", "grid"]),
    cell=st.none() | st.lists(st.integers(0, 999), min_size=1, max_size=6).map(tuple),
    robot=number,
    generation=number,
    trial=st.builds(
        TrialChoice,
        target=st.integers(0, 9),
        repeat=st.integers(0, 9),
        fresh=st.integers(0, 99),
        aim=st.none() | st.builds(Aim, st.integers(-180, 180), st.integers(5, 300)),
    ),
)


@given(places)
def test_an_address_brings_back_the_place_that_it_was_made_of(place: Address) -> None:
    assert Address.parse(place.query()) == place


def test_what_people_write_is_read() -> None:
    place = Address.parse("?run=saved/a%20b&archive=morphology&cell=3,7&target=2&seed=1&utm=x")
    assert place == Address(run="saved/a b", archive="morphology", cell=(3, 7), trial=TrialChoice(target=1))
    assert Address.parse("?run=a&aim=-30,62") == Address(run="a", trial=TrialChoice(aim=Aim(-30, 62)))
    assert place.query() == "?run=saved/a+b&archive=morphology&cell=3,7&target=2"
    assert Address().query() == ""


@given(st.text(max_size=200) | st.text("0123456789,-.", min_size=1, max_size=12))
def test_anything_else_is_left_out(text: str) -> None:
    for key in ("cell", "robot", "generation", "target", "seed", "aim", "archive"):
        place = Address.parse(f"?{key}={text}")
        assert place.run is None
        assert place.cell is None or (len(place.cell) <= 6 and all(0 <= i < 1000 for i in place.cell))
        assert all(n is None or 0 <= n < 10**9 for n in (place.robot, place.generation))
        assert place.trial.target >= 0
    Address.parse(text)


@pytest.mark.parametrize(
    "text", ["cell=-1,2", "cell=1,,2", "cell=1e3", "robot=-1", "target=0", "aim=9", "aim=0,4", "archive=../x"]
)
def test_impossible_values_are_left_out(text: str) -> None:
    assert Address.parse(text) == Address()


def test_a_run_is_found_by_its_name_in_the_list_and_never_by_a_path() -> None:
    for path in PATHS:
        name = run_name(path, PATHS)
        assert name is not None
        assert find_run(name, PATHS) == path
        assert find_run(f"{name}.tsmr", PATHS) == path
    assert find_run("two", PATHS) == PATHS[1]
    assert find_run("c/one", PATHS) == PATHS[0]  # its folder was needed when the address was written
    for name in ("none", "", "/", "../one/..", "a", "/etc/passwd"):
        assert find_run(name, PATHS) is None
