"""Slimmed runs show what the whole run shows."""

import shutil

import pytest

import engine.runs.evolve
from engine.analysis.comparison import compare_runs
from engine.analysis.elite_table import elite_table
from engine.config import replaced
from engine.errors import RunFileError
from engine.search.vie_neat import VieNeatConfig
from engine.storage.check import check_run
from engine.storage.migration import migrate, slim
from engine.storage.reader import RunReader
from engine.storage.recovery import recover
from tests.support.made_up import MADE_UP, MadeUpEvaluator
from tests.support.run_formats import change, in_format
from viz.maps.coloring import by_visits
from viz.maps.contents import load_contents

SMALL = replaced(MADE_UP, evaluations=62, refit_generations=(0, 2))
KINDS = {
    "DM-ME": {},
    "deep grid": {"cell_capacity": 5},
    "per module": {"stiffness": "per-module", "algorithm": "map-elites"},
    "ViE-NEAT": {
        "algorithm": "vie-neat",
        "vie_neat": VieNeatConfig(morphologies=8, mutants=8, controllers=10, elitism=1),
    },
}


@pytest.fixture(autouse=True)
def _no_physics(monkeypatch):
    monkeypatch.setattr(engine.runs.evolve, "create_evaluator", lambda *_: MadeUpEvaluator())


def whole_run(path, **changes):
    engine.runs.evolve.evolve(path, replaced(SMALL, **changes))
    return path


def screens(path):
    """Return whatever the app and the commands show of a run."""
    with RunReader(path) as reader:
        generations = reader.generations()
        shown = {
            "generations": generations,
            "counts": (reader.n_evaluations(), reader.last_generation(), reader.computers()),
            "facts": (reader.config, reader.versions, reader.created_at),
            "table": elite_table(reader),
            "hash": reader.canonical_hash(),
        }
        robots = set()
        for g in generations:
            contents = load_contents(reader, g)
            visits = by_visits(reader, g.number)
            shown[f"maps {g.number}"] = {
                name: (
                    content.axes,
                    content.elites,
                    visits.values(content.axes, content.elites),
                    reader.placements(name, g.number),
                )
                for name, content in contents.items()
            }
            for name in g.archives:
                robots |= set(reader.placements(name, g.number).values())
                shown[f"elites {name} {g.number}"] = repr(reader.contents(name, g.number))
        for name in generations[-1].archives:
            members = reader.members(name)
            shown[f"members {name}"] = members
            robots |= {n for held in members.values() for n in held}
        for number in sorted(robots):
            line = reader.lineage(number)
            shown[f"robot {number}"] = [
                (a, repr(reader.evaluation(a.number)), reader.generation_of(a.number)) for a in line
            ]
    comparison = compare_runs([path])
    shown["comparison"] = repr(comparison).replace(str(path), "")
    return shown


@pytest.mark.parametrize("kind", KINDS)
def test_a_slimmed_run_shows_the_same_screens(tmp_path, kind):
    path, out = whole_run(tmp_path / "whole" / "run.tsmr", **KINDS[kind]), tmp_path / "run.tsmr"
    before = path.read_bytes()
    slimmed = slim(path, out)
    assert path.read_bytes() == before
    with RunReader(out) as reader:
        assert reader.slimmed == slimmed
        assert len(reader.numbers()) == slimmed.n_kept < 62
    expected, found = screens(path), screens(out)
    assert found.keys() == expected.keys()
    for what in expected:
        assert found[what] == expected[what], what
    assert not [f for f in check_run(out) if f.verdict == "problem"]
    assert out.stat().st_size < path.stat().st_size


def test_a_slimmed_run_says_so_wherever_more_is_asked_of_it(tmp_path):
    path, out = whole_run(tmp_path / "whole.tsmr"), tmp_path / "slim.tsmr"
    kept = slim(path, out).n_kept
    with RunReader(out) as reader:
        gone = min(set(range(62)) - set(reader.numbers()))
        with pytest.raises(RunFileError, match=rf"is slimmed and does not hold robot {gone}, only its fig"):
            reader.evaluation(gone)
        with pytest.raises(RunFileError, match=rf"is slimmed: it holds {kept} of 62 robots"):
            reader.all_evaluations()
        with pytest.raises(RunFileError, match="has no evaluation 62"):
            reader.lineage(62)
        assert reader.lineage(gone)[0].number == gone
    for use, said in (
        (engine.runs.evolve.resume, "is slimmed and cannot be resumed"),
        (lambda p: slim(p, tmp_path / "again.tsmr"), "is slimmed already"),
        (lambda p: recover(p, tmp_path / "again.tsmr"), "is slimmed; recover the run"),
        (lambda p: migrate(p, tmp_path / "again.tsmr"), "has the present format"),
    ):
        with pytest.raises(RunFileError, match=said) as e:
            use(out)
        assert "\n" not in str(e.value)
    assert any("can be viewed, not resumed" in f.remedy for f in check_run(out))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["slim.tsmr", "whole.tsmr"]


def test_older_formats_and_unfinished_runs_can_be_slimmed(tmp_path):
    path = tmp_path / "run.tsmr"

    def interrupt(progress):
        if progress.n_evaluations >= 40:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        engine.runs.evolve.evolve(path, SMALL, observer=interrupt)
    for version in (1, 2):
        old, out = in_format(path, tmp_path / f"{version}.tsmr", version), tmp_path / f"slim-{version}.tsmr"
        slim(old, out)
        with RunReader(path) as whole, RunReader(out) as small:
            assert small.n_evaluations() == whole.n_evaluations()
            assert small.generations() == whole.generations()
        with pytest.raises(RunFileError, match="cannot be resumed"):
            engine.runs.evolve.resume(out)


def test_a_run_that_is_being_written_and_a_taken_name_are_refused(tmp_path):
    path = whole_run(tmp_path / "run.tsmr")
    with pytest.raises(RunFileError, match="exists; choose another name"):
        slim(path, path)
    with engine.runs.evolve.RunWriter.open(path), pytest.raises(RunFileError, match="is being written"):
        slim(path, tmp_path / "slim.tsmr")
    broken = shutil.copy(path, tmp_path / "broken.tsmr")
    change(broken, "DELETE FROM details WHERE number = 3", sealed=False)
    with pytest.raises(RunFileError, match="tensatlas recover"):
        slim(broken, tmp_path / "slim.tsmr")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["broken.tsmr", "run.tsmr"]
