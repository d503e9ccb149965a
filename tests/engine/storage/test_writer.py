import contextlib
import dataclasses
import itertools
import json
import os
import shutil
import sqlite3
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import engine.runs.evolve
from engine.analysis.reevaluation import reevaluate
from engine.analysis.verify import verify
from engine.config import to_json
from engine.errors import InvalidData, RunFileError
from engine.replay.replay import Replay
from engine.search.archive import cell_name, parse_cell
from engine.simulation.evaluation import Evaluation, Solution
from engine.simulation.provenance import Origin, this_computer
from engine.storage.layouts import CompactTables, PlainTables
from engine.storage.layouts.compact import packed
from engine.storage.layouts.controllers import Genes, encode
from engine.storage.layouts.numbers import varint
from engine.storage.layouts.trajectories import encode as encode_trajectory
from engine.storage.reader import RunReader
from engine.storage.schema import APPLICATION_ID, COLUMNS, FORMAT_VERSION, TABLES
from engine.storage.writer import RunWriter, is_being_written, lock_path
from engine.tasks import LARGEST_SCORE
from tests.support.made_up import (
    MADE_UP,
    controllers,
    evolved_controller,
    examples,
    held,
    made_up_evaluation,
    morphologies,
    per_module_morphologies,
    some_controller,
)
from tests.support.run_formats import FIRST, SECOND, change, in_format

# adding zero makes 0.0 of -0.0, as the fitness function does: SQLite keeps no sign of a zero
finite = st.floats(-LARGEST_SCORE, LARGEST_SCORE).map(lambda x: x + 0.0)


@pytest.fixture(scope="module")
def made_up_run(tmp_path_factory):
    """A finished run of made-up figures; not to be changed."""
    path = tmp_path_factory.mktemp("made_up") / "made-up.tsmr"
    write_run(path)
    return path


@pytest.fixture
def damaged(made_up_run, tmp_path):
    """A copy of a run for breaking."""
    return shutil.copy(made_up_run, tmp_path / "damaged.tsmr")


@pytest.fixture
def old(made_up_run, tmp_path):
    """The run in the first format, for breaking."""
    return in_format(made_up_run, tmp_path / "damaged.tsmr", 1)


def write_run(path, config=MADE_UP, until=10**6):
    """Write a run by hand, generation by generation."""
    algorithm = engine.config.create_algorithm(config)
    with RunWriter.create(path, config, {"tensatlas": "0"}) as writer:
        while algorithm.generation < until and (solutions := algorithm.ask()):
            evaluations = [made_up_evaluation(s, failing=0.1) for s in solutions]
            writer.add_evaluations(algorithm.generation, evaluations)
            algorithm.tell(evaluations)
            writer.close_generation(algorithm, engine.storage.rows.statistics(algorithm, 0.45), 1.0)
    return algorithm


def read_everything(path):
    """Read a run file in every way there is."""
    with RunReader(path) as reader:
        last = reader.last_generation()
        reader.generations()
        reader.all_evaluations()
        reader.algorithm_state()
        for name in ("morphology", "controller"):
            reader.contents(name, last)
            reader.summaries(set(reader.placements(name, last).values()))
        return reader.canonical_hash()


def a_solution():
    return engine.config.create_algorithm(MADE_UP).ask()[0]


def everything_in(path):
    """Return all rows of all tables."""
    db = sqlite3.connect(path)
    rows = list(db.iterdump())
    db.close()
    return rows


# ---- records


@st.composite
def evaluations(draw):
    solution = Solution(
        number=draw(st.integers(0, 10**9)),
        morphology=draw(morphologies | per_module_morphologies()),
        controller=draw(controllers()),
        parent=draw(st.none() | st.integers(0, 10**9)),
        operator=draw(st.sampled_from(["random", "morphology", "controller", "both"])),
        source=draw(st.none() | st.sampled_from(["morphology", "controller"])),
    )
    failed = draw(st.booleans())
    e = made_up_evaluation(solution, salt=draw(st.integers(0, 2**32)))
    distances = e.distances.copy()
    distances[0, 0] = draw(finite)
    if failed and draw(st.booleans()):
        distances[-1] = np.nan
    return dataclasses.replace(
        e,
        fitness=None if failed else draw(finite),
        failure=draw(st.text(st.characters(codec="utf-8")).filter(str.isprintable)) if failed else None,
        distances=distances,
    )


