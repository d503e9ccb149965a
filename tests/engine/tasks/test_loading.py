"""Tasks in files of the user's: found by name, loaded only when named, and their mistakes in one line."""

import json
import math
import os
from pathlib import Path

import numpy as np
import pytest

import engine.runs.evolve
from engine.config import RunConfig, from_json, replaced, to_json
from engine.errors import InvalidData, RunFileError, TaskError, TensAtlasError, UnknownTask
from engine.replay.replay import Replay
from engine.storage.reader import RunReader
from engine.tasks import TASKS_VARIABLE, Task, Wall, get_task, load_task, loading, task_version, worlds
from tests.support.made_up import TINY, a_view
from tests.support.run_formats import change

EXAMPLE = Path(__file__).resolve().parents[3] / "docs" / "tasks" / "climb_step.py"

GOOD = """\
import numpy as np
from engine.tasks import Task, Wall
from tests.support.run_formats import change

def walls(target, n_modules):
    near = Wall(centre=(0.07, 0, 0.05), half_size=(0.05, 0.2, 0.05), yaw=0.3)
    return (near, Wall(centre=(-1.0, 0, 0.05), half_size=(0.1, 0.1, 0.05)))[: 2 - target]

TASK = Task(
    name="bump",
    inputs=("time", "height", "free"),
    sense=lambda v: np.stack([v.time, v.height, np.minimum(v.clearance, 1)], axis=-1),
    target_distance=0.5,
    target_bearings=(0, 0.1),
    walls=walls,
    score=lambda v: v.distance - v.modules[..., 2].max(axis=-1),
)
"""
"""Two walls for one target, one for the other, so near that a robot touches them."""


@pytest.fixture(autouse=True)
def forgotten(monkeypatch):
    """Nothing is loaded before a test or left behind by it."""
    monkeypatch.setattr(loading, "_loaded", {})
    monkeypatch.delenv(TASKS_VARIABLE, raising=False)


@pytest.fixture
def good(tmp_path):
    path = tmp_path / "bump.py"
    path.write_text(GOOD)
    return path


def test_the_example_is_a_short_file_that_makes_a_task():
    assert len(EXAMPLE.read_text().splitlines()) < 100
    task = load_task(EXAMPLE)
    assert get_task("climb-step") is task
    assert task.file == str(EXAMPLE)
    assert task.target_names == ("step of 1 cm", "step of 2 cm")
    for (step,), height in zip(worlds(task, 5), (0.01, 0.02), strict=True):
        assert step.centre[2] + step.half_size[2] == pytest.approx(height)
        assert step.centre[0] - step.half_size[0] == pytest.approx(0.15)
    # a head 5 cm from the edge, 20 cm from the target, 4 cm high; then one on the step
    view = a_view(position=(0.1, 0.0), direction=(1, 0), target=(0.3, 0.0), walls=worlds(task, 2)[0])
    np.testing.assert_allclose(task.sense(view)[0, 0], [2 / 3, 0, 1 / 3, 0.4], atol=1e-9)
    assert task.score(view)[0, 0] == pytest.approx(0.2)
    view = a_view(position=(0.2, 0.0), direction=(1, 0), target=(0.3, 0.0), walls=worlds(task, 2)[0])
    assert task.score(view)[0, 0] == pytest.approx(0.1 - 0.05)


