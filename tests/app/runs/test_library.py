from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.runs import launcher
from app.runs.library import Library, RunStatus
from app.runs.run_names import find_run, label_paths
from engine.analysis.robustness import load_robust
from engine.config import RunConfig, create_algorithm
from engine.errors import DumpError, InvalidData, RunFileError
from engine.replay.dump import read_dump
from engine.storage.reader import RunReader
from engine.storage.rows import statistics
from engine.storage.writer import RunWriter
from engine.workers.evaluator import create_evaluator
from tests.support.opened import files_opened
from tests.support.run_formats import change


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Library]:
    monkeypatch.chdir(tmp_path)
    library = Library([tmp_path / "shown"])
    yield library
    library.close()


def test_runs_appear_by_themselves(library: Library, tmp_path: Path, small_run: Path) -> None:
    assert library.runs() == []
    for folder in ("shown", "runs"):
        (tmp_path / folder).mkdir()
        shutil.copy(small_run, tmp_path / folder / "a.tsmr")
    (tmp_path / "shown" / "notes.txt").write_text("no run")
    assert library.runs() == [tmp_path / "shown" / "a.tsmr", tmp_path / "runs" / "a.tsmr"]
    assert label_paths(library.runs()) == dict(zip(("shown/a", "runs/a"), library.runs(), strict=True))
    assert list(label_paths(library.runs()[:1])) == ["a"]