def same(a: Evaluation, b: Evaluation):
    return (
        repr(a.solution) == repr(b.solution)
        and repr(a.fitness) == repr(b.fitness)
        and a.distances.tobytes() == b.distances.tobytes()
        and a.trajectory.dtype == b.trajectory.dtype
        and a.trajectory.tobytes() == b.trajectory.tobytes()
        and a.trajectory.shape == b.trajectory.shape
        and (a.head_is_end, a.failure) == (b.head_is_end, b.failure)
    )


@examples(40)
@given(evaluations(), st.integers(0, 10**6))
def test_an_evaluation_survives_a_run_file_to_the_last_bit(e, generation):
    for sql, kind in (
        (TABLES, CompactTables),
        (FIRST + SECOND, lambda query: PlainTables(query, 2)),
        (FIRST, lambda query: PlainTables(query, 1)),
    ):
        with contextlib.closing(sqlite3.connect(":memory:")) as db:
            db.row_factory = sqlite3.Row
            db.executescript(sql)
            tables = kind(lambda sql, parameters=(), db=db: db.execute(sql, parameters).fetchall())
            if kind is CompactTables:
                tables.create({})
            tables.add_evaluations(generation, [e], [])
            ((read_generation, read),) = tables.evaluations([e.solution.number])
        assert read_generation == generation
        assert same(read, e)


@examples(50)
@given(st.lists(st.integers(0, 999), min_size=1, max_size=4).map(tuple))
def test_a_cell_survives_its_name(cell):
    assert parse_cell(cell_name(cell)) == cell


def test_cells_are_written_as_people_do():
    assert cell_name((3, 7)) == "3,7"
    assert parse_cell(" 3 , 7 ") == (3, 7)


@pytest.mark.parametrize("text", ["", "3,", ",", "a,b", "3;7", "-1,2", "1.5,2", "1,2,", "9" * 30])
def test_what_is_no_cell_is_refused(text):
    with pytest.raises(InvalidData, match="cell"):
        parse_cell(text)


# ---- writing


