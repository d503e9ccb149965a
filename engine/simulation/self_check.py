"""Small simulations with a recorded outcome, to test whether an installation computes the right bits.

``python -m engine.simulation.self_check`` records them anew, after the physics has been changed on purpose.
"""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import json
import random
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.control.operators import Neat
from engine.simulation.evaluation import Evaluation, LocalEvaluator, Solution
from engine.simulation.physics import Physics
from engine.simulation.provenance import KNOWN_SIMULATION, body_fingerprint
from engine.simulation.trials import TrialConfig
from engine.tasks import GOAL_REACHING, SQUEEZING, Task
from engine.tasks.walls import Wall

TRIALS: Final = TrialConfig(repeats=1, settle_time=0.4, open_loop_time=0.4, trial_time=1.0, trajectory_bits=0)


def _corridor(_target: int, _n_modules: int) -> tuple[Wall, ...]:
    """Return walls that hold a robot between them and a step before it."""
    return (
        Wall(centre=(-0.1, 0.06, 0.06), half_size=(0.4, 0.02, 0.06), yaw=0.05),
        Wall(centre=(-0.1, -0.06, 0.06), half_size=(0.4, 0.02, 0.06)),
        Wall(centre=(0.02, 0.0, 0.01), half_size=(0.02, 0.05, 0.01), yaw=0.3),
    )


KNOWN: Final[tuple[tuple[Task, Morphology], ...]] = (
    (GOAL_REACHING, Morphology(1, (1, 8, 1))),
    (dataclasses.replace(SQUEEZING, walls=_corridor), Morphology(5, (1, 2, 3))),
)
"""What is simulated: a soft robot, whose rods touch each other, on the open plane, and one between walls."""
FOOTED: Final[tuple[tuple[Task, Morphology], ...]] = (
    (GOAL_REACHING, Morphology(2, (1, 2, 3), feet="end")),
    (GOAL_REACHING, Morphology(2, (8, 5), feet="start")),
)
"""The same with feet that grip one way. They have a digest of their own, because that of the others stands in
files of runs, and most of these have no feet."""


@dataclasses.dataclass(frozen=True, slots=True)
class Comparison:
    """The outcome on this computer, compared with the recorded one.

    Attributes:
        digest: of the outcome on this computer, of robots without feet.
        identical: whether it is the recorded one's.
        deviation: largest difference in m of a final distance or a head position.
        same_body: whether bodies are modelled as they were when it was recorded.
    """

    digest: str
    identical: bool
    deviation: float
    same_body: bool

    @property
    def good(self) -> bool:
        """Whether the outcome is the recorded one."""
        return self.same_body and self.identical


def compare() -> Comparison:
    """Simulate the recorded simulations again and compare."""
    known = json.loads(KNOWN_SIMULATION.read_text(encoding="utf-8"))
    records = known["simulations"], known["footed"]["simulations"]
    outcomes = [
        _simulate(which, [Controller.from_json(record["controller"]) for record in recorded])
        for which, recorded in zip((KNOWN, FOOTED), records, strict=True)
    ]
    deviations = [
        float(np.abs(found - np.array(record[name])).max())
        for e, record in zip(itertools.chain(*outcomes), itertools.chain(*records), strict=True)
        for name, found in (("distances", e.distances), ("trajectory", e.trajectory.astype(float)))
    ]
    deviation = max(deviations) if np.isfinite(deviations).all() else float("inf")
    plain, footed = map(_digest, outcomes)
    identical = (plain, footed) == (known["digest"], known["footed"]["digest"])
    return Comparison(plain, identical, deviation, known["body"] == body_fingerprint())


def record() -> None:
    """Record the present outcome."""
    plain, footed = _recorded(KNOWN, 0), _recorded(FOOTED, len(KNOWN))
    known = {"body": body_fingerprint(), **plain, "footed": footed}
    KNOWN_SIMULATION.write_text(json.dumps(known) + "\n", encoding="utf-8")


def _recorded(which: Sequence[tuple[Task, Morphology]], first_seed: int) -> dict[str, Any]:
    """Return the digest and the outcome of simulations with random controllers."""
    controllers = []
    for seed, (task, _) in enumerate(which, start=first_seed):
        rng, neat = random.Random(seed), Neat(n_inputs=task.n_inputs)
        controller = neat.random(rng)
        for _ in range(10):
            controller = neat.mutate(controller, rng)
        controllers.append(controller)
    outcome = _simulate(which, controllers)
    simulations: list[dict[str, Any]] = [
        {
            "controller": e.solution.controller.to_json(),
            "distances": e.distances.tolist(),
            "trajectory": e.trajectory.astype(float).tolist(),
        }
        for e in outcome
    ]
    return {"digest": _digest(outcome), "simulations": simulations}


def _simulate(
    which: Sequence[tuple[Task, Morphology]], controllers: Sequence[Controller]
) -> list[Evaluation]:
    outcome = []
    for (task, body), controller in zip(which, controllers, strict=True):
        evaluator = LocalEvaluator(task=task, physics=Physics(), trials=TRIALS, run_seed=0)
        solution = Solution(number=0, morphology=body, controller=controller)
        outcome.append(next(evaluator.evaluate([solution]))[0])
    return outcome


def _digest(outcome: Sequence[Evaluation]) -> str:
    """Return a digest of the bits of all final distances and head positions."""
    found = hashlib.sha256()
    for e in outcome:
        found.update(e.distances.astype("<f8").tobytes() + e.trajectory.astype("<f4").tobytes())
    return found.hexdigest()[:16]


if __name__ == "__main__":
    record()