def test_a_run_of_a_users_task_is_evaluated_stored_and_replayed_alike(good, tmp_path, monkeypatch):
    """Walls that differ in number between the targets, and touch the robot, included."""
    load_task(good)
    config = replaced(TINY, task="bump", evaluations=6, initial=4)
    one, two = tmp_path / "one.tsmr", tmp_path / "two.tsmr"
    engine.runs.evolve.evolve(one, config, n_threads=1)
    engine.runs.evolve.evolve(two, config, n_threads=2)
    with RunReader(one) as a, RunReader(two) as b:
        assert a.canonical_hash() == b.canonical_hash()
        assert a.versions["task bump"].startswith("sha256:")
        for e in a.all_evaluations()[:2]:
            assert e.failure is None
            for target in range(2):
                replay = Replay(a.config, e, target=target)
                replay.advance(1.0)
                assert replay.score == e.distances[target, 0]
                assert sum(not w.is_buried for w in replay.walls) == 2 - target
    # somebody else, or the same user tomorrow
    monkeypatch.setattr(loading, "_loaded", {})
    with pytest.raises(
        RunFileError, match=r"one\.tsmr cannot be opened: unknown task 'bump'.*TENSATLAS_TASKS"
    ):
        RunReader(one)
    monkeypatch.setenv(TASKS_VARIABLE, os.pathsep.join([str(EXAMPLE), str(good)]))
    with RunReader(one) as a:
        assert a.config.task == "bump"
        assert a.task_change is None
    assert engine.storage.reader.changed_versions(one) == []
    # the file has changed since
    monkeypatch.setattr(loading, "_loaded", {})
    good.write_text(GOOD + "# different\n")
    (change,) = engine.storage.reader.changed_versions(one)
    assert change.startswith("task bump sha256:")
    with RunReader(one) as a:
        assert a.task_change == "the file of task bump has changed since this run was started"