def test_what_was_written_is_read(made_up_run):
    algorithm = engine.config.create_algorithm(MADE_UP)
    everything = []
    with RunReader(made_up_run) as reader:
        assert reader.config == MADE_UP
        assert reader.versions == {"tensatlas": "0"}
        assert not reader.is_live
        while solutions := algorithm.ask():
            new = [made_up_evaluation(s, failing=0.1) for s in solutions]
            everything += new
            algorithm.tell(new)
            g = algorithm.generation - 1
            for name, cells in held(algorithm.archives).items():
                assert reader.placements(name, g) == cells
                contents = reader.contents(name, g)
                assert all(same(contents[cell], e) for cell, e in algorithm.archives[name])
            (row,) = [x for x in reader.generations() if x.number == g]
            assert row.n_evaluations == len(everything)
            assert row.n_failed == sum(e.fitness is None for e in everything)
            for name, archive in algorithm.archives.items():
                figures = row.archives[name]
                scores = [0.45 - e.fitness for e in archive.elites()]
                assert figures.best == pytest.approx(max(scores))
                assert figures.mean == pytest.approx(np.mean(scores))
                assert figures.qd_score == pytest.approx(sum(scores))
                assert figures.coverage == pytest.approx(len(scores) / 90)
                assert figures.axes == algorithm.axes(name)
        assert reader.last_generation() == algorithm.generation - 1
        assert reader.n_evaluations() == MADE_UP.evaluations == len(everything)
        assert reader.algorithm_state() == json.loads(json.dumps(algorithm.state()))
        read = reader.all_evaluations()
        assert all(same(a, b) for a, b in zip(read, everything, strict=True))
        summaries = reader.summaries({e.solution.number for e in everything})
        assert {n: (x.fitness, x.morphology) for n, x in summaries.items()} == {
            e.solution.number: (e.fitness, e.solution.morphology) for e in everything if e.fitness is not None
        }
        # 20 in the first generation, then 6 each
        assert all(x.generation == max(0, (n - 14) // 6) for n, x in summaries.items())
        assert [reader.generation_of(n) for n in (0, 19, 20, 69, 70)] == [0, 0, 1, 9, None]
        assert same(reader.evaluation(7), everything[7])


def test_cells_become_empty_over_the_run(made_up_run):
    # or the test above would not see how emptied cells are stored
    with RunReader(made_up_run) as reader:
        cells = [set(reader.placements("controller", g.number)) for g in reader.generations()]
    assert any(before - after for before, after in itertools.pairwise(cells))


def test_later_generations_only(made_up_run):
    with RunReader(made_up_run) as reader:
        everything = reader.generations()
        assert [g.number for g in everything] == list(range(len(everything)))
        assert reader.generations(after=3) == everything[4:]
        assert reader.generations(after=1000) == []


def test_a_finished_run_is_one_file(made_up_run):
    assert [p.name for p in made_up_run.parent.iterdir()] == [made_up_run.name]


def test_a_moved_file_is_still_the_run(made_up_run, damaged):
    assert read_everything(damaged) == read_everything(made_up_run)


def test_create_refuses_an_existing_file(tmp_path):
    path = tmp_path / "there.tsmr"
    path.write_text("mine")
    with pytest.raises(RunFileError, match=r"there\.tsmr exists"):
        RunWriter.create(path, MADE_UP, {})
    assert path.read_text() == "mine"
    assert [p.name for p in tmp_path.iterdir()] == ["there.tsmr"]


def test_create_refuses_another_suffix(tmp_path):
    with pytest.raises(RunFileError, match=r"ends in \.tsmr"):
        RunWriter.create(tmp_path / "run.db", MADE_UP, {})
    assert list(tmp_path.iterdir()) == []


def test_create_refuses_a_folder_that_is_a_file(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFileError, match="file is not a folder"):
        RunWriter.create(tmp_path / "file" / "run.tsmr", MADE_UP, {})
    with pytest.raises(RunFileError, match=r"run\.tsmr cannot be written"):
        RunWriter.create(tmp_path / "file" / "deeper" / "run.tsmr", MADE_UP, {})


def test_create_makes_the_folder(tmp_path):
    path = tmp_path / "new" / "folder" / "run.tsmr"
    RunWriter.create(path, MADE_UP, {}).close()
    with RunReader(path) as reader:
        assert reader.config == MADE_UP
        assert reader.last_generation() is None
        assert reader.generations() == []
        assert reader.algorithm_state() is None
        assert reader.placements("morphology", 0) == {}


def test_remains_of_an_interrupted_creation_do_not_matter(tmp_path):
    (tmp_path / "run.tsmr.part").write_text("half")
    (tmp_path / "run.tsmr.lock").write_text("99999")
    RunWriter.create(tmp_path / "run.tsmr", MADE_UP, {}).close()
    with RunReader(tmp_path / "run.tsmr") as reader:
        assert reader.config == MADE_UP
    assert [p.name for p in tmp_path.iterdir()] == ["run.tsmr"]


def test_a_second_writer_is_refused_naming_the_process(tmp_path):
    path = tmp_path / "run.tsmr"
    with RunWriter.create(path, MADE_UP, {}):
        assert is_being_written(path)
        with pytest.raises(RunFileError, match=rf"run\.tsmr .*process \({os.getpid()} on "):
            RunWriter.open(path)
        assert is_being_written(path)
    assert not is_being_written(path)
    assert not lock_path(path).exists()
    RunWriter.open(path).close()


def test_a_reader_asking_whether_a_run_is_live_does_not_lock_out_its_writer(tmp_path):
    path = tmp_path / "run.tsmr"
    RunWriter.create(path, MADE_UP, {}).close()
    stop = threading.Event()

    def ask():
        while not stop.is_set():
            is_being_written(path)

    asking = threading.Thread(target=ask)
    asking.start()
    try:
        for _ in range(20):
            with RunWriter.open(path):
                assert is_being_written(path)
    finally:
        stop.set()
        asking.join()


def test_finished_evaluations_of_an_open_generation_are_kept(tmp_path):
    path = tmp_path / "run.tsmr"
    algorithm = engine.config.create_algorithm(MADE_UP)
    new = [made_up_evaluation(s) for s in algorithm.ask()[:5]]
    with RunWriter.create(path, MADE_UP, {}) as writer:
        writer.add_evaluations(0, new[:2])
        writer.add_evaluations(0, new[2:])
    with RunWriter.open(path) as writer:
        assert all(same(a, b) for a, b in zip(writer.pending(0), new, strict=True))
        assert writer.pending(1) == []
    with RunReader(path) as reader:
        assert reader.n_evaluations() == 5
        assert reader.last_generation() is None


def test_an_evaluation_cannot_be_saved_twice(tmp_path):
    path = tmp_path / "run.tsmr"
    new = [made_up_evaluation(s) for s in engine.config.create_algorithm(MADE_UP).ask()]
    with RunWriter.create(path, MADE_UP, {}) as writer:
        writer.add_evaluations(0, new[:3])
        with pytest.raises(RunFileError, match=r"run\.tsmr cannot be written"):
            writer.add_evaluations(0, new[2:])
        # all or nothing
        assert len(writer.pending(0)) == 3


# ---- bad files


def test_a_missing_file(tmp_path):
    with pytest.raises(RunFileError, match=r"gone\.tsmr does not exist"):
        RunReader(tmp_path / "gone.tsmr")
    assert list(tmp_path.iterdir()) == []


def test_a_folder(tmp_path):
    with pytest.raises(RunFileError, match=str(tmp_path)):
        RunReader(tmp_path)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "is empty"),
        (b"evaluation,fitness\n0,0.45\n" * 50, "not a TensAtlas run file"),
        (b"SQLite format 3\x00", "not a TensAtlas run file"),
        (b"SQLite format 3\x00" + bytes(4096), "cannot be read|another program"),
        (bytes(range(256)) * 32, "not a TensAtlas run file"),
    ],
)
def test_a_file_of_something_else(tmp_path, content, reason):
    path = tmp_path / "bad.tsmr"
    path.write_bytes(content)
    with pytest.raises(RunFileError, match=rf"bad\.tsmr.*({reason})"):
        RunReader(path)
    assert path.read_bytes() == content


