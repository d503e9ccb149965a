import csv
import dataclasses
import io
import json

import pytest

from engine.analysis.comparison import Comparison, TaskComparison, _groups, compare_runs
from engine.analysis.comparison_tables import csv_files
from engine.analysis.run_result import load_result
from engine.body.morphology import Morphology
from engine.config import replaced
from engine.errors import InvalidData, RunFileError
from engine.search.vie_neat import VieNeatConfig
from engine.storage.writer import RunWriter
from tests.support.made_up import MADE_UP, evaluation
from tests.support.made_up_grid import AXES, random_grid_run, write_grid_run
from tests.support.run_formats import change

N = 32  # evaluations of a random_grid_run


@pytest.fixture
def run_file(tmp_path):
    """Write a run of random figures; keywords change its configuration."""

    def write(name="a", seed=0, sizes=(20, 6, 6), **changes):
        config = replaced(MADE_UP, **({"evaluations": sum(sizes), "seed": seed} | changes))
        return random_grid_run(tmp_path / f"{name}.tsmr", seed, sizes, config=config)

    return write


def notes(*places, **options):
    return " ".join(compare_runs(places, **options).notes)


def result(path, algorithm, **changes):
    """Return a run's result as if another algorithm had made it."""
    r = load_result(path)
    few = VieNeatConfig(morphologies=8, mutants=8, controllers=10, elitism=1)
    config = dataclasses.replace(r.config, algorithm=algorithm, vie_neat=few)
    return dataclasses.replace(r, config=config, **changes)


def test_figures_of_a_run_by_hand(tmp_path):
    body = Morphology(4, (1, 1, 1))
    path = write_grid_run(
        tmp_path / "hand.tsmr",
        [
            [((1, 3, 0, 0), evaluation(0, 0.40, body)), ((1, 3, 1, 0), evaluation(1, 0.30, body))],
            [((2, 2, 1, 0), evaluation(2, 0.20))],
        ],
        replaced(MADE_UP, evaluations=3, initial=2, batch_size=2),
    )
    run = load_result(path)
    assert run.measure("best") == pytest.approx(25.0)
    assert run.measure("qd_score") == pytest.approx(15.0 + 25.0)
    assert run.measure("coverage") == pytest.approx(100 * 2 / 90)
    assert (run.measure("evaluations"), run.measure("hours")) == (3.0, 2.0)
    assert [p.n_evaluations for p in run.points] == [2, 3]
    assert run.points[0].best == pytest.approx(0.15)
    assert run.finished
    early = load_result(path, at=2)
    assert early.measure("best") == pytest.approx(15.0)
    assert early.maps["morphology"].elites == {(1, 3): (0.30, 1)}
    assert not early.finished


def test_runs_are_grouped_in_the_papers_order(run_file):
    paths = [run_file(f"r{k}", k) for k in range(4)]
    named = ["dm-me", "vie-neat", "map-elites", "dm-me"]
    groups = _groups([result(p, a) for p, a in zip(paths, named, strict=True)])
    assert [(g.name, len(g.runs)) for g in groups] == [("ViE-NEAT", 1), ("MAP-Elites", 1), ("DM-ME", 2)]
    assert [g.algorithm for g in groups] == ["vie-neat", "map-elites", "dm-me"]
    values = [r.measure("best") for r in groups[2].runs]
    s = groups[2].statistics("best")
    assert (s.n, s.mean) == (2, pytest.approx(sum(values) / 2))
    task = TaskComparison("goal-reaching", groups)
    assert [(t.measure, t.first.name, t.second.name) for t in task.tests()][:3] == [
        ("best", "ViE-NEAT", "MAP-Elites"),
        ("best", "ViE-NEAT", "DM-ME"),
        ("best", "MAP-Elites", "DM-ME"),
    ]
    assert len(task.tests()) == 6
    assert not any(t.result.enough for t in task.tests())


def test_alike_runs_need_no_note(run_file):
    comparison = compare_runs([run_file("a", 1), run_file("b", 2)])
    assert comparison.notes == ()
    assert len(comparison.tasks) == 1
    assert list(comparison.labels.values()) == ["a", "b"]


def test_a_folder_stands_for_its_runs(run_file, tmp_path):
    run_file("a", 1)
    run_file("b", 2)
    assert len(compare_runs([tmp_path]).tasks[0].runs) == 2
    (tmp_path / "empty").mkdir()
    with pytest.raises(InvalidData, match="has no run files"):
        compare_runs([tmp_path / "empty"])


def test_different_budgets_are_noted_and_can_be_made_equal(run_file):
    a, b = run_file("a", 1), run_file("b", 2, sizes=(20, 6))
    text = notes(a, b)
    assert "26 to 32 evaluations" in text
    assert "--at 26" in text
    equal = compare_runs([a, b], at=26)
    assert equal.notes == ()
    assert {r.n_evaluations for r in equal.tasks[0].runs} == {26}


def test_different_experiments_are_noted(run_file):
    physics = dataclasses.replace(MADE_UP.physics, servo_noise=0.0)
    text = notes(run_file("a", 1), run_file("b", 2, physics=physics))
    assert "not of the same experiment: they differ in physics.servo_noise (0.0, 0.00035)." in text
    assert "trials" not in text


def test_different_settings_of_one_algorithm_are_noted(run_file):
    assert "differ in batch_size (6, 8)" in notes(run_file("a", 1), run_file("b", 2, batch_size=8))


