import dataclasses
import shutil
import sqlite3
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

import engine.runs.evolve
from engine.errors import InvalidData, RunFileError
from engine.storage.reader import RunReader
from engine.storage.writer import RunWriter, is_being_written
from tests.support.killed import run_until_killed
from tests.support.made_up import MADE_UP, TINY, MadeUpEvaluator, examples, held
from tests.support.run_hash import hash_of


def evolve(path, config=MADE_UP, **options):
    engine.runs.evolve.evolve(path, config, **options)
    return hash_of(path)


# ---- real simulations


def test_a_simulated_run_is_whole(simulated_run):
    with RunReader(simulated_run) as reader:
        assert reader.config == TINY
        assert [g.n_evaluations for g in reader.generations()] == [6, 8, 10]
        assert [g.n_failed for g in reader.generations()] == [0, 0, 0]
        evaluations = reader.all_evaluations()
        assert [e.solution.number for e in evaluations] == list(range(10))
        for name in ("morphology", "controller"):
            assert reader.contents(name, 2)


def test_two_threads_give_the_same_run(simulated_run, tmp_path):
    assert evolve(tmp_path / "run.tsmr", TINY, n_threads=2) == hash_of(simulated_run)


def test_a_run_killed_three_times_ends_like_an_undisturbed_one(simulated_run, tmp_path):
    path = tmp_path / "run.tsmr"
    saved = []
    # in the first generation; with it saved but not closed; in the last one
    for limit in (1, 6, 9):
        run_until_killed(path, TINY, limit)
        assert not is_being_written(path)
        with RunReader(path) as reader:
            saved.append((reader.n_evaluations(), reader.last_generation()))
    assert saved[0][0] < 6
    assert [generation for _, generation in saved] == [None, None, 1]
    assert saved[1][0] == 6
    assert 9 <= saved[2][0] <= 10
    engine.runs.evolve.resume(path, n_threads=2)
    assert hash_of(path) == hash_of(simulated_run)


# ---- made-up figures


@pytest.mark.usefixtures("no_physics")
def test_resuming_a_finished_run_changes_nothing(tmp_path):
    path = tmp_path / "run.tsmr"
    evolve(path)
    before = path.read_bytes()
    dump = list(sqlite3.connect(path).iterdump())
    reports = []
    engine.runs.evolve.resume(path, observer=reports.append)
    assert list(sqlite3.connect(path).iterdump()) == dump
    assert len(path.read_bytes()) == len(before)
    assert all(p.n_new == 0 for p in reports)
    assert reports[-1].n_evaluations == reports[-1].budget == MADE_UP.evaluations


@pytest.mark.usefixtures("no_physics")
def test_evolve_refuses_an_existing_run(tmp_path):
    path = tmp_path / "run.tsmr"
    before = evolve(path)
    with pytest.raises(RunFileError, match=r"run\.tsmr exists"):
        engine.runs.evolve.evolve(path, MADE_UP)
    assert hash_of(path) == before


@examples(8)
@given(st.integers(0, 2**32 - 1), st.lists(st.integers(1, 25), min_size=1, max_size=4))
@pytest.mark.usefixtures("no_physics")
def test_a_run_interrupted_anywhere_ends_like_an_undisturbed_one(tmp_path_factory, seed, stops):
    folder = tmp_path_factory.mktemp("interrupted")
    config = dataclasses.replace(MADE_UP, seed=seed)
    undisturbed = evolve(folder / "undisturbed.tsmr", config)
    path = folder / "interrupted.tsmr"
    for stop in stops:
        reports = []

        def interrupt(progress, reports=reports, stop=stop):
            reports.append(progress)
            if len(reports) == stop:
                raise KeyboardInterrupt

        try:
            if path.exists():
                engine.runs.evolve.resume(path, observer=interrupt)
            else:
                engine.runs.evolve.evolve(path, config, observer=interrupt)
        except KeyboardInterrupt:
            assert len(reports) == stop
        assert not is_being_written(path)
    if path.exists():
        engine.runs.evolve.resume(path)
    else:
        engine.runs.evolve.evolve(path, config)
    assert hash_of(path) == undisturbed


@pytest.mark.usefixtures("no_physics")
def test_another_seed_gives_another_run(tmp_path):
    assert evolve(tmp_path / "a.tsmr") == evolve(tmp_path / "b.tsmr")
    other = dataclasses.replace(MADE_UP, seed=1)
    assert evolve(tmp_path / "c.tsmr", other) != hash_of(tmp_path / "a.tsmr")


