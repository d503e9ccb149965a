"""Runs that the kernel simulates: evaluated, repeated, varied, failed and exported like MuJoCo's."""

import dataclasses

import numpy as np
import pytest

import engine.runs.evolve
from engine.body.morphology import Morphology
from engine.config import from_json, to_json
from engine.export import simulate_trial
from engine.replay.dump import Dump, read_dump, write_dump
from engine.replay.dump_replay import DumpReplay
from engine.replay.replay import Replay
from engine.replay.what_if import WhatIf
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.simulation.physics import Physics
from engine.simulation.trials import TrialConfig
from engine.storage.reader import RunReader
from engine.tasks import GOAL_REACHING, SQUEEZING
from tests.support.made_up import TINY, evolved_controller

KERNEL = Physics(simulator="kernel")
SHORT = TrialConfig(repeats=2, settle_time=0.6, open_loop_time=0.4, trial_time=2.0)
CONFIG = dataclasses.replace(TINY, physics=KERNEL, trials=dataclasses.replace(TINY.trials, repeats=2))
BODIES = [Morphology(10, (1, 2, 3)), Morphology(3, (4, 5, 6)), Morphology(7, (7, 8, 1, 2))]


def solutions(task, bodies=BODIES):
    return [
        Solution(number=20 + k, morphology=body, controller=evolved_controller(k, 3, task.n_inputs))
        for k, body in enumerate(bodies)
    ]


def evaluate(task=GOAL_REACHING, physics=KERNEL, bodies=BODIES, **options):
    evaluator = LocalEvaluator(task=task, physics=physics, trials=SHORT, run_seed=1, **options)
    found = [e for group in evaluator.evaluate(solutions(task, bodies)) for e in group]
    return {e.solution.number: e for e in found}


def numbers(evaluation):
    return (
        evaluation.fitness,
        evaluation.distances.tobytes(),
        evaluation.trajectory.tobytes(),
        evaluation.head_is_end,
    )


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("kernel") / "run.tsmr"
    engine.runs.evolve.evolve(path, CONFIG)
    return path


@pytest.fixture
def reader(run):
    with RunReader(run) as reader:
        yield reader


@pytest.fixture
def robot(reader):
    return next(e for e in reader.all_evaluations() if e.fitness is not None)


@pytest.mark.parametrize("task", [GOAL_REACHING, SQUEEZING], ids=lambda task: task.name)
def test_threads_and_company_do_not_matter(task):
    together, threaded = evaluate(task), evaluate(task, n_threads=2)
    assert {k: numbers(e) for k, e in together.items()} == {k: numbers(e) for k, e in threaded.items()}
    assert numbers(together[20]) == numbers(evaluate(task, bodies=BODIES[:1])[20])


@pytest.mark.parametrize("task", [GOAL_REACHING, SQUEEZING], ids=lambda task: task.name)
def test_a_watched_evaluation_has_the_same_bits(task):
    seen = []
    watched = evaluate(task, observer=lambda sim: seen.append((sim.n_updates, sim.qpos.shape)))
    assert {k: numbers(e) for k, e in watched.items()} == {k: numbers(e) for k, e in evaluate(task).items()}
    # 100 control updates after 30 of settling, for each of the two sizes of robots
    assert [n for n, _ in seen] == [*range(31, 131)] * 2
    assert {shape[:2] for _, shape in seen} == {(2, task.n_targets * 2), (1, task.n_targets * 2)}


def test_another_noise_gives_another_result():
    evaluator = LocalEvaluator(task=GOAL_REACHING, physics=KERNEL, trials=SHORT, run_seed=2)
    ((other,),) = evaluator.evaluate(solutions(GOAL_REACHING)[:1])
    assert numbers(other) != numbers(evaluate(bodies=BODIES[:1])[20])


def test_newtons_method_in_mujoco_finds_the_same():
    # without noise, whose generators differ; the third body lands on its own rods, which amplifies rounding
    quiet = {"servo_noise": 0.0}
    ours = evaluate(physics=Physics(simulator="kernel", **quiet), bodies=BODIES[:2])
    theirs = evaluate(physics=Physics(simulator="mujoco", **quiet), bodies=BODIES[:2])
    for number, e in ours.items():
        assert e.head_is_end == theirs[number].head_is_end
        np.testing.assert_allclose(e.distances, theirs[number].distances, rtol=0, atol=2e-6)
        np.testing.assert_allclose(e.trajectory, theirs[number].trajectory, rtol=0, atol=2e-6)
        assert np.ptp(e.trajectory[..., 0]) > 2e-3


def test_a_task_in_python_is_given_what_it_asks_for():
    asked = []

    def sense(view):
        asked.append(view.time.max())
        return GOAL_REACHING.sense(view)

    task = dataclasses.replace(GOAL_REACHING, name="in-python", sense=sense)
    slow, quick = evaluate(task, bodies=BODIES[:1])[20], evaluate(bodies=BODIES[:1])[20]
    # libraries round elsewhere, and a controller's choice may tip over: most paths stay close
    assert np.median(np.abs(slow.trajectory - quick.trajectory)) < 1e-3
    assert len(asked) == 100
    assert asked[-1] == pytest.approx(1.98)


