import contextlib
import dataclasses
import random
import shutil
import sqlite3

import pytest

import engine.runs.evolve
from engine.config import replaced
from engine.errors import RunFileError
from engine.search.vie_neat import VieNeatConfig
from engine.storage.check import check_run
from engine.storage.migration import migrate
from engine.storage.reader import RunReader
from engine.storage.recovery import recover
from engine.storage.salvage import salvage
from engine.storage.schema import FORMAT_VERSION
from engine.tasks import fitness
from tests.support.made_up import MADE_UP, MadeUpEvaluator
from tests.support.run_formats import change, in_format
from tests.support.run_hash import hash_of

SMALL = replaced(MADE_UP, evaluations=38, refit_generations=(0, 2))


@pytest.fixture(scope="module", autouse=True)
def _no_physics():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine.runs.evolve, "create_evaluator", lambda *_: MadeUpEvaluator())
        yield


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished run of four generations; not to be changed."""
    path = tmp_path_factory.mktemp("whole") / "whole.tsmr"
    engine.runs.evolve.evolve(path, SMALL)
    return path


class Measured(MadeUpEvaluator):
    def evaluate(self, solutions):
        for group in super().evaluate(solutions):
            yield [
                e if e.fitness is None else dataclasses.replace(e, fitness=fitness(e.distances))
                for e in group
            ]


def problems(path):
    return [f.text for f in check_run(path) if f.verdict == "problem"]


def origins(path):
    with RunReader(path) as reader:
        return sorted(reader.origins(set(range(reader.n_evaluations()))).items())


def finish(path):
    engine.runs.evolve.resume(path)
    return hash_of(path)


# ---- pages


def test_every_row_of_a_whole_file_is_found(whole):
    found = salvage(whole)
    assert (found.n_missing, found.n_broken) == (0, 0)
    db = sqlite3.connect(whole)
    for table, n_columns, has_rowid in (
        ("totals", 7, True),
        ("evaluations", 12, True),
        ("details", 6, True),
        ("generations", 8, True),
        ("state", 4, True),
        ("computers", 4, True),
        ("placements", 4, False),
        ("meta", 2, False),
    ):
        rows = [r for r in found.rows if len(r.values) == n_columns and (r.rowid is not None) == has_rowid]
        if table in ("state", "computers"):  # both have as many columns
            rows = [r for r in rows if isinstance(r.values[1], str) == (table == "computers")]
        if table == "meta":  # the index of another table has as many
            rows = [r for r in rows if isinstance(r.values[1], str)]
        wanted = db.execute(f"SELECT * FROM {table}").fetchall()
        got = [(r.rowid, *r.values[1:]) for r in rows] if has_rowid else [r.values for r in rows]
        assert sorted(got, key=repr) == sorted(wanted, key=repr)
    db.close()


def test_what_the_log_holds_is_found_too(tmp_path):
    path, copy = tmp_path / "run.tsmr", tmp_path / "copy.tsmr"

    def keep(progress):
        if progress.n_evaluations >= 20 and not copy.exists():
            for suffix in ("", "-wal"):
                shutil.copy(f"{path}{suffix}", f"{copy}{suffix}")

    engine.runs.evolve.evolve(path, SMALL, observer=keep)
    log = copy.with_name("copy.tsmr-wal")
    assert log.stat().st_size > 50_000
    out = tmp_path / "new.tsmr"
    assert recover(copy, out).n_evaluations == 20
    assert finish(out) == hash_of(path)
    # a log that is torn is good up to there
    content = log.read_bytes()
    log.write_bytes(content[: len(content) * 2 // 3])
    torn = recover(copy, tmp_path / "torn.tsmr").n_evaluations
    assert 0 < torn < 20
    assert finish(tmp_path / "torn.tsmr") == hash_of(path)


# ---- saving


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"algorithm": "map-elites"},
        {"cell_capacity": 5},
        {"stiffness": "per-module"},
        {
            "algorithm": "vie-neat",
            "vie_neat": VieNeatConfig(morphologies=8, mutants=8, controllers=10, elitism=1),
        },
    ],
    ids=str,
)
def test_a_whole_run_is_saved_wholly(tmp_path, changes):
    path, out = tmp_path / "run.tsmr", tmp_path / "new.tsmr"
    engine.runs.evolve.evolve(path, replaced(SMALL, **changes))
    before = path.read_bytes()
    found = recover(path, out)
    assert path.read_bytes() == before
    assert hash_of(out) == hash_of(path)
    assert (found.n_evaluations, found.n_after, found.damaged, found.missing) == (38, 0, [], [])
    assert found.n_generations == found.n_recorded > 1
    assert found.resumable
    with RunReader(path) as old, RunReader(out) as new:
        assert (old.created_at, old.versions) == (new.created_at, new.versions)
        assert [g.seconds for g in old.generations()] == [g.seconds for g in new.generations()]
    assert origins(out) == origins(path)
    assert len(origins(path)) == 38


def test_a_file_cut_at_any_page_is_refused_and_what_is_there_is_saved(whole, tmp_path):
    content = whole.read_bytes()
    cut, out = tmp_path / "cut.tsmr", tmp_path / "new.tsmr"
    wanted, saved = hash_of(whole), []
    pages = range(4096, len(content), 4096)
    for n in pages:
        cut.write_bytes(content[:n])
        with pytest.raises(RunFileError, match=r"cut short: \d+ of \d+ bytes; save .*tensatlas recover"):
            RunReader(cut)
        if (n // 4096) % 4 and n < len(content) - 8192:
            continue
        try:
            found = recover(cut, out)
        except RunFileError as e:
            assert "whole evaluation left" in str(e) or "lost its configuration" in str(e)  # noqa: PT017
            assert not out.exists()
            continue
        saved.append(found.n_evaluations)
        assert found.resumable
        assert not problems(out)
        if len(saved) % 4 == 0:
            assert finish(out) == wanted
        out.unlink()
    assert saved == sorted(saved)
    assert saved[-1] >= 36
    assert len(saved) > len(pages) / 8


def test_overwritten_pages_cost_only_what_was_on_them(whole, tmp_path):
    content = whole.read_bytes()
    broken, out = tmp_path / "broken.tsmr", tmp_path / "new.tsmr"
    n_pages, wanted, rng = len(content) // 4096, hash_of(whole), random.Random(3)
    n_saved = 0
    for _ in range(6):
        data = bytearray(content)
        for page in rng.sample(range(3, n_pages), 2):
            data[4096 * page : 4096 * page + 4096] = rng.randbytes(4096)
        broken.write_bytes(data)
        found = recover(broken, out)
        n_saved += found.n_evaluations
        assert not problems(out)
        assert finish(out) == wanted
        out.unlink()
    assert n_saved > 6 * 30


def test_evaluations_after_a_gap_are_used_when_the_run_comes_there(whole, tmp_path):
    path, out = shutil.copy(whole, tmp_path / "gap.tsmr"), tmp_path / "new.tsmr"
    change(path, "DELETE FROM evaluations WHERE number IN (3, 27)")
    assert any("evaluations were counted" in p for p in problems(path))
    found = recover(path, out)
    assert (found.n_generations, found.n_recorded, found.n_evaluations) == (0, 4, 36)
    assert found.missing == [3, 27]
    assert "18 evaluations wait" not in str(problems(out))
    computed = []

    class Counting(MadeUpEvaluator):
        def evaluate(self, solutions):
            computed.extend(s.number for s in solutions)
            return super().evaluate(solutions)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine.runs.evolve, "create_evaluator", lambda *_: Counting())
        engine.runs.evolve.resume(out)
    assert computed == [3, 27]
    assert hash_of(out) == hash_of(whole)


def test_robots_whose_controller_is_stored_over_a_lost_one_are_not_lost(whole, tmp_path):
    path, out = shutil.copy(whole, tmp_path / "gap.tsmr"), tmp_path / "new.tsmr"
    with contextlib.closing(sqlite3.connect(path)) as db:
        (base, n) = db.execute(
            "SELECT base, COUNT(*) FROM details WHERE base IS NOT NULL GROUP BY base ORDER BY 2 DESC LIMIT 1"
        ).fetchone()
    assert n > 1
    change(path, *(f"DELETE FROM {table} WHERE number = {base}" for table in ("evaluations", "details")))
    found = recover(path, out)
    # the search asks for the lost one again, so its controller is known
    assert (found.n_evaluations, found.missing, found.damaged) == (37, [base], [])
    assert finish(out) == hash_of(whole)


def test_a_flipped_digit_is_noticed_named_and_computed_again(whole, tmp_path):
    path, out = shutil.copy(whole, tmp_path / "flipped.tsmr"), tmp_path / "new.tsmr"
    sql = "UPDATE evaluations SET fitness = fitness + 1e-9 WHERE number = 24 AND fitness NOT NULL"
    change(path, sql, sealed=False)
    (problem,) = problems(path)
    assert "1 evaluations differ from what was written: 24" in problem
    found = recover(path, out)
    assert found.damaged == [24]
    assert (found.n_generations, found.n_evaluations) == (1, 37)
    assert finish(out) == hash_of(whole)


def test_a_run_that_lost_its_configuration_borrows_one(whole, tmp_path):
    path, out = shutil.copy(whole, tmp_path / "lost.tsmr"), tmp_path / "new.tsmr"
    change(path, "UPDATE meta SET value = '{' WHERE key = 'config'")
    with pytest.raises(RunFileError, match=r"lost its configuration.*--like"):
        recover(path, out)
    assert recover(path, out, like=whole).n_evaluations == 38
    assert hash_of(out) == hash_of(whole)


def test_where_the_search_comes_out_differently_generations_are_copied_as_recorded(whole, tmp_path):
    path, out = shutil.copy(whole, tmp_path / "other.tsmr"), tmp_path / "new.tsmr"
    # as if with other versions
    with RunReader(whole) as reader:
        (row,) = {reader.config.seed}
    change(path, f"UPDATE meta SET value = replace(value, '\"seed\": {row}', '\"seed\": 5')")
    sql = "UPDATE placements SET evaluation = 12345 WHERE generation = 3 AND evaluation NOT NULL"
    change(path, sql, sealed=False)
    found = recover(path, out)
    assert found.n_generations == 3
    assert not found.resumable
    assert "copied as recorded" in found.notes[0]
    assert origins(out) == origins(whole)[: found.n_evaluations]
    assert not [p for p in problems(out) if "state" not in p]
    with RunReader(out) as new, RunReader(whole) as old:
        for name in ("morphology", "controller"):
            assert new.placements(name, 2) == old.placements(name, 2)


def test_nothing_is_overwritten_and_nothing_is_left_behind(whole, tmp_path):
    out = tmp_path / "new.tsmr"
    out.write_text("mine")
    with pytest.raises(RunFileError, match="exists; choose another name"):
        recover(whole, out)
    assert out.read_text() == "mine"
    text = tmp_path / "text.tsmr"
    text.write_bytes(b"text" * 5000)
    with pytest.raises(RunFileError, match="lost its configuration"):
        recover(text, tmp_path / "other.tsmr")
    with pytest.raises(RunFileError, match="cannot be read"):
        recover(tmp_path / "gone.tsmr", tmp_path / "other.tsmr")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["new.tsmr", "text.tsmr"]


def test_a_run_that_is_being_written_is_left_alone(whole, tmp_path):
    path = shutil.copy(whole, tmp_path / "run.tsmr")
    with (
        engine.runs.evolve.RunWriter.open(path),
        pytest.raises(RunFileError, match=r"is being written .*stop"),
    ):
        recover(path, tmp_path / "new.tsmr")


# ---- formats


@pytest.mark.parametrize("version", [1, 2])
def test_an_older_format_is_read_and_copied_but_never_changed(whole, tmp_path, version):
    old, out = in_format(whole, tmp_path / "old.tsmr", version), tmp_path / "new.tsmr"
    assert hash_of(old) == hash_of(whole)
    assert not problems(old)
    before = old.read_bytes()
    assert migrate(old, out) == version
    assert old.read_bytes() == before
    assert hash_of(out) == hash_of(whole)
    with RunReader(out) as new, RunReader(old) as before:
        assert new.format_version == FORMAT_VERSION
        assert (new.created_at, new.versions) == (before.created_at, before.versions)
        assert new.recorded() == before.recorded()
        assert new.computers() == before.computers()
    assert origins(out) == origins(old)
    assert bool(origins(old)) == (version == 2)
    assert any("are as they were written" in f.text for f in check_run(out))
    with pytest.raises(RunFileError, match="has the present format"):
        migrate(out, tmp_path / "again.tsmr")
    with pytest.raises(RunFileError, match="exists"):
        migrate(old, out)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["new.tsmr", "old.tsmr"]


@pytest.mark.parametrize("version", [1, 2])
def test_going_on_with_a_run_leaves_its_format(whole, tmp_path, version):
    path = tmp_path / "run.tsmr"

    def interrupt(progress):
        if progress.n_evaluations >= 25:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        engine.runs.evolve.evolve(path, SMALL, observer=interrupt)
    old = in_format(path, tmp_path / "old.tsmr", version)
    engine.runs.evolve.resume(old)
    with RunReader(old) as reader:
        assert reader.format_version == version
        assert reader.n_evaluations() == 38
    assert not problems(old)
    assert hash_of(old) == hash_of(whole)
    assert len(origins(old)) == (38 if version == 2 else 0)


def test_the_first_format_is_recovered_without_digests(tmp_path):
    whole, out = tmp_path / "whole.tsmr", tmp_path / "new.tsmr"
    with pytest.MonkeyPatch.context() as patch:
        # what a simulation gives: fitness follows from the distances
        patch.setattr(engine.runs.evolve, "create_evaluator", lambda *_: Measured())
        engine.runs.evolve.evolve(whole, SMALL)
        path = in_format(whole, tmp_path / "old.tsmr", 1)
        change(path, "UPDATE evaluations SET fitness = fitness + 1e-9 WHERE number = 36")
        found = recover(path, out)
        assert found.damaged == [36]
        assert (found.n_generations, found.n_evaluations) == (3, 37)
        assert not problems(out)
        assert finish(out) == hash_of(whole)


def test_generations_that_overlapped_are_repeated_as_they_were(tmp_path):
    path, out = tmp_path / "run.tsmr", tmp_path / "new.tsmr"
    engine.runs.evolve.evolve(path, dataclasses.replace(MADE_UP, overlap=2))
    change(path, "DELETE FROM evaluations WHERE number = 69")
    recover(path, out)
    engine.runs.evolve.resume(out)
    engine.runs.evolve.evolve(tmp_path / "again.tsmr", dataclasses.replace(MADE_UP, overlap=2))
    assert hash_of(out) == hash_of(tmp_path / "again.tsmr")
