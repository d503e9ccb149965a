import csv
import dataclasses
import io
import json

import pytest

from engine.analysis.comparison import Comparison, TaskComparison, compare_runs
from engine.analysis.comparison.compare import _tasks
from engine.analysis.comparison.run_result import load_result
from engine.analysis.comparison.significance import holm
from engine.analysis.comparison.tables import csv_files, markdown
from engine.analysis.comparison.task_comparison import make_groups
from engine.analysis.elite_maps import load_maps
from engine.analysis.robustness import Robustness, robust_path, save_robust
from engine.analysis.steering import steers
from engine.body.morphology import Morphology
from engine.config import replaced
from engine.errors import InvalidData, RunFileError
from engine.search.vie_neat import VieNeatConfig
from engine.storage.reader import RunReader
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
    assert run.measure("offset_qd_score") == pytest.approx(15.0 + 25.0 + 2 * 45.0)
    assert run.measure("above") == 2.0
    assert load_result(path, limit=0.2).measure("above") == 1.0
    assert run.measure("robust_best") is run.measure("robust_above") is None
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
    groups = make_groups([result(p, a) for p, a in zip(paths, named, strict=True)])
    assert [(g.name, len(g.runs)) for g in groups] == [("ViE-NEAT", 1), ("MAP-Elites", 1), ("DM-ME", 2)]
    assert [g.algorithm for g in groups] == ["vie-neat", "map-elites", "dm-me"]
    values = [r.measure("best") for r in groups[2].runs]
    s = groups[2].statistics("best")
    assert (s.n, s.mean) == (2, pytest.approx(sum(values) / 2))
    task = TaskComparison("goal-reaching", groups)
    assert [(t.measure, t.first.name, t.second.name) for t in task.tests][:3] == [
        ("best", "ViE-NEAT", "MAP-Elites"),
        ("best", "ViE-NEAT", "DM-ME"),
        ("best", "MAP-Elites", "DM-ME"),
    ]
    assert [t.measure for t in task.tests[::3]] == ["best", "qd_score", "above", "steering"]
    assert not any(t.result.enough for t in task.tests)


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
    assert "as it was at 26 evaluations" in text
    equal = compare_runs([a, b], at=26)
    assert equal.notes == ()
    assert {r.n_evaluations for r in equal.tasks[0].runs} == {26}


def test_different_experiments_are_noted(run_file):
    physics = dataclasses.replace(MADE_UP.physics, servo_noise=0.0)
    text = notes(run_file("a", 1), run_file("b", 2, physics=physics))
    assert "not of the same experiment: they differ in physics.servo_noise (0, 0.00035)." in text
    assert "trials" not in text


def test_different_settings_are_different_groups(run_file):
    (task,) = compare_runs(
        [run_file("a", 1), run_file("b", 2, batch_size=8), run_file("c", 3), run_file("d", 4, batch_size=8)]
    ).tasks
    assert [(g.name, [r.config.seed for r in g.runs]) for g in task.groups] == [
        ("DM-ME, batch size 6", [1, 3]),
        ("DM-ME, batch size 8", [2, 4]),
    ]


def test_budgets_are_different_groups_but_where_both_are_compared_before_their_end(run_file):
    paths = [run_file("a", 1), run_file("b", 2, evaluations=50)]
    assert len(compare_runs(paths).tasks[0].groups) == 2
    assert len(compare_runs(paths, at=32).tasks[0].groups) == 1


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
    tasks = tuple(TaskComparison(t, make_groups([r])) for t, r in (("goal-reaching", a), ("other", b)))
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
    groups = make_groups([result(run_file(), "dm-me"), result(other, "map-elites")])
    assert [g.map_shape for g in groups] == [(9, 10, 10), (9, 10)]
    assert {t.measure for t in TaskComparison("goal-reaching", groups).tests} == {"best", "steering"}


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
    assert (float(best["lower_quartile"]), float(best["upper_quartile"])) == group.statistics(
        "best"
    ).quartiles
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


def groups_of(run_file, seeds, other_seeds, **changes):
    """Return runs of two groups, the second of which has another batch size."""
    a = [run_file(f"a{s}", s) for s in seeds]
    return a, [run_file(f"b{s}", s, batch_size=8, **changes) for s in other_seeds]