@pytest.mark.usefixtures("no_physics")
def test_placements_of_every_generation_are_those_of_the_archives_then(tmp_path):
    path = tmp_path / "run.tsmr"
    after = {}

    def remember(progress):
        after.setdefault(progress.generation - 1, held(progress.archives))

    engine.runs.evolve.evolve(path, MADE_UP, observer=remember)
    with RunReader(path) as reader:
        assert reader.last_generation() == max(after) == 9
        assert set(after) == set(range(-1, 10))
        for generation, archives in after.items():
            for name, cells in archives.items():
                assert reader.placements(name, generation) == cells
                assert bool(cells) == (generation >= 0)


@pytest.mark.usefixtures("no_physics")
def test_a_run_is_read_while_it_is_written(tmp_path):
    path = tmp_path / "run.tsmr"
    readers, generations = [], set()

    def read(progress):
        if not readers:
            readers.append(RunReader(path))
        # one that stays open for the whole run and one that has just been opened
        with RunReader(path) as fresh:
            for reader in (readers[0], fresh):
                assert reader.config == MADE_UP
                if progress.n_evaluations < MADE_UP.evaluations:
                    assert reader.is_live
                assert reader.n_evaluations() == progress.n_evaluations
                assert len(reader.all_evaluations()) == progress.n_evaluations
                last = reader.last_generation()
                if last is not None:
                    generations.add(last)
                    for name, cells in held(progress.archives).items():
                        assert reader.placements(name, last) == cells

    engine.runs.evolve.evolve(path, MADE_UP, observer=read)
    assert generations == set(range(10))
    assert not readers[0].is_live
    assert readers[0].n_evaluations() == MADE_UP.evaluations
    undisturbed = evolve(tmp_path / "undisturbed.tsmr")
    assert readers[0].canonical_hash() == hash_of(path) == undisturbed
    readers[0].close()


@pytest.mark.usefixtures("no_physics")
def test_other_threads_may_read_all_the_time(tmp_path):
    path = tmp_path / "run.tsmr"
    errors, n_reads, stop = [], [0], threading.Event()

    def read_on():
        try:
            while not stop.is_set():
                with RunReader(path) as reader:
                    last = reader.last_generation()
                    if last is not None:
                        reader.contents("controller", last)
                        reader.generations()
                n_reads[0] += 1
        except Exception as e:
            errors.append(e)

    reading = threading.Thread(target=read_on)

    def begin(progress):
        if not reading.is_alive() and not stop.is_set() and not n_reads[0] and not errors:
            reading.start()

    try:
        engine.runs.evolve.evolve(path, MADE_UP, observer=begin)
    finally:
        stop.set()
        reading.join()
    assert not errors
    assert n_reads[0]
    assert hash_of(path) == evolve(tmp_path / "undisturbed.tsmr")


@pytest.mark.usefixtures("no_physics")
def test_reports_of_progress(tmp_path):
    reports = []
    engine.runs.evolve.evolve(tmp_path / "run.tsmr", MADE_UP, observer=reports.append)
    done = [p.n_evaluations for p in reports]
    assert done == sorted(done)
    assert done[0] == 0
    assert done[-1] == MADE_UP.evaluations
    assert all(p.budget == MADE_UP.evaluations for p in reports)
    assert all(p.n_new == p.n_evaluations for p in reports)
    assert all(p.initial_distance == 0.45 for p in reports)
    with RunReader(tmp_path / "run.tsmr") as reader:
        assert reports[-1].n_failed == reader.generations()[-1].n_failed > 0


@pytest.mark.usefixtures("no_physics")
def test_reports_after_resuming_count_both_parts(tmp_path):
    path = tmp_path / "run.tsmr"

    def interrupt(progress):
        if progress.n_evaluations >= 30:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        engine.runs.evolve.evolve(path, MADE_UP, observer=interrupt)
    with RunReader(path) as reader:
        n_before = reader.n_evaluations()
    reports = []
    engine.runs.evolve.resume(path, observer=reports.append)
    assert reports[0].n_evaluations == n_before >= 30
    assert all(p.n_new == p.n_evaluations - n_before for p in reports)


@pytest.mark.usefixtures("no_physics")
def test_computing_time_adds_up_over_interruptions(tmp_path, monkeypatch):
    path = tmp_path / "run.tsmr"
    clock = iter(range(10**6))
    monkeypatch.setattr("engine.runs.run_loop.time.monotonic", lambda: float(next(clock)))

    def interrupt(progress):
        if progress.n_evaluations >= 40:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        engine.runs.evolve.evolve(path, MADE_UP, observer=interrupt)
    engine.runs.evolve.resume(path)
    with RunReader(path) as reader:
        seconds = [g.seconds for g in reader.generations()]
    assert seconds == sorted(seconds)
    assert len(set(seconds)) == len(seconds)