def test_equal_seeds_are_noted(run_file):
    assert "share the seed 3: they are not independent" in notes(run_file("a", 3), run_file("b", 3))


def test_unfinished_runs_are_noted(run_file):
    text = notes(run_file("a", 1, evaluations=50))
    assert "a is not finished: 32 of 50 evaluations count." in text


def test_a_run_named_twice_counts_once(run_file, tmp_path):
    path = run_file()
    comparison = compare_runs([path, tmp_path])
    assert len(comparison.tasks[0].runs) == 1
    assert "counts once" in comparison.notes[0]


def test_runs_of_several_tasks_are_compared_apart(run_file):
    a, b = result(run_file("a", 1), "dm-me"), result(run_file("b", 2), "dm-me")
    tasks = tuple(TaskComparison(t, _groups([r])) for t, r in (("goal-reaching", a), ("other", b)))
    files = csv_files(Comparison(tasks, {a.path: "a", b.path: "b"}, ()))
    rows = list(csv.DictReader(io.StringIO(files["runs.csv"])))
    assert [r["task"] for r in rows] == ["goal-reaching", "other"]
    # what the paper says is beside the task that it has
    published = {
        (r["task"], r["measure"]): r["published_mean"]
        for r in csv.DictReader(io.StringIO(files["statistics.csv"]))
    }
    assert published["goal-reaching", "best_f_s_cm"] == "25.76"
    assert published["other", "best_f_s_cm"] == ""


def test_maps_of_other_shapes_are_noted_and_not_tested(run_file, tmp_path):
    axes = (*AXES[:2], dataclasses.replace(AXES[1], name="stiffest"), *AXES[2:])
    config = replaced(MADE_UP, evaluations=2, initial=2)
    offers = [((1, 1, 1, 1, 1), evaluation(0)), ((1, 1, 2, 1, 1), evaluation(1, 0.2))]
    other = write_grid_run(tmp_path / "other.tsmr", [offers], config, axes)
    groups = _groups([result(run_file(), "dm-me"), result(other, "map-elites")])
    assert [g.map_shape for g in groups] == [(9, 10, 10), (9, 10)]
    assert {t.measure for t in TaskComparison("goal-reaching", groups).tests()} == {"best"}


def test_runs_without_a_finished_generation_are_left_out(run_file, tmp_path):
    new = tmp_path / "new.tsmr"
    with RunWriter.create(new, MADE_UP, {}):
        pass
    comparison = compare_runs([run_file(), new])
    assert len(comparison.tasks[0].runs) == 1
    assert comparison.notes[0].endswith("new.tsmr has no finished generation yet; it is left out.")
    with pytest.raises(RunFileError, match="no finished generation yet"):
        compare_runs([new])
    with pytest.raises(RunFileError, match="no finished generation within 5 evaluations"):
        compare_runs([run_file("b")], at=5)


def test_bad_input_is_refused_in_a_line(run_file, tmp_path):
    with pytest.raises(InvalidData, match="name at least one"):
        compare_runs([])
    with pytest.raises(InvalidData, match="must be positive"):
        compare_runs([run_file()], at=0)
    with pytest.raises(RunFileError, match="does not exist"):
        compare_runs([tmp_path / "none.tsmr"])
    (tmp_path / "text.tsmr").write_text("no run")
    with pytest.raises(RunFileError, match="not a TensAtlas run file"):
        compare_runs([tmp_path / "text.tsmr"])


def test_an_unknown_task_is_refused_in_a_line(run_file):
    path = run_file()
    change(path, "UPDATE meta SET value = json_set(value, '$.task', 'flying') WHERE key = 'config'")
    with pytest.raises(RunFileError, match="flying") as e:
        compare_runs([path])
    assert "\n" not in str(e.value)


def test_tables_for_other_programs(run_file):
    comparison = compare_runs([run_file("a", 1), run_file("b", 2)])
    files = {name: list(csv.DictReader(io.StringIO(text))) for name, text in csv_files(comparison).items()}
    (group,) = comparison.tasks[0].groups
    best = next(r for r in files["statistics.csv"] if r["measure"] == "best_f_s_cm")
    assert (best["runs"], float(best["mean"])) == ("2", group.statistics("best").mean)
    assert best["published_median"] == "24.22"
    assert [float(r["qd_score_cm"]) for r in files["runs.csv"]] == group.values("qd_score")
    trend = [r for r in files["trends.csv"] if r["measure"] == "coverage_percent"]
    assert [int(r["evaluations"]) for r in trend] == [20, 26, 32]
    assert float(trend[-1]["mean"]) == pytest.approx(group.statistics("coverage").mean)
    assert files["tests.csv"] == []


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("mujoco", "with mujoco 1 and 2."),
        ("physics", "with body model 1 and 2."),
        ("task goal-reaching", "with task file 1 and 2."),
    ],
)
def test_other_programs_and_tasks_are_noted(run_file, key, said):
    paths = [run_file("a", 1), run_file("b", 2)]
    for version, path in enumerate(paths, start=1):
        value = json.dumps({key: version})
        change(path, ("UPDATE meta SET value = ? WHERE key = 'versions'", (value,)))
    assert f"Runs of goal-reaching were made {said}" in notes(*paths)
    assert "were made" not in notes(paths[0])
