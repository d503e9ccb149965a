import json
import shutil

import numpy as np
import pytest

import engine.analysis.reevaluation
from engine.analysis.elite_maps import EliteMap
from engine.analysis.reevaluation import reevaluate
from engine.analysis.robustness import (
    Robustness,
    load_robust,
    load_robust_of,
    map_robustness,
    robust_path,
)
from engine.analysis.verify import resimulate
from engine.errors import InvalidData, RunFileError
from engine.simulation.evaluation import LocalEvaluator
from engine.storage.lock import RunLock
from engine.storage.reader import RunReader
from tests.support.made_up import MadeUpEvaluator
from tests.support.made_up_grid import AXES


@pytest.fixture
def run(simulated_run, tmp_path):
    """A copy of a real run, for keeping results beside it."""
    return shutil.copy(simulated_run, tmp_path / "run.tsmr")


@pytest.fixture(scope="module")
def reevaluated(simulated_run, tmp_path_factory):
    """A real run whose morphology map was evaluated again twice, on one thread; not to be changed."""
    path = shutil.copy(simulated_run, tmp_path_factory.mktemp("again") / "run.tsmr")
    return path, *reevaluate(path, repeats=2, archive="morphology")


def test_figures_by_hand():
    elites = {
        (0, 0, 0, 0): (0.30, 3),
        (1, 0, 0, 0): (0.40, 4),
        (2, 0, 0, 0): (0.20, 5),
        (3, 0, 0, 0): (0.1, 6),
    }
    robust = Robustness(
        created_at="",
        versions={},
        recorded={n: fitness for fitness, n in elites.values()},
        samples={3: {1: 0.40, 2: 0.30}, 4: {1: 0.38, 2: 0.36}, 5: {1: None, 2: 0.45}, 6: {1: None}},
    )
    m = map_robustness("grid", EliteMap(AXES, elites), robust, 0.45)
    assert (m.n_elites, m.n_known, m.n_failed) == (4, 3, 2)
    # f_s recorded: 0.15, 0.05, 0.25; again: 0.10, 0.08, 0.00
    assert m.qd_score == pytest.approx(0.45)
    assert m.corrected_qd_score == pytest.approx(0.18)
    assert m.best == pytest.approx((0.25, 0.00))
    assert m.best_again == pytest.approx(0.10)
    assert (m.mean, m.mean_again) == (pytest.approx(0.15), pytest.approx(0.06))
    assert m.luck == pytest.approx(0.09)
    assert m.luck_deviation == pytest.approx(np.std([0.05, -0.03, 0.25], ddof=1))
    assert m.deviation == pytest.approx((0.10 + 0.02) / 2 / np.sqrt(2))
    assert robust.f_s(0.45) == pytest.approx({3: 0.10, 4: 0.08, 5: 0.0})
    assert robust.luck(4) == pytest.approx(-0.03)
    assert robust.luck(6) is robust.mean(6) is robust.deviation(5) is None


def test_an_unknown_map_has_counts_alone():
    m = map_robustness("grid", EliteMap(AXES, {(0, 0, 0, 0): (0.3, 1)}), Robustness("", {}, {}, {}), 0.45)
    assert (m.n_elites, m.n_known, m.qd_score, m.corrected_qd_score) == (1, 0, 0.0, 0.0)
    assert m.best is m.luck is m.mean is m.deviation is None


def test_elites_do_again_what_verify_says(reevaluated):
    path, robust, (figures,) = reevaluated
    assert load_robust(robust_path(path)) == robust
    with RunReader(path) as reader:
        held = reader.contents("morphology", reader.last_generation())
        config = reader.config
    elite = min(held.values(), key=lambda e: e.fitness)
    samples = resimulate(config, elite, physics=config.physics, n_seeds=2)
    assert robust.fresh(elite.solution.number).tolist() == samples.fitness.tolist()
    assert samples.recorded_noise.fitness == robust.recorded[elite.solution.number] == elite.fitness
    assert set(robust.samples) == {e.solution.number for e in held.values()}
    assert figures.best[0] == pytest.approx(0.45 - elite.fitness)
    assert figures.n_known == len(held)


def test_no_noise_is_the_runs_own_or_used_twice(run, monkeypatch):
    asked = []

    def record(self, solutions):
        asked.extend(s.number for s in solutions)
        yield from ()

    monkeypatch.setattr(LocalEvaluator, "evaluate", record)
    reevaluate(run, repeats=4)
    with RunReader(run) as reader:
        n_elites = len({n for a in ("morphology", "controller") for n in reader.placements(a, 9).values()})
        assert min(asked) > reader.n_evaluations()
    assert len(set(asked)) == len(asked) == 4 * n_elites