def test_no_run_file_makes_code_run(good, tmp_path, monkeypatch):
    """Whatever a file calls its task: a path, a module, something to import."""
    marker = tmp_path / "ran"
    evil = tmp_path / "evil.py"
    evil.write_text(f"open({str(marker)!r}, 'w')\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv(TASKS_VARIABLE, str(good))
    path = tmp_path / "run.tsmr"
    with engine.runs.evolve.RunWriter.create(path, TINY, {}):
        pass
    for name in (
        "evil.py",
        "./evil.py",
        str(evil),
        "evil",
        "evil:TASK",
        f"{good}{os.pathsep}evil.py",
        "..",
        "",
    ):
        config = {**to_json(TINY), "task": name}
        with pytest.raises(UnknownTask):
            from_json(config)
        change(path, ("UPDATE meta SET value = ? WHERE key = 'config'", (json.dumps(config),)))
        with pytest.raises(RunFileError, match="unknown task"):
            RunReader(path)
    assert not marker.exists()


BROKEN = {
    "a syntax error": ("x = (\n", "line 1"),
    "bytes that are no text": ("x = '\0'", "null bytes"),
    "an exception": ("import numpy\n\nnumpy.nothing()\n", "(line 3)"),
    "an exit": ("raise SystemExit(3)\n", "SystemExit"),
    "nothing": ("", "must define TASK"),
    "something else": ("TASK = {'name': 'bump'}", "must define TASK"),
    "a field too few": (GOOD.replace("    target_distance=0.5,\n", ""), "missing 1 required"),
    "a field too many": (GOOD.replace("walls=walls", "wall=walls"), "unexpected keyword argument 'wall'"),
    "a built-in name": (GOOD.replace('"bump"', '"squeezing"'), "built-in task"),
    "a name for no file": (GOOD.replace('"bump"', '"../bump"'), "small letters"),
    "inputs that are one text": (
        GOOD.replace('("time", "height", "free")', '"time"'),
        "inputs must be a tuple",
    ),
    "no inputs": (GOOD.replace('("time", "height", "free")', "()"), "1 to 100 inputs, not 0"),
    "no targets": (GOOD.replace("(0, 0.1)", "()"), "target_bearings"),
    "a bearing that is none": (GOOD.replace("(0, 0.1)", "(0, 'left')"), "not 'left'"),
    "no distance": (GOOD.replace("target_distance=0.5", "target_distance=0"), "must be positive"),
    "no function": (GOOD.replace("walls=walls", "walls=3"), "walls must be a function"),
    "an input too few": (GOOD.replace('"time", ', ""), "sense must return an array (3, 2, 2), not (3, 2, 3)"),
    "a score for all": (
        GOOD.replace("v.distance - v.modules[..., 2].max(axis=-1)", "0.0"),
        "score must return",
    ),
    "a score that is text": (
        GOOD.replace("score=lambda v: v.d", "score=lambda v: 'x' #"),
        "score must return",
    ),
    "an infinite score": (
        GOOD.replace("v.distance -", "np.inf -"),
        "score returned a number that is not finite",
    ),
    "a score beyond all": (GOOD.replace("v.distance -", "2e9 -"), "score returned a number beyond 1e+09"),
    "an unseen attribute": (GOOD.replace("v.height", "v.heigth"), "sense fails: AttributeError"),
    "walls that fail": (GOOD.replace("(near,", "(nearby,"), "walls fails: NameError"),
    "walls that are none": (
        GOOD.replace("return (near, ", "return (7, "),
        "walls must return a tuple of Wall",
    ),
    "too many walls": (GOOD.replace("[: 2 - target]", "* 40"), "at most 64 walls, not 80"),
    "a wall without size": (
        GOOD.replace("(0.05, 0.2, 0.05)", "(0.05, 0, 0.05)"),
        "half_size must be at least",
    ),
}


@pytest.mark.parametrize("what", BROKEN)
def test_mistakes_get_one_line_that_names_file_and_cause(tmp_path, what):
    source, cause = BROKEN[what]
    path = tmp_path / "broken.py"
    path.write_text(source)
    with pytest.raises(TaskError) as e:
        load_task(path)
    message = str(e.value)
    assert message.startswith(str(path))
    assert cause in message
    assert "\n" not in message
    assert task_version("bump") == {}


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(TaskError, match="cannot be read: No such file"):
        load_task(tmp_path / "missing.py")
    with pytest.raises(TaskError, match="cannot be read"):
        load_task(tmp_path)


def test_a_broken_file_in_the_list_is_named_only_if_it_may_matter(good, tmp_path, monkeypatch):
    broken = tmp_path / "broken.py"
    broken.write_text("x = (\n")
    monkeypatch.setenv(TASKS_VARIABLE, os.pathsep.join(["", str(broken), str(good)]))
    assert get_task("bump").name == "bump"
    assert get_task("goal-reaching").file == ""
    with pytest.raises(TaskError, match=r"broken\.py, line 1.*listed in TENSATLAS_TASKS"):
        get_task("climb-step")


def test_what_fails_only_later_stops_the_run_with_one_line_and_keeps_it(tmp_path):
    path, run = tmp_path / "late.py", tmp_path / "run.tsmr"
    late = GOOD.replace("v.distance -", "(np.nan if v.time.max() > 0.9 and v.shape[0] != 3 else 0.5) -")
    path.write_text(late)
    load_task(path)
    config = replaced(TINY, task="bump", evaluations=3, initial=3)
    with pytest.raises(TaskError, match=r"late\.py: score returned a number that is not finite"):
        engine.runs.evolve.evolve(run, config)
    path.write_text(late.replace("np.nan", "0.4"))
    load_task(path)
    engine.runs.evolve.resume(run)
    with RunReader(run) as reader:
        assert reader.n_evaluations() == 3


def test_a_configuration_names_a_known_task():
    assert RunConfig(task="squeezing").task == "squeezing"
    for name in ("flying", ""):
        with pytest.raises(TensAtlasError):
            RunConfig(task=name)
    with pytest.raises(InvalidData, match="expected str"):
        from_json({"task": 7})


def test_fields_are_checked_without_a_file_too():
    with pytest.raises(InvalidData, match="2 names for 1 targets"):
        Task(
            name="a", inputs=("x",), sense=len, target_distance=1.0, target_bearings=(0.0,), names=("l", "r")
        )
    with pytest.raises(InvalidData, match="not nan"):
        Task(name="a", inputs=("x",), sense=len, target_distance=math.nan, target_bearings=(0.0,))
    assert Wall(centre=(0, 0, 0), half_size=(1, 1, 1)).centre == (0.0, 0.0, 0.0)