@pytest.mark.parametrize("share", [0.02, 0.5, 0.95])
def test_a_truncated_file(damaged, share):
    content = damaged.read_bytes()
    damaged.write_bytes(content[: int(len(content) * share)])
    with pytest.raises(RunFileError, match=r"damaged\.tsmr is (cut short|not a TensAtlas)"):
        RunReader(damaged)


def test_a_file_that_lacks_a_part_of_its_last_page(damaged):
    content = damaged.read_bytes()
    damaged.write_bytes(content[:-2000])
    with pytest.raises(RunFileError, match=r"damaged\.tsmr"):
        read_everything(damaged)


def test_overwritten_pages(damaged):
    content = damaged.read_bytes()
    damaged.write_bytes(content[:4096] + b"\xa5" * (len(content) - 4096))
    with pytest.raises(RunFileError, match=r"damaged\.tsmr"):
        read_everything(damaged)


@settings(examples(60), derandomize=True)
@given(st.data())
def test_a_file_with_changed_bytes_is_read_or_refused(made_up_run, tmp_path, data):
    path = tmp_path / "damaged.tsmr"
    content = bytearray(made_up_run.read_bytes())
    # the first page holds the header and the names of all tables
    end = data.draw(st.sampled_from([4096, len(content)]))
    changes = st.tuples(st.integers(0, end - 1), st.integers(0, 255))
    for place, value in data.draw(st.lists(changes, min_size=1, max_size=20)):
        content[place] = value
    path.write_bytes(content)
    try:
        read_everything(path)
    except RunFileError as e:
        assert str(path) in str(e)  # noqa: PT017


@pytest.mark.parametrize("table", COLUMNS[FORMAT_VERSION])
def test_a_table_whose_definition_is_no_text(damaged, table):
    content = bytearray(damaged.read_bytes())
    content[content.index(b"CREATE TABLE " + table.encode()) + 2] = 0x80
    damaged.write_bytes(content)
    with pytest.raises(RunFileError, match=r"damaged\.tsmr"):
        read_everything(damaged)


def test_a_database_of_another_program(tmp_path):
    path = tmp_path / "foreign.tsmr"
    change(path, "CREATE TABLE evaluations (number INTEGER)")
    with pytest.raises(RunFileError, match=r"foreign\.tsmr is a database of another program"):
        RunReader(path)


def test_a_newer_version(damaged):
    change(damaged, f"PRAGMA user_version={FORMAT_VERSION + 1}")
    with pytest.raises(RunFileError, match=r"damaged\.tsmr was written by a newer TensAtlas"):
        RunReader(damaged)


@pytest.mark.parametrize("table", COLUMNS[FORMAT_VERSION])
def test_a_dropped_table(damaged, table):
    change(damaged, f"DROP TABLE {table}", sealed=False)
    with pytest.raises(RunFileError, match=rf"damaged\.tsmr is damaged: table {table}"):
        RunReader(damaged)


def test_a_dropped_column(damaged):
    change(damaged, "ALTER TABLE evaluations RENAME COLUMN fitness TO score")
    with pytest.raises(RunFileError, match=r"damaged\.tsmr is damaged: table evaluations"):
        RunReader(damaged)


@pytest.mark.parametrize(
    "value",
    [
        "",
        "{",
        "null",
        "7",
        '"text"',
        "[]",
        '{"evaluations": "many"}',
        '{"trials": {"trial_time": 1' + "0" * 400 + "}}",
        "[" * 100_000,
        b"\xff\xfe",
    ],
    ids=lambda v: str(v)[:20],
)
def test_a_garbage_configuration(damaged, value):
    change(damaged, ("UPDATE meta SET value = ? WHERE key = 'config'", (value,)))
    with pytest.raises(RunFileError, match=r"damaged\.tsmr is damaged"):
        RunReader(damaged)


