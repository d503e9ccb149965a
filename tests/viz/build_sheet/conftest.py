"""Robots of two and of ten modules, as a build sheet gets to see them."""

import dataclasses
import random

import pytest

from engine.analysis.as_built import simulate_as_built
from engine.body.morphology import Morphology
from engine.control.operators import Neat
from engine.export import simulate_trial
from engine.fabrication.as_built import twin_of
from engine.fabrication.dimensions.feet import robot_feet
from engine.fabrication.materials import load_materials
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.simulation.provenance import versions
from engine.tasks import get_task
from viz.build_sheet.facts import ArchivePlace, Facts


@pytest.fixture(scope="session")
def materials():
    printed = load_materials("tpu-85a")
    # a filament and a printer with which only the softest modules are a problem
    return dataclasses.replace(
        printed,
        cable=dataclasses.replace(printed.cable, max_strain=1.4),
        printer=dataclasses.replace(printed.printer, nozzle=0.00045, bed_x=0.25, bed_y=0.25),
    )


@pytest.fixture(scope="session")
def robots(small_config, materials):
    """Facts of robots by number of modules; the larger one has feet, and modules of three stiffnesses."""
    trials = dataclasses.replace(small_config.trials, settle_time=1.0)
    small_config = dataclasses.replace(small_config, trials=trials)
    task = get_task(small_config.task)
    controller = Neat(n_inputs=task.n_inputs).random(random.Random(1))
    bodies = (
        Morphology(3, (8, 5)),
        Morphology((7, 7, 2, 7, 9, 7, 7, 7, 7, 2), (3, 3, 7, 3, 1, 8, 8, 2, 3, 8), feet="start"),
    )
    found = {}
    for number, body in enumerate(bodies):
        mode = dataclasses.replace(small_config, stiffness=body.stiffness_mode)
        evaluator = LocalEvaluator(
            task=task, physics=mode.physics, trials=mode.trials, run_seed=mode.seed, n_threads=1
        )
        solution = Solution(number=number, morphology=body, controller=controller)
        ((evaluation,),) = evaluator.evaluate([solution])
        plan = robot_feet(mode, evaluation)
        twin = twin_of(mode.physics, body, materials, feet=plan.feet)
        as_built = simulate_as_built(
            mode,
            evaluation,
            nominal=twin.nominal,
            robots=twin.samples(2),
            alone=twin.alone(),
            pairs=twin.feet_pairs(),
            n_seeds=1,
        )
        found[body.n_modules] = Facts(
            run_name="a run <&> with ünusual → name",
            date="2026-11-24",
            place=ArchivePlace(archive="morphology", cell=(body.n_modules - 2, 2)),
            config=mode,
            evaluation=evaluation,
            trial=simulate_trial(mode, evaluation),
            robust=None,
            versions=versions(),
            twin=twin,
            as_built=as_built,
            feet=plan,
        )
    return found