def test_runs_that_began_with_the_same_robots_are_tested_in_pairs(run_file):
    a, b = groups_of(run_file, [1, 2, 3, 4], [4, 3, 2, 1, 5])
    (task,) = compare_runs(a + b).tasks
    test = task.tests[0]
    assert (test.result.kind, test.sizes) == ("signed-rank", "4 pairs")
    # the same seed gives the same made-up figures
    assert (test.result.p, test.effect.value) == (1.0, 0.5)
    # the second group worse by less than runs differ: each pair, but not each run, tells
    lower = [
        dataclasses.replace(r, points=(dataclasses.replace(r.points[-1], best=r.points[-1].best - 1e-6),))
        for r in task.groups[1].runs
    ]
    worse = TaskComparison("goal-reaching", make_groups([*task.groups[0].runs, *lower])).tests[0]
    assert worse.result.p == 2 / 16
    assert worse.effect.value == pytest.approx((6 + 4) / 16)
    # equal seeds alone make no pairs
    apart = [
        dataclasses.replace(r, first_robots=frozenset({str(r.config.map_search.batch_size)}))
        for r in task.runs
    ]
    test = TaskComparison("goal-reaching", make_groups(apart)).tests[0]
    assert (test.result.kind, test.sizes) == ("rank-sum", "4, 5")


def test_runs_of_other_seeds_are_tested_by_rank_sum(run_file):
    a, b = groups_of(run_file, [1, 2, 3, 4], [5, 6, 7, 8])
    (task,) = compare_runs(a + b).tasks
    assert {t.result.kind for t in task.tests} == {"rank-sum"}
    best = task.tests[0]
    first, second = (g.values("best") for g in task.groups)
    assert best.effect.value == pytest.approx(sum((x > y) + (x == y) / 2 for x in first for y in second) / 16)
    assert best.corrected_p == best.result.p  # the only test of its measure


def test_some_shared_seeds_are_noted(run_file):
    a, b = groups_of(run_file, [1, 2, 3], [3, 4, 5])
    comparison = compare_runs(a + b)
    assert {t.result.kind for t in comparison.tasks[0].tests} == {"rank-sum"}
    (note,) = [n for n in comparison.notes if "same random robots" in n]
    assert "(seed 3)" in note


def test_all_groups_against_a_baseline(run_file):
    a, b = groups_of(run_file, [1, 2], [3])
    c = [run_file("c", 4, batch_size=10)]
    for name in ("DM-ME, batch size 8", "dm-me, BATCH size 8", "b3"):
        (task,) = compare_runs(a + b + c, baseline=name).tasks
        assert {(t.first.name, t.second.name) for t in task.tests} == {
            ("DM-ME, batch size 6", "DM-ME, batch size 8"),
            ("DM-ME, batch size 10", "DM-ME, batch size 8"),
        }
    # the run is of one task; the group of another one is that with the same settings
    comparison = compare_runs(a + b)
    squeezing = [
        dataclasses.replace(r, config=replaced(r.config, task="squeezing")) for r in comparison.tasks[0].runs
    ]
    for name in ("b3", "dm-me, batch size 8"):
        runs = [*squeezing[:2], *comparison.tasks[0].runs, squeezing[2]]
        other = _tasks(runs, comparison.labels, None, name)[1]
        assert (other.task, other.baseline.name) == ("squeezing", "DM-ME, batch size 8")
    with pytest.raises(InvalidData, match="no group is called 'x', and no run; the groups are: DM-ME, batch"):
        compare_runs(a + b, baseline="x")


def test_tests_of_one_measure_are_a_family(run_file):
    a, b = groups_of(run_file, range(4), range(4, 8))
    c = [run_file(f"c{s}", s, batch_size=10) for s in range(8, 12)]
    (task,) = compare_runs(a + b + c).tasks
    family = [t for t in task.tests if t.measure == "best"]
    assert [t.corrected_p for t in family] == holm([t.result.p for t in family])
    assert len(family) == 3
    # 3 times 2 / 70 is above 0.05
    assert task.remark.startswith(
        "Corrected for 3 tests, no difference between so few runs can reach 0.05: 5 runs"
    )