def test_a_run_whose_task_file_has_an_error_is_listed_with_it(
    library: Library, tmp_path: Path, small_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = Path(shutil.copy(small_run, tmp_path / "a.tsmr"))
    change(path, "UPDATE meta SET value = json_set(value, '$.task', 'my-task') WHERE key = 'config'")
    broken = tmp_path / "broken.py"
    broken.write_text("TASK = (")
    monkeypatch.setenv("TENSATLAS_TASKS", str(broken))
    assert "broken.py, line 1" in str(library.facts(path).problem)


def test_a_name_that_is_no_text_is_shown_and_found(library: Library, tmp_path: Path, small_run: Path) -> None:
    (tmp_path / "shown").mkdir()
    for name in (b"a\xff.tsmr", b"a\xfe.tsmr", b"a\n.tsmr"):
        shutil.copy(small_run, tmp_path / "shown" / os.fsdecode(name))
    labels = label_paths(library.runs())
    assert sorted(labels) == ["a~0a", "a~fe", "a~ff"]
    for label, path in labels.items():
        assert library.facts(path).problem is None
        assert find_run(label, library.runs()) == path
    assert os.fsencode(labels["a~ff"].name) == b"a\xff.tsmr"


def test_a_run_file_is_opened_by_sqlite_alone(library: Library, tmp_path: Path, small_run: Path) -> None:
    path = Path(shutil.copy(small_run, tmp_path / "a.tsmr"))
    broken = Path(shutil.copy(small_run, tmp_path / "broken.tsmr"))
    with open(broken, "r+b") as f:
        f.truncate(9000)
    with files_opened() as opened:
        library.status(path)
        library.facts(path)
        assert "cut short" in (library.facts(broken).problem or "")
    assert [p for p in opened if p.suffix == ".tsmr"] == []


def test_what_is_no_file_is_no_run_and_keeps_nothing_waiting(
    library: Library, tmp_path: Path, small_run: Path
) -> None:
    folder = tmp_path / "shown"
    (folder / "folder.tsmr").mkdir(parents=True)
    os.mkfifo(folder / "x.tsmr")
    (folder / "gone.tsmr").symlink_to(tmp_path / "nowhere")
    (folder / "link.tsmr").symlink_to(small_run)
    path = Path(shutil.copy(small_run, folder / "a.tsmr"))
    for name in ("a.tsmr.lock", "a.robust.json", "a.log", "a.tsdump"):
        os.mkfifo(folder / name)
    assert library.runs() == [path, small_run.resolve()]
    assert library.facts(path).problem is None
    assert "is not a TensAtlas run file" in str(library.facts(folder / "x.tsmr").problem)
    with pytest.raises(InvalidData, match="regular file"):
        load_robust(folder / "a.robust.json")
    with pytest.raises(DumpError, match="regular file"):
        read_dump(folder / "a.tsdump")
    assert launcher.last_words(path) is None


def test_a_disk_that_does_not_answer_keeps_nobody_from_other_runs(
    tmp_path: Path, small_run: Path, grid_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("app.runs.library.ANSWER_TIME", 0.3)
    (tmp_path / "far").mkdir()
    far = Path(shutil.copy(grid_run, tmp_path / "far" / "far.tsmr"))
    library, go, lost = Library([tmp_path / "far", small_run]), threading.Event(), threading.Event()
    stat, iterdir = Path.stat, Path.iterdir

    def slow_stat(path: Path, **options: bool) -> os.stat_result:
        if lost.is_set() and "far" in str(path):
            assert go.wait(30)
        return stat(path, **options)

    def slow_iterdir(path: Path) -> Iterator[Path]:
        if lost.is_set() and "far" in str(path):
            assert go.wait(30)
        return iterdir(path)

    monkeypatch.setattr(Path, "stat", slow_stat)
    monkeypatch.setattr(Path, "iterdir", slow_iterdir)
    moved = threading.Event()
    try:
        assert library.runs() == [far, small_run.resolve()]
        library.watch("far", far, lambda *_: None, library.status(far))
        lost.set()
        assert library.runs() == [far, small_run.resolve()]  # as they were
        with pytest.raises(RunFileError, match="does not answer"):
            library.reader(far)
        assert "does not answer" in str(library.facts(far).problem)
        library.watch("near", small_run, lambda *_: moved.set(), RunStatus(0, 1, False))
        assert moved.wait(30)
        assert library.facts(small_run).problem is None
        before = threading.active_count()
        for _ in range(20):
            assert library.runs()
            assert library.facts(far).problem
        assert threading.active_count() <= before + 2
        library.close()  # nor the end of the app
    finally:
        go.set()


def test_a_replaced_file_is_read_anew(
    library: Library, tmp_path: Path, small_run: Path, grid_run: Path
) -> None:
    path = tmp_path / "a.tsmr"
    shutil.copy(small_run, path)
    assert library.status(path).n_evaluations == 18
    first = library.reader(path)
    assert library.reader(path) is first
    Path(shutil.copy(grid_run, tmp_path / "b.tsmr")).replace(path)
    assert library.reader(path) is not first
    assert set(library.reader(path).generations()[-1].archives) == {"grid"}
    path.unlink()
    with pytest.raises(RunFileError, match="does not exist any more"):
        library.reader(path)


def test_a_watch_reports_each_step_of_a_run(
    library: Library, tmp_path: Path, small_config: RunConfig
) -> None:
    path = tmp_path / "live.tsmr"
    seen: list[RunStatus] = []
    moved = threading.Event()

    def listener(_: Path, status: RunStatus) -> None:
        seen.append(status)
        moved.set()

    algorithm = create_algorithm(small_config)
    with RunWriter.create(path, small_config, {}) as writer:
        library.watch("me", path, listener, library.status(path))
        threading.Event().wait(1.0)
        assert seen == []  # nothing has happened
        solutions = algorithm.ask()
        evaluations = [e for group in create_evaluator(small_config, 2).evaluate(solutions) for e in group]
        writer.add_evaluations(0, evaluations)
        assert moved.wait(10)
        assert seen[-1] == RunStatus(None, 10, True)
        moved.clear()
        algorithm.tell(evaluations)
        writer.close_generation(algorithm, statistics(algorithm, 0.45), 1.0)
        assert moved.wait(10)
        assert seen[-1] == RunStatus(0, 10, True)
        moved.clear()
    assert moved.wait(10)
    assert seen[-1] == RunStatus(0, 10, False)
    library.unwatch("me")


def test_facts_say_what_a_run_is_and_how_far_it_came(
    library: Library, small_run: Path, grid_run: Path, tmp_path: Path
) -> None:
    facts = library.facts(grid_run)
    best = max(f.best or -1.0 for f in library.reader(small_run).generations()[-1].archives.values())
    assert (facts.task, facts.algorithm) == ("goal-reaching", "dm-me")
    assert facts.n_evaluations == facts.n_closed == 18
    assert facts.best == pytest.approx(best)
    assert (facts.state, facts.problem) == ("finished", None)
    broken = tmp_path / "broken.tsmr"
    broken.write_text("no run")
    assert "not a TensAtlas run file" in (library.facts(broken).problem or "")


def test_facts_of_a_run_that_has_not_closed_a_generation(
    library: Library, small_config: RunConfig, small_reader: RunReader, tmp_path: Path
) -> None:
    path = tmp_path / "new.tsmr"
    with RunWriter.create(path, small_config, {}) as writer:
        assert library.facts(path).state == "live"
        # of its first generation only these were saved
        writer.add_evaluations(0, small_reader.all_evaluations()[:3])
    facts = library.facts(path)
    assert (facts.state, facts.best) == ("stopped", None)
    assert (facts.n_evaluations, facts.n_closed) == (3, 0)
