"""Compiled code on disk: found again if it is whole, else compiled anew."""

from __future__ import annotations

import os
import shutil

import pytest

from engine.simulation.kernel.lanes import compiling
from engine.simulation.kernel.lanes.kept import is_kept


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv(compiling.CACHE_VARIABLE, str(tmp_path / "cache"))
    return tmp_path / "cache"


def _double(x):
    return 2 * x


def new_process():
    """What a new process has: nothing compiled as yet."""
    return compiling.entry_point(_double)


def hits(function):
    return sum(function.stats.cache_hits.values())


def test_what_is_compiled_is_kept_and_found_again(cache):
    double = new_process()
    assert not is_kept(lambda: double(2))
    assert double(2) == 4
    assert is_kept(lambda: double(2))
    again = new_process()
    assert again(2) == 4
    assert hits(again) == 1
    assert {path.suffix for path in cache.rglob("*") if path.is_file()} == {".nbi", ".nbc"}


def test_what_is_kept_for_other_arguments_does_not_count(cache):
    new_process()(2.0)
    assert not is_kept(lambda: new_process()(2))
    assert is_kept(lambda: new_process()(3.0))


def test_asking_leaves_nothing_behind(cache):
    double = new_process()
    assert not is_kept(lambda: double(2))
    assert double(2) == 4
    with pytest.raises(ZeroDivisionError):
        is_kept(lambda: 1 / 0)
    assert new_process()(2.0) == 4.0


def truncated(path):
    path.write_bytes(path.read_bytes()[:-1])


def emptied(path):
    path.write_bytes(b"")


def changed(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def removed(path):
    path.unlink()


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("harm", [truncated, emptied, changed, removed])
def test_what_is_damaged_is_compiled_anew_and_kept(cache, suffix, harm):
    new_process()(2)
    (file,) = cache.rglob(f"*{suffix}")
    harm(file)
    if (suffix, harm) != (".nbi", changed):  # a changed index may still name the same code
        assert not is_kept(lambda: new_process()(2))
    assert new_process()(2) == 4
    again = new_process()
    assert is_kept(lambda: again(2))
    assert again(2) == 4


def test_an_older_copy_of_the_same_sources_finds_it_too(cache, tmp_path):
    places = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        places.append(tmp_path / name / "entry.py")
        places[-1].write_text("def triple(x):\n    return 3 * x\n")
    os.utime(places[1], (0, 0))
    functions = []
    for place in places:
        names = {"__name__": "entry"}
        exec(compile(place.read_text(), str(place), "exec"), names)
        functions.append(compiling.entry_point(names["triple"]))
    assert [f(2) for f in functions] == [6, 6]
    assert [hits(f) for f in functions] == [0, 1]


def test_a_folder_that_vanishes_costs_nothing_but_time(cache):
    double = new_process()
    shutil.rmtree(cache)
    assert double(2) == 4
    assert not cache.exists()