def test_an_unknown_task_is_no_damage(damaged):
    change(damaged, ("UPDATE meta SET value = ? WHERE key = 'config'", ('{"task": "flying"}',)))
    with pytest.raises(
        RunFileError, match=r"d\.tsmr cannot be opened: unknown task 'flying'.*TENSATLAS_TASKS"
    ):
        RunReader(damaged)


def test_a_missing_configuration(damaged):
    change(damaged, "DELETE FROM meta")
    with pytest.raises(RunFileError, match=r"damaged\.tsmr is damaged"):
        RunReader(damaged)


def test_garbage_versions(damaged):
    change(damaged, "UPDATE meta SET value = '[1]' WHERE key = 'versions'")
    with pytest.raises(RunFileError, match=r"damaged\.tsmr is damaged"):
        RunReader(damaged)


GENES = '{"n_inputs":2,"nodes":[%s],"connections":[%s]}'
OUTPUTS = ",".join(f"[{k},0.0,1.0]" for k in range(20))
GARBAGE = [
    ("morphology", "{"),
    ("morphology", ""),
    ("morphology", "null"),
    ("morphology", '{"stiffness_level":5,"faces":[1]}'),
    ("morphology", '{"stiffness_level":50,"faces":[1,2]}'),
    ("morphology", b"\xff\xfe"),
    ("controller", "{"),
    ("controller", "[1,2,3]"),
    ("controller", GENES % ("", "")),
    ("controller", GENES % (OUTPUTS, "[-1,0,NaN,true,1]")),
    ("controller", GENES % (OUTPUTS, "[-1,0,Infinity,true,1]")),
    ("controller", GENES % (OUTPUTS, "[-1,0,1e999,true,1]")),
    ("controller", GENES % (OUTPUTS, "[-1,0,1" + "0" * 400 + ",true,1]")),
    ("controller", GENES % (OUTPUTS + ",[20,0.0,1.0]", "[20,20,1.0,true,1]")),
    ("controller", (GENES % (OUTPUTS, "")).replace('"n_inputs":2', '"n_inputs":5')),
    ("controller", "[" * 100_000),
    ("distances", "{}"),
    ("distances", "[]"),
    ("distances", "[[0.1,0.2]]"),
    ("distances", "[[0.1,0.2],[0.1,0.2],[0.1,0.2],[0.1]]"),
    ("distances", '[["a","b"],["a","b"],["a","b"],["a","b"]]'),
    ("distances", "[[1" + "0" * 400 + ",0.2],[0.1,0.2],[0.1,0.2],[0.1,0.2]]"),
    ("trajectory", b"123"),
    ("trajectory", bytes(4 * 2 * 4 * 39)),
    ("trajectory", "text"),
    ("trajectory", np.full(320, np.nan, "<f4").tobytes()),
    ("fitness", "good"),
    ("fitness", float("inf")),
    ("fitness", b"\x00"),
]


def test_an_evaluation_may_lack_its_trajectory(made_up_run, old, tmp_path):
    for path, table in ((made_up_run, "details"), (old, "evaluations")):
        copy = shutil.copy(path, tmp_path / f"{table}.tsmr")
        change(copy, f"UPDATE {table} SET trajectory = x'' WHERE number = 1")
        with RunReader(copy) as reader:
            assert reader.evaluation(1).trajectory.shape == (4, 0, 2)
            assert reader.lacks_trajectories()


@pytest.mark.parametrize(("column", "value"), GARBAGE, ids=lambda v: str(v)[:50])
def test_a_garbage_evaluation_of_the_first_format(old, column, value):
    db = sqlite3.connect(old)
    # one that did not fail
    (number,) = db.execute("SELECT number FROM evaluations WHERE fitness IS NOT NULL").fetchone()
    db.close()
    change(old, (f"UPDATE evaluations SET {column} = ? WHERE number = ?", (value, number)))
    with RunReader(old) as reader:
        with pytest.raises(RunFileError, match=rf"damaged\.tsmr is damaged: evaluation {number}"):
            reader.all_evaluations()
        with pytest.raises(RunFileError, match=r"damaged\.tsmr is damaged"):
            reader.evaluation(number)
        # the others can still be read
        assert reader.evaluation(number + 1).solution.number == number + 1


