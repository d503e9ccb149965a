"""Strategies, and solutions and evaluations that cost nothing."""

import dataclasses
import functools
import random

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from engine.body.morphology import Morphology
from engine.config import RunConfig, preset, replaced
from engine.control.network import NetworkBatch
from engine.control.operators import Neat
from engine.search.map_search import MapSearchConfig
from engine.simulation.evaluation import Evaluation, Solution
from engine.simulation.trials import TrialConfig
from engine.tasks import GroundFrame, View
from engine.tasks.walls import Obstacles

N_TARGETS, N_REPEATS, N_SECONDS = 4, 2, 40

TINY = replaced(
    preset("smoke"),
    evaluations=10,
    initial=6,
    batch_size=2,
    trials=TrialConfig(repeats=1, settle_time=0.2, open_loop_time=0.2, trial_time=1.0),
)
"""A run of real simulations that takes seconds."""

MADE_UP = replaced(RunConfig(), evaluations=70, initial=20, batch_size=6, refit_generations=(0, 2, 5))
"""A run to be evaluated with made-up figures."""

STILL = {
    "weight_rate": 0.0,
    "weight_replace": 0.0,
    "bias_rate": 0.001,
    "bias_power": 0.001,
    "bias_replace": 0.0,
    "link_add": 0.0,
    "link_remove": 0.0,
    "link_toggle": 0.0,
    "neuron_add": 0.0,
    "neuron_remove": 0.0,
}
"""Rates at which NEAT changes next to nothing."""


def examples(n):
    """Settings of a property test with n examples, whatever else the machine is doing."""
    return settings(
        max_examples=n,
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
    )


morphologies = st.builds(
    Morphology,
    stiffness_level=st.integers(1, 10),
    faces=st.lists(st.integers(1, 8), min_size=2, max_size=10).map(tuple),
)


@st.composite
def per_module_morphologies(draw):
    """Return a strategy of bodies whose modules each have their own stiffness."""
    faces = draw(st.lists(st.integers(1, 8), min_size=2, max_size=10))
    levels = draw(st.lists(st.integers(1, 10), min_size=len(faces), max_size=len(faces)))
    return Morphology(tuple(levels), tuple(faces))


def evolved_controller(seed, n_mutations, n_inputs=2):
    """Return a random controller after a chain of mutations."""
    rng, neat = random.Random(seed), Neat(n_inputs=n_inputs)
    controller = neat.random(rng)
    for _ in range(n_mutations):
        controller = neat.mutate(controller, rng)
    return controller


def outputs(controller, *inputs):
    """Return the (samples, 20) outputs of one controller for some samples of its inputs."""
    return NetworkBatch([controller]).activate(np.array([inputs], dtype=float))[0]


def controllers(n_inputs=2):
    """Return a strategy of controllers with a history of up to 25 mutations."""
    return st.builds(
        evolved_controller,
        seed=st.integers(0, 2**32),
        n_mutations=st.integers(0, 25),
        n_inputs=st.just(n_inputs) if isinstance(n_inputs, int) else n_inputs,
    )


REFITS = (0, 2, 5)
"""Generations of ``map_search`` at which standardiser and PCA are fitted."""


def map_search(kind, seed, *, n_inputs=2, budget=12 + 6 * 8, **changes):
    """Return a search of a kind in miniature: nine generations, fitted three times.

    Args:
        kind: the algorithm's class.
        seed: of its draws.
        n_inputs, budget: as it takes them.
        changes: fields of ``MapSearchConfig`` and other arguments of the algorithm.
    """
    fields = {"initial": 12, "batch_size": 6, "refit_generations": REFITS} | changes
    names = {f.name for f in dataclasses.fields(MapSearchConfig)}
    config = MapSearchConfig(**{k: v for k, v in fields.items() if k in names})
    others = {k: v for k, v in fields.items() if k not in names}
    return kind(config, n_inputs=n_inputs, budget=budget, seed=seed, **others)


