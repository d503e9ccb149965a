from __future__ import annotations

import random
import shutil
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.body.morphology import Morphology, body_changes, mutate_morphology
from engine.errors import RunFileError
from engine.storage.reader import RunReader
from tests.support.made_up import examples, morphologies, per_module_morphologies
from tests.support.run_formats import change


def test_a_lineage_leads_from_child_to_parent_to_a_random_robot(small_reader: RunReader) -> None:
    longest = 0
    for number in range(small_reader.n_evaluations()):
        line = small_reader.lineage(number)
        assert line[0].number == number
        assert [a.parent for a in line[:-1]] == [a.number for a in line[1:]]
        assert line[-1].is_founder
        assert line[-1].operator == "random"
        for a in line:
            e = small_reader.evaluation(a.number)
            assert (a.parent, a.fitness, a.morphology) == (
                e.solution.parent,
                e.fitness,
                e.solution.morphology,
            )
            assert a.generation == small_reader.generation_of(a.number)
        longest = max(longest, len(line))
    assert longest > 1


def test_nobody_has_no_lineage(small_reader: RunReader) -> None:
    with pytest.raises(RunFileError, match="no evaluation 999"):
        small_reader.lineage(999)


def test_a_line_without_end_is_cut(small_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("engine.storage.reader.MAX_LINE", 5)
    path = Path(shutil.copy(small_run, tmp_path / "long.tsmr"))
    change(path, "UPDATE evaluations SET parent = number - 1 WHERE number > 0")
    with RunReader(path) as reader:
        assert [a.number for a in reader.lineage(12)] == [12, 11, 10, 9, 8]
        assert [a.number for a in reader.lineage(2)] == [2, 1, 0]


@pytest.mark.parametrize("parent", [17, 12, "12", 2.5, 10**18, b"x"])
def test_a_file_that_lies_about_parents_does_not_lead_in_circles(
    small_run: Path, tmp_path: Path, parent: object
) -> None:
    path = tmp_path / "lies.tsmr"
    shutil.copy(small_run, path)
    change(path, ("UPDATE evaluations SET parent = ? WHERE number = 12", (parent,)))
    with RunReader(path) as reader:
        if isinstance(parent, bytes | float):  # no whole number
            with pytest.raises(RunFileError, match="damaged"):
                reader.lineage(12)
        else:
            line = reader.lineage(12)
            assert [a.number for a in line] == [12]
            assert not line[-1].is_founder


@examples(150)
@given(st.one_of(morphologies, per_module_morphologies()), st.integers(0, 2**32))
def test_changes_are_named_exactly_if_there_are_any(parent: Morphology, seed: int) -> None:
    child = mutate_morphology(parent, random.Random(seed))
    assert bool(body_changes(parent, child)) == (parent != child)
    assert body_changes(parent, parent) == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (Morphology(3, (1, 2, 3)), Morphology(3, (1, 7, 2, 3)), ["module 2 added"]),
        (Morphology(3, (1, 2, 3)), Morphology(3, (2, 5)), ["module 1 removed", "face of 2"]),
        (Morphology(3, (1, 2, 3)), Morphology(4, (1, 8, 4)), ["faces of 2, 3", "stiffness 0.3 → 0.4"]),
        (Morphology(3, (1, 2)), Morphology(3, (4, 1, 6)), ["module 1 added", "face of 3"]),
    ],
)
def test_changes_in_words(old: Morphology, new: Morphology, said: list[str]) -> None:
    assert body_changes(old, new) == said