BODY = encode(Genes.of(evolved_controller(3, 5)))
COMPACT_GARBAGE = [
    ("evaluations", "morphology", ""),
    ("evaluations", "morphology", "8"),
    ("evaluations", "morphology", "8/1"),
    ("evaluations", "morphology", "50/12"),
    ("evaluations", "morphology", "5,5/123"),
    ("evaluations", "morphology", "5/1-2"),
    ("evaluations", "morphology", b"\xff\xfe"),
    ("evaluations", "fitness", "good"),
    ("evaluations", "fitness", 9e999),
    ("evaluations", "fitness", b"\x00"),
    ("details", "base", 10**6),
    ("details", "base", "x"),
    ("details", "base", -1),
    ("details", "controller", b""),
    ("details", "controller", b"\x01"),
    ("details", "controller", "text"),
    ("details", "controller", BODY[:-1]),
    ("details", "controller", BODY + b"\x00"),
    ("details", "controller", encode(Genes.of(evolved_controller(3, 5, n_inputs=5)))),
    ("details", "controller", encode(dataclasses.replace(Genes.of(some_controller()), keys=(0,) * 23))),
    ("details", "controller", varint(10**20)),
    ("details", "controller", varint(1023) + packed("\0" * 1_100_000)),
    ("details", "distances", b""),
    ("details", "distances", varint(4) + bytes(8 * 7)),
    ("details", "distances", varint(4) + bytes(8 * 7 + 1)),
    ("details", "distances", varint(8) + bytes(8 * 8)),
    ("details", "distances", varint(10**20) + bytes(8 * 8)),
    ("details", "distances", "text"),
    ("details", "trajectory", b"123"),
    ("details", "trajectory", "text"),
    ("details", "trajectory", varint(40) + bytes((14, 2)) + bytes(200)),
    ("details", "trajectory", varint(40) + bytes((31, 1)) + bytes(200)),
    ("details", "trajectory", varint(40) + bytes((14, 1)) + b"\xff" * 200),
    ("details", "trajectory", varint(40) + bytes((14, 1)) + bytes(200)),
    ("details", "trajectory", varint(10**9) + bytes((14, 1)) + bytes(200)),
    ("details", "trajectory", encode_trajectory(np.zeros((4, 39, 2), np.float32))),
    ("details", "trajectory", encode_trajectory(np.full((4, 40, 2), np.nan, np.float32))),
    ("details", "trajectory", encode_trajectory(np.zeros((4, 40, 2), np.float32))[:-1]),
    ("details", "trajectory", encode_trajectory(np.zeros((4, 40, 2), np.float32)) + b"\x00"),
]


@pytest.mark.parametrize(("table", "column", "value"), COMPACT_GARBAGE, ids=lambda v: str(v)[:40])
def test_a_garbage_evaluation(damaged, table, column, value):
    with contextlib.closing(sqlite3.connect(damaged)) as db:
        # one that did not fail, and over which no other is stored
        ((number, other),) = db.execute(
            "SELECT MIN(number), MAX(number) FROM evaluations WHERE fitness IS NOT NULL AND number NOT IN"
            " (SELECT base FROM details WHERE base IS NOT NULL)"
        )
    base = "base" if column == "base" else "NULL"
    change(
        damaged,
        f"UPDATE details SET base = {base} WHERE number = {number}",
        (f"UPDATE {table} SET {column} = ? WHERE number = ?", (value, number)),
    )
    with RunReader(damaged) as reader:
        with pytest.raises(RunFileError, match=r"damaged\.tsmr is damaged: "):
            reader.all_evaluations()
        with pytest.raises(RunFileError, match=r"damaged\.tsmr is damaged: "):
            reader.evaluation(number)
        # the others can still be read
        assert reader.evaluation(other).solution.number == other
    # a change that is not sealed is noticed as such
    change(damaged, (f"UPDATE {table} SET {column} = ? WHERE number = ?", (value, other)), sealed=False)
    with RunReader(damaged) as reader, pytest.raises(RunFileError, match=rf"{other} differs from what was"):
        reader.evaluation(other)