def test_a_replay_is_what_was_evaluated(reader, robot):
    for target in range(4):
        replay = Replay(reader.config, robot, target=target, repeat=1)
        replay.advance(CONFIG.trials.trial_time)
        assert replay.score == robot.distances[target, 1]
        assert replay.frames[-1].time == pytest.approx(CONFIG.trials.trial_time, abs=0.04)
        assert replay.frames[0].time < 0.0


def test_an_unchanged_body_has_the_recorded_scores(reader, robot):
    what_if = WhatIf(reader.config, robot, robot.solution.morphology)
    what_if.run()
    np.testing.assert_array_equal(what_if.scores, robot.distances)
    assert what_if.fitness == robot.fitness
    assert len(what_if.frames[0]) > 10


def test_an_interrupted_run_ends_like_an_undisturbed_one(run, tmp_path):
    def interrupt(progress):
        if progress.n_new >= 4:
            raise KeyboardInterrupt

    path = tmp_path / "run.tsmr"
    with pytest.raises(KeyboardInterrupt):
        engine.runs.evolve.evolve(path, CONFIG, observer=interrupt)
    engine.runs.evolve.resume(path, n_threads=2)
    with RunReader(path) as one, RunReader(run) as other:
        assert one.canonical_hash() == other.canonical_hash()


def in_python(view):
    return GOAL_REACHING.sense(view)


OWN_TASK = dataclasses.replace(GOAL_REACHING, name="own", sense=in_python)


@pytest.mark.parametrize("task", [GOAL_REACHING, OWN_TASK], ids=lambda task: task.name)
@pytest.mark.parametrize(
    ("stage", "settle_time", "open_loop_time"),
    [("settling", 2.0, 0.0), ("head-search", 0.0, 2.0), ("trial", 0.0, 0.0)],
)
def test_a_failure_is_dumped_with_its_last_moments_and_fails_in_mujoco_too(
    tmp_path, task, stage, settle_time, open_loop_time
):
    explosive = dataclasses.replace(KERNEL, timestep=0.004)
    trials = dataclasses.replace(SHORT, settle_time=settle_time, open_loop_time=open_loop_time)
    kept = []
    evaluator = LocalEvaluator(
        task=task,
        physics=explosive,
        trials=trials,
        run_seed=1,
        keep_failure=lambda failed: kept.append(failed) or " (kept)",
    )
    found = [e for group in evaluator.evaluate(solutions(GOAL_REACHING)[:1]) for e in group]
    assert found[0].fitness is None
    assert found[0].failure.startswith("diverged")
    assert found[0].failure.endswith(" (kept)")
    (failed,) = kept
    assert failed.stage == stage
    assert f"{failed.failure.n_updates * explosive.control_period:.2f} s" in failed.failure.reason
    assert 1 <= len(failed.failure.controls) <= min(100, failed.failure.n_updates)
    dump = Dump("goal-reaching", explosive, 1, failed, {})
    write_dump(dump, tmp_path / "failure.tsdump")
    replay = DumpReplay(read_dump(tmp_path / "failure.tsdump"))
    replay.advance()
    assert replay.failure == failed.failure.reason
    assert replay.frames
    assert replay.reproduced


def test_an_exported_trial_starts_where_the_robot_has_settled(reader, robot):
    trial = simulate_trial(reader.config, robot)
    assert trial.score == robot.distances[0, 0]
    np.testing.assert_allclose(trial.settled[1 : 1 + trial.pose.size], trial.pose.ravel(), rtol=0, atol=0)


def test_old_files_are_mujocos_and_new_ones_say_what_simulates():
    new = to_json(CONFIG)
    assert new["physics"]["simulator"] == "kernel"
    assert from_json(new) == CONFIG
    del new["physics"]["simulator"]
    assert from_json(new).physics.simulator == "mujoco"


def test_the_readme_of_an_export_does_not_promise_the_same_bits(reader, robot):
    from engine.export import export_files

    text = export_files(reader, robot.solution.number)["README.md"].decode()
    assert "TensAtlas's own kernel" in text
    assert "exactly" not in text.split("## Files")[1].split("## Limits")[0]


def test_outputs_that_lack_an_input_are_0_where_a_run_says_so():
    (solution,) = solutions(GOAL_REACHING)[:1]
    nobody = dataclasses.replace(solution.controller, connections=())
    zero = dataclasses.replace(nobody, nodes=tuple(dataclasses.replace(n, bias=-60.0) for n in nobody.nodes))

    def path(controller, unfed):
        trials = dataclasses.replace(SHORT, unfed_outputs=unfed)
        evaluator = LocalEvaluator(task=GOAL_REACHING, physics=KERNEL, trials=trials, run_seed=1)
        ((e,),) = evaluator.evaluate([dataclasses.replace(solution, controller=controller)])
        return e.trajectory.tobytes()

    assert path(nobody, "zero") == path(zero, "bias") != path(nobody, "bias")