def test_the_file_does_not_depend_on_workers_or_on_interruptions(reevaluated, run, monkeypatch):
    expected = robust_path(reevaluated[0]).read_bytes()
    monkeypatch.setattr(engine.analysis.reevaluation, "_SAVE_INTERVAL", 0.0)

    def stop(n, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        reevaluate(run, repeats=2, archive="morphology", observer=stop)
    part = load_robust(robust_path(run))
    n_before = sum(map(len, part.samples.values()))
    assert 0 < n_before < sum(map(len, reevaluated[1].samples.values()))
    counts = []
    reevaluate(
        run, repeats=2, archive="morphology", n_threads=2, observer=lambda *count: counts.append(count)
    )
    assert counts[0][1] + n_before == sum(map(len, reevaluated[1].samples.values()))
    assert robust_path(run).read_bytes() == expected
    # nothing is left to do
    reevaluate(run, repeats=2, archive="morphology", observer=lambda *_: pytest.fail("simulated again"))
    assert robust_path(run).read_bytes() == expected


def test_more_repeats_and_archives_add_to_what_is_there(reevaluated, run):
    shutil.copy(robust_path(reevaluated[0]), robust_path(run))
    robust, _ = reevaluate(run, repeats=3, archive="morphology", n_threads=2)
    for n, before in reevaluated[1].samples.items():
        assert len(robust.samples[n]) == 3
        assert {k: v for k, v in robust.samples[n].items() if k < 3} == before
    more, maps = reevaluate(run, repeats=1, n_threads=2)
    assert [m.archive for m in maps] == ["controller", "morphology"]
    assert all(m.n_known == m.n_elites for m in maps)
    assert {n: more.samples[n] for n in robust.samples} == robust.samples
    assert {len(s) for n, s in more.samples.items() if n not in robust.samples} == {1}
    with RunReader(run) as reader:
        assert load_robust_of(reader) == more


def test_a_run_without_results_has_none(run):
    with RunReader(run) as reader:
        assert load_robust_of(reader) is None
    with pytest.raises(InvalidData, match="make it with 'tensatlas reevaluate'"):
        load_robust(robust_path(run))


def test_results_of_another_run_or_of_other_versions_are_refused(reevaluated, run):
    path = robust_path(run)
    data = json.loads(robust_path(reevaluated[0]).read_text())
    number = next(iter(data["elites"]))
    for changes, reason in (
        ({"created_at": "1999"}, "is not of"),
        ({"elites": {**data["elites"], number: {"recorded": 0.1, "repeats": {}}}}, f"robot {number} differs"),
        ({"elites": {"999999": {"recorded": 0.1, "repeats": {}}}}, "robot 999999 differs"),
        ({"versions": {**data["versions"], "mujoco": "1"}}, "made with mujoco 1"),
    ):
        path.write_text(json.dumps(data | changes))
        with pytest.raises(InvalidData, match=reason) as e:
            reevaluate(run, repeats=1)
        assert "\n" not in str(e.value)


WHOLE = {"format": 1, "created_at": "", "versions": {}, "elites": {}}


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        "null",
        "\x00",
        "[" * 100000,
        json.dumps({"format": 99}),
        json.dumps(WHOLE | {"elites": []}),
        json.dumps(WHOLE | {"versions": 3}),
        json.dumps(WHOLE | {"elites": {"x": {"recorded": 1, "repeats": {}}}}),
        json.dumps(WHOLE | {"elites": {"1": {"recorded": None, "repeats": {}}}}),
        json.dumps(WHOLE | {"elites": {"1": {"recorded": 1, "repeats": {"0": 1}}}}),
        json.dumps(WHOLE | {"elites": {"1": {"recorded": 1, "repeats": {"1": float("nan")}}}}),
        json.dumps(WHOLE | {"elites": {"1": {"recorded": True, "repeats": {}}}}),
    ],
)
def test_what_is_no_result_is_refused_in_a_line(tmp_path, text):
    path = tmp_path / "x.robust.json"
    path.write_text(json.dumps(WHOLE))
    assert not load_robust(path).recorded
    path.write_text(text)
    with pytest.raises(InvalidData) as e:
        load_robust(path)
    assert "\n" not in str(e.value)


def test_bad_input_is_refused_before_time_is_spent(run):
    for repeats in (0, 101):
        with pytest.raises(InvalidData, match="repeats must be"):
            reevaluate(run, repeats=repeats)
    with pytest.raises(RunFileError, match="has no grid archive, but controller, morphology"):
        reevaluate(run, repeats=1, archive="grid")
    assert not robust_path(run).exists()


def test_two_at_once_do_not_save_over_each_other(run):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine.analysis.reevaluation, "create_evaluator", lambda *_: MadeUpEvaluator())
        lock = RunLock.acquire(robust_path(run))
        with pytest.raises(
            RunFileError, match=rf"{robust_path(run).name} is being written by another process"
        ):
            reevaluate(run, repeats=1, archive="morphology")
        lock.release()
        reevaluate(run, repeats=1, archive="morphology")
    assert [p.name for p in run.parent.iterdir() if "lock" in p.name] == []


def test_results_that_cannot_be_kept_are_reported(run, monkeypatch):
    monkeypatch.setattr(engine.analysis.reevaluation, "create_evaluator", lambda *_: MadeUpEvaluator())
    monkeypatch.setattr(
        engine.analysis.reevaluation, "robust_path", lambda run, **_: run.parent / "none" / "x.json"
    )
    with pytest.raises(RunFileError, match="cannot be written"):
        reevaluate(run, repeats=1, archive="morphology")