@pytest.mark.parametrize("version", [1, 3])
@pytest.mark.parametrize(
    "sql",
    [
        "UPDATE placements SET cell = cell || 'x'",
        "UPDATE placements SET evaluation = 'best'",
        "UPDATE placements SET evaluation = 9e999",
        "UPDATE placements SET evaluation = 123456",
        "UPDATE generations SET archives = packed('{')",
        "UPDATE generations SET archives = packed('[]')",
        "UPDATE generations SET archives = packed('{\"morphology\": 1}')",
        "UPDATE generations SET archives = packed(replace(unpacked(archives), '\"n\": 9', '\"n\": 1e999'))",
        "UPDATE generations SET archives = packed(replace(unpacked(archives), '\"axes\"', '\"axis\"'))",
        "UPDATE generations SET n_evaluations = 'many'",
        "UPDATE generations SET n_evaluations = 9e999",
        "UPDATE generations SET seconds = 'some'",
        "UPDATE state SET algorithm = packed('{')",
        "UPDATE state SET algorithm = x'ff'",
    ],
)
def test_garbage_in_other_tables(made_up_run, tmp_path, version, sql):
    path = tmp_path / "damaged.tsmr"
    if version == 3:
        shutil.copy(made_up_run, path)
    else:
        in_format(made_up_run, path, version)
    change(path, sql)
    with pytest.raises(RunFileError, match=r"damaged\.tsmr"):
        read_everything(path)


@pytest.mark.parametrize(
    "sql",
    [
        "UPDATE placements SET evaluation = 1 WHERE evaluation = 2",
        "DELETE FROM placements WHERE generation = 5 AND cell = (SELECT MAX(cell) FROM placements"
        " WHERE generation = 5)",
        "UPDATE placements SET generation = 99 WHERE generation = 5",
        "UPDATE generations SET n_failed = n_failed + 1 WHERE generation = 3",
        "DELETE FROM generations WHERE generation = 3",
        "DELETE FROM generations WHERE generation > 7",
        "UPDATE state SET generation = generation - 1",
        "DELETE FROM state",
        "UPDATE totals SET n_evaluations = n_evaluations - 1",
        "DELETE FROM totals",
        "DELETE FROM evaluations WHERE number = 69",
        "DELETE FROM details WHERE number = 69",
        "UPDATE evaluations SET parent = parent - 1 WHERE number = 60",
        "UPDATE evaluations SET operator = 'both' WHERE number = 3",
        "UPDATE meta SET value = replace(value, '70', '71') WHERE key = 'config'",
        "DELETE FROM meta WHERE key = 'versions'",
        "DELETE FROM meta WHERE key = 'digest'",
    ],
)
def test_what_was_changed_or_lost_is_noticed_when_it_is_read(damaged, sql):
    before = everything_in(damaged)
    change(damaged, sql, sealed=False)
    assert everything_in(damaged) != before
    with pytest.raises(RunFileError, match=r"damaged\.tsmr .*tensatlas recover"):
        read_everything(damaged)


def test_a_computer_that_was_changed_or_lost_is_noticed(damaged):
    with RunWriter.open(damaged) as writer:
        last = made_up_evaluation(dataclasses.replace(a_solution(), number=70))
        writer.add_evaluations(10, [last], [Origin(this_computer(), 1.5)])
    with RunReader(damaged) as reader:
        assert reader.computers() == {this_computer(): 1}
        assert reader.origins({3, 70}) == {70: Origin(this_computer(), 1.5)}
    for sql in ("UPDATE computers SET n_evaluations = 2", "DELETE FROM computers"):
        change(damaged, sql, sealed=False)
        with RunReader(damaged) as reader, pytest.raises(RunFileError, match="table computers differs"):
            reader.computers()


@pytest.mark.parametrize(
    "state", ["{}", "[]", "null", "7", '"x"', '{"generation": 0}', '{"rng": [3, [], null]}']
)
def test_resuming_from_a_garbage_state(damaged, state):
    change(damaged, ("UPDATE state SET algorithm = ?", (packed(state),)))
    with pytest.raises(RunFileError, match=r"damaged\.tsmr"):
        engine.runs.evolve.resume(damaged)
    assert not is_being_written(damaged)


def test_asking_for_an_evaluation_that_does_not_exist(made_up_run):
    with RunReader(made_up_run) as reader:
        with pytest.raises(RunFileError, match=r"made-up\.tsmr has no evaluation 70"):
            reader.evaluation(70)
        with pytest.raises(RunFileError, match=r"made-up\.tsmr"):
            reader.evaluation(10**30)


def test_a_reader_does_not_change_the_file(damaged):
    before = damaged.read_bytes()
    read_everything(damaged)
    assert damaged.read_bytes() == before
    assert [p.name for p in damaged.parent.iterdir()] == [damaged.name]


def test_the_hash_sees_results_but_not_dates(damaged):
    original = read_everything(damaged)
    change(damaged, "UPDATE meta SET value = '\"2001-01-01\"' WHERE key = 'created_at'")
    change(damaged, "UPDATE meta SET value = '{}' WHERE key = 'versions'")
    change(damaged, "UPDATE generations SET seconds = 99, finished_at = 'long ago'")
    assert read_everything(damaged) == original
    change(damaged, "UPDATE evaluations SET fitness = fitness + 1e-15 WHERE number = 3")
    changed = read_everything(damaged)
    assert changed != original
    change(damaged, "DELETE FROM placements WHERE generation = 4")
    assert read_everything(damaged) not in (original, changed)


