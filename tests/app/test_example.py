"""What an installation without a checkout has: one run, and all files that the packages read."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

import tensatlas
from app.runs import library
from app.runs.library import EXAMPLE, NEW_RUNS, PROJECT_ARCHIVES, Library
from engine.storage.check import check_run
from engine.storage.reader import RunReader

MOST_BYTES = 4_000_000


def test_the_example_is_small_and_every_elite_is_there() -> None:
    assert EXAMPLE.stat().st_size <= MOST_BYTES
    assert not [f for f in check_run(EXAMPLE) if f.verdict == "problem"]
    with RunReader(EXAMPLE) as reader:
        assert reader.slimmed is not None
        last = reader.finished_generation()
        elites = {n for cells in reader.elites(last).values() for n, _ in cells.values()}
        assert len(elites) > 50
        assert set(reader.evaluations(elites)) == elites


def test_the_example_is_a_copy_of_a_shipped_run() -> None:
    with RunReader(EXAMPLE) as reader:
        assert reader.slimmed is not None
        wanted = reader.slimmed.hash
    for path in sorted(PROJECT_ARCHIVES.glob("*.tsmr")):
        with RunReader(path) as reader:
            if reader.canonical_hash() == wanted:
                return
    pytest.fail("make it anew, as saved_archives/README.md says")


def test_what_is_shown_where_nothing_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small_run: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    assert library.default_places() == (PROJECT_ARCHIVES, NEW_RUNS)
    monkeypatch.setattr(library, "PROJECT_ARCHIVES", tmp_path / "installed" / "saved_archives")
    shown = Library()
    try:
        assert shown.runs() == [EXAMPLE]
        assert shown.facts(EXAMPLE).problem is None
    finally:
        shown.close()
    (tmp_path / "saved_archives").mkdir()
    mine = tmp_path / "saved_archives" / "mine.tsmr"
    mine.write_bytes(small_run.read_bytes())
    shown = Library()
    try:
        assert shown.runs() == [mine]
    finally:
        shown.close()


def test_what_the_packages_read_is_installed_with_them() -> None:
    root = Path(tensatlas.ROOT)
    data = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]
    installed = {p for package, globs in data.items() for g in globs for p in (root / package).glob(g)}
    files = {p for package in tensatlas.PACKAGES for p in (root / package).rglob("*") if p.is_file()}
    ours = {
        p for p in files if p.suffix not in (".py", ".pyc") and not p.name.startswith((".", "example.tsmr-"))
    }
    assert ours - installed == set()
    assert {EXAMPLE, root / "app" / "constraints.txt"} <= ours