@pytest.mark.usefixtures("no_physics")
def test_only_missing_evaluations_are_computed_after_an_interruption(tmp_path, monkeypatch):
    path = tmp_path / "run.tsmr"

    def interrupt(progress):
        if progress.n_evaluations >= 10:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        engine.runs.evolve.evolve(path, MADE_UP, observer=interrupt)
    with RunReader(path) as reader:
        known = {e.solution.number for e in reader.all_evaluations()}
    computed = []

    class Counting(MadeUpEvaluator):
        def evaluate(self, solutions):
            computed.extend(s.number for s in solutions)
            yield from super().evaluate(solutions)

    monkeypatch.setattr(engine.runs.evolve, "create_evaluator", lambda *_: Counting())
    engine.runs.evolve.resume(path)
    assert sorted(computed) == sorted(set(range(MADE_UP.evaluations)) - known)


@pytest.mark.usefixtures("no_physics")
def test_resuming_while_the_run_is_written_is_refused(tmp_path):
    path = tmp_path / "run.tsmr"
    refused = []

    def resume_too(progress):
        if progress.n_evaluations and not refused:
            with pytest.raises(RunFileError, match="is being written by another process") as e:
                engine.runs.evolve.resume(path)
            refused.append(e)

    engine.runs.evolve.evolve(path, MADE_UP, observer=resume_too)
    assert refused
    assert hash_of(path) == evolve(tmp_path / "undisturbed.tsmr")


@pytest.mark.parametrize("content", [None, b"", b"text" * 100])
def test_resuming_what_is_no_run(tmp_path, content):
    path = tmp_path / "run.tsmr"
    if content is not None:
        path.write_bytes(content)
    before = sorted(tmp_path.iterdir())
    with pytest.raises(RunFileError, match=r"run\.tsmr"):
        engine.runs.evolve.resume(path)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.usefixtures("no_physics")
def test_a_copy_of_an_interrupted_run_can_be_finished_elsewhere(tmp_path):
    path, copy = tmp_path / "run.tsmr", tmp_path / "elsewhere" / "copy.tsmr"

    def interrupt(progress):
        if progress.n_evaluations >= 33:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        engine.runs.evolve.evolve(path, MADE_UP, observer=interrupt)
    copy.parent.mkdir()
    shutil.copy(path, copy)
    engine.runs.evolve.resume(copy)
    engine.runs.evolve.resume(path)
    assert hash_of(copy) == hash_of(path)


def test_versions_of_what_decides_the_outcome():
    versions = engine.simulation.provenance.versions()
    assert {"python", "mujoco", "numpy", "neat-python", "scikit-learn"} <= set(versions)
    assert all(isinstance(v, str) and v for v in versions.values())


def test_physics_that_mujoco_refuses_leaves_no_file(tmp_path, monkeypatch):
    def refuse(*_):
        raise ValueError("Error: mass and inertia of moving bodies must be larger than mjMINVAL\nElement 1")

    monkeypatch.setattr(engine.runs.evolve, "build_robot", refuse)
    with pytest.raises(InvalidData, match="MuJoCo refuses this robot: Error: mass and inertia"):
        evolve(tmp_path / "run.tsmr", TINY)
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("no_physics")
def test_pending_evaluations_of_other_versions_are_refused(tmp_path):
    """As if another NEAT-Python had drawn other solutions."""
    path = tmp_path / "run.tsmr"
    algorithm = engine.config.create_algorithm(dataclasses.replace(TINY, seed=99))
    strangers = [e for group in MadeUpEvaluator().evaluate(algorithm.ask()[:2]) for e in group]
    with RunWriter.create(path, TINY, {}) as writer:
        writer.add_evaluations(0, strangers)
    with pytest.raises(RunFileError, match="comes out differently"):
        engine.runs.evolve.resume(path)


def test_changed_versions_are_named(tmp_path):
    path = tmp_path / "run.tsmr"
    with RunWriter.create(path, TINY, {**engine.simulation.provenance.versions(), "mujoco": "3.0.0"}):
        pass
    (change,) = engine.storage.reader.changed_versions(path)
    assert change.startswith("mujoco 3.0.0 -> ")