def test_the_file_says_what_it_is(made_up_run):
    content = made_up_run.read_bytes()
    assert content[68:72] == b"TSMR" == APPLICATION_ID.to_bytes(4, "big")


def test_what_a_killed_process_left_beside_a_deleted_run_is_not_replayed(tmp_path):
    """The log of an old run must not end up in a new one of the same name."""
    old = tmp_path / "old" / "run.tsmr"
    writer = RunWriter.create(old, dataclasses.replace(MADE_UP, seed=1), {})
    writer.add_evaluations(0, [])
    new = tmp_path / "new" / "run.tsmr"
    new.parent.mkdir()
    # as after SIGKILL and the deletion of the database alone
    shutil.copy(old.with_name("run.tsmr-wal"), new.with_name("run.tsmr-wal"))
    writer.close()
    write_run(new, dataclasses.replace(MADE_UP, seed=2))
    with RunReader(new) as reader:
        assert reader.config.seed == 2
        assert reader.last_generation() is not None


def test_an_interrupted_transaction_leaves_one_whole_file(tmp_path):
    path = tmp_path / "run.tsmr"
    write_run(path, until=1)

    class Interrupted:
        def __iter__(self):
            raise KeyboardInterrupt

        def __len__(self):
            return 1

    with pytest.raises(KeyboardInterrupt), RunWriter.open(path) as writer:
        writer.add_evaluations(1, Interrupted())
    assert os.listdir(tmp_path) == ["run.tsmr"]
    with RunReader(path) as reader:
        assert reader.last_generation() == 0


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ('"n": 9', '"n": 1000000000'),
        ('"upper": 10.5', '"upper": -10.5'),
        ('"upper": 10.5', '"upper": NaN'),
    ],
)
def test_impossible_axes(damaged, before, after):
    with RunReader(damaged) as reader:
        (archives,) = {c.archives.replace(before, after) for c, _ in reader.recorded() if c.generation == 0}
    assert after in archives
    change(damaged, ("UPDATE generations SET archives = ? WHERE generation = 0", (packed(archives),)))
    with RunReader(damaged) as reader, pytest.raises(RunFileError, match="is damaged"):
        reader.generations()


def test_infinite_fitness(damaged):
    change(damaged, "UPDATE evaluations SET fitness = 9e999 WHERE failure IS NULL")
    with RunReader(damaged) as reader, pytest.raises(RunFileError, match="is damaged"):
        reader.summaries(set(range(5)))


OLD_PHYSICS = {"timestep": 0.005, "control_period": 0.02, "inertia_scale": 10.0, "friction": 0.5}
"""Of run files from before the body's time step was halved."""


def test_a_run_of_an_older_body_can_be_looked_at_but_not_simulated(tmp_path):
    path = tmp_path / "old.tsmr"
    write_run(path, until=2)
    config = to_json(MADE_UP) | {"physics": OLD_PHYSICS}
    change(path, ("UPDATE meta SET value = ? WHERE key = 'config'", (json.dumps(config),)))
    read_everything(path)
    with RunReader(path) as reader:
        assert reader.config.physics.timestep == 0.005
        elite = next(iter(reader.contents("morphology", 1).values()))
        with pytest.raises(InvalidData, match="robots would fly apart"):
            Replay(reader.config, elite)
        with pytest.raises(InvalidData, match="robots would fly apart"):
            verify(reader.config, elite, n_seeds=1)
    for simulate in (engine.runs.evolve.resume, lambda p: reevaluate(p, repeats=1)):
        with pytest.raises(InvalidData, match="robots would fly apart"):
            simulate(path)
    assert [p.name for p in tmp_path.iterdir()] == ["old.tsmr"]


def test_a_finished_run_of_an_older_body_is_resumed_to_no_effect(tmp_path):
    path = tmp_path / "old.tsmr"
    write_run(path)
    config = to_json(MADE_UP) | {"physics": OLD_PHYSICS}
    change(path, ("UPDATE meta SET value = ? WHERE key = 'config'", (json.dumps(config),)))
    reports, before = [], everything_in(path)
    engine.runs.evolve.resume(path, observer=reports.append)
    assert everything_in(path) == before
    assert reports
    assert all(p.n_new == 0 for p in reports)
    assert [p.name for p in tmp_path.iterdir()] == ["old.tsmr"]