def test_what_a_test_says(run_file):
    low, high = groups_of(run_file, range(4), range(4, 8))
    runs = [r for g in compare_runs(low + high).tasks[0].groups for r in g.runs]

    def changed(k, run):
        points = (*run.points[:-1], dataclasses.replace(run.points[-1], best=0.01 * k))
        return dataclasses.replace(run, points=points)

    groups = make_groups([changed(k, r) for k, r in enumerate(runs)])
    best = TaskComparison("goal-reaching", groups).tests[0]
    assert best.result.p == pytest.approx(2 / 70)
    assert best.significant
    assert best.sentence() == (
        "DM-ME, batch size 6 and DM-ME, batch size 8 differ: DM-ME, batch size 8 is higher."
    )
    few = TaskComparison("goal-reaching", make_groups([groups[0].runs[0], *groups[1].runs]))
    assert (
        few.tests[0]
        .sentence()
        .startswith(
            "1 run of DM-ME, batch size 6 and 4 runs of DM-ME, batch size 8 are too few to say anything"
        )
    )
    assert "p would be 0.4. 4 runs of each are the fewest whose difference could reach 0.05." in (
        few.tests[0].sentence()
    )
    assert "too few runs to say which group is better" in few.remark
    again = TaskComparison("goal-reaching", make_groups([changed(k % 4, r) for k, r in enumerate(runs)]))
    assert again.tests[0].sentence().startswith("No difference between")


def test_markdown_by_hand(run_file):
    a, b = groups_of(run_file, [1, 2, 3], [4])
    comparison = compare_runs(a + b, baseline="a1")
    s = comparison.tasks[0].groups[0].statistics("best")
    test = comparison.tasks[0].test("best", comparison.tasks[0].groups[1])
    first = markdown(comparison).split("\n\n")[1].splitlines()
    assert first == [
        "| group | n | median | quartiles | A12 against DM-ME, batch size 6 | interval | p | p (Holm) |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
        f"| DM-ME, batch size 6 | 3 | {s.median:.2f} | {s.quartiles[0]:.2f} to {s.quartiles[1]:.2f}"
        " | — | — | — | — |",
        f"| DM-ME, batch size 8 | 1 | {comparison.tasks[0].groups[1].values('best')[0]:.2f} | —"
        f" | {test.effect.value:.2f} | — | — | — |",
    ]
    assert "**Cells above 0.79 cm**, goal-reaching" in markdown(comparison)
    assert "A12" not in markdown(compare_runs(a + b))


def reevaluated(path, fresh, n_repeats=2):
    """Write beside a run what its elites did under fresh noise, in m, by a function of their number."""
    with RunReader(path) as reader:
        maps = load_maps(reader, reader.last_closed())
        recorded = {n: fitness for fitness, n in maps["morphology"].elites.values()}
        samples = {n: {k: fresh(n) for k in range(1, n_repeats + 1)} for n in recorded}
        save_robust(Robustness(reader.created_at, {}, recorded, samples), robust_path(path))
    return recorded


def test_elites_evaluated_again_are_compared_by_their_means(run_file):
    path = run_file()
    recorded = reevaluated(path, lambda _: 0.40)
    run = load_result(path)
    assert run.measure("robust_best") == pytest.approx(5.0)
    assert run.measure("robust_qd_score") == pytest.approx(5.0 * len(recorded))
    assert run.measure("robust_above") == len(recorded)
    assert load_result(path, limit=0.06).measure("robust_above") == 0
    # one that failed every time is worth nothing
    lost = min(recorded)
    reevaluated(path, lambda n: None if n == lost else 0.40)
    assert load_result(path).measure("robust_above") == len(recorded) - 1
    reevaluated(path, lambda _: None)
    assert load_result(path).measure("robust_best") is None


def test_elites_not_all_evaluated_again_are_noted(run_file):
    a, b = run_file("a", 1), run_file("b", 2)
    reevaluated(a, lambda _: 0.40)
    assert "1 of 2 runs of goal-reaching have all elites evaluated again" in notes(a, b)
    reevaluated(b, lambda _: 0.40, n_repeats=3)
    assert "evaluated again 2 to 3 times" in notes(a, b)
    # at an earlier moment the elites were others
    text = notes(a, b, at=20)
    assert "The figures of a under fresh noise are left out: only" in text
    assert load_result(a, at=20).measure("robust_best") is None


def test_the_share_of_elites_that_steer(run_file):
    run = load_result(run_file())
    (steers_at_all,) = steers(run.config, [evaluation().solution])
    assert run.measure("steering") == 100.0 * steers_at_all  # all have the same controller