def nothing_else(numbers):
    """Recall evaluations where elites are all there is."""
    assert not numbers
    return {}


@functools.cache
def some_controller():
    """Return a controller for where any will do."""
    return evolved_controller(0, 0)


def evaluation(number=0, fitness=0.3, morphology=None, trajectory=None):
    """Return an evaluation with chosen figures."""
    return Evaluation(
        solution=Solution(
            number=number,
            morphology=morphology or Morphology(5, (1, 2)),
            controller=some_controller(),
        ),
        fitness=fitness,
        distances=np.full((N_TARGETS, N_REPEATS), 0.3),
        trajectory=np.zeros((N_TARGETS, N_SECONDS, 2), np.float32) if trajectory is None else trajectory,
        head_is_end=True,
        failure="made up" if fitness is None else None,
    )


def made_up_evaluation(solution, *, salt=0, failing=0.0):
    """Evaluate a solution: random walks of very different speeds, some failures if asked for."""
    rng = np.random.default_rng([solution.number, salt])
    speed = 0.01 * np.exp(rng.normal())
    steps = rng.normal(0.0, speed, size=(N_TARGETS, N_SECONDS, 2)) + speed * rng.normal(size=2)
    failed = rng.random() < failing
    return Evaluation(
        solution=solution,
        fitness=None if failed else float(rng.uniform(0.1, 0.6)),
        distances=rng.uniform(0.1, 0.6, size=(N_TARGETS, N_REPEATS)),
        trajectory=np.cumsum(steps, axis=1).astype(np.float32),
        head_is_end=bool(rng.random() < 0.5),
        failure="made up" if failed else None,
    )


class MadeUpEvaluator:
    """Evaluates three at a time, last ones first."""

    def evaluate(self, solutions):
        for i in reversed(range(0, len(solutions), 3)):
            yield [made_up_evaluation(s, failing=0.1) for s in solutions[i : i + 3]]


def evaluate(solutions, salt=0, failing=0.0):
    """Evaluate solutions with made-up figures."""
    return [made_up_evaluation(s, salt=salt, failing=failing) for s in solutions]


def generation(algorithm, salt=0, failing=0.0):
    """Work through one generation and return its evaluations."""
    evaluations = evaluate(algorithm.ask(), salt, failing)
    algorithm.tell(evaluations)
    return evaluations


def sensed(evaluations):
    """Return the (n, 320) positions that evaluations are described by."""
    return np.array([e.trajectory.astype(float).ravel() for e in evaluations])


def describe(algorithm, evaluations):
    """Return what the state says the descriptors of evaluations are, whether inside, and their cells."""
    s = {k: np.array(v) for k, v in algorithm.state()["descriptor"].items()}
    described = (sensed(evaluations) - s["mean"]) / s["scale"] @ s["components"].T
    upper = s["lower"] + s["width"] * np.array([9, 10])
    inside = ((described >= s["lower"]) & (described < upper)).all(axis=1)
    cells = np.floor((described - s["lower"]) / s["width"]).astype(int)
    return described, inside, [tuple(map(int, c)) for c in cells]


def held(archives):
    """Return what archives hold: by name and cell the number of the elite."""
    return {name: {cell: e.solution.number for cell, e in archive} for name, archive in archives.items()}


def a_view(*, position, direction, target, walls=(), time=0.0, height=0.04):
    """Return what a task sees of one simulation whose settled head's frame is the world's."""
    front, facing, aim = (np.array(v, float)[None, None] for v in (position, direction, target))
    return View(
        front=front,
        rear=front - facing,
        target=aim,
        frame=GroundFrame(np.zeros((1, 1, 2)), np.eye(2)[None, None]),
        obstacles=Obstacles([walls]),
        time=time,
        rods=lambda: np.full((1, 1, 2, 6, 3), [*position, height]),
        height=lambda: np.full((1, 1), height),
    )
