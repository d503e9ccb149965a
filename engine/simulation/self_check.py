"""A small simulation with a recorded outcome, to test whether an installation computes correctly.

``python -m engine.simulation.self_check`` records it anew, after the physics has been changed on purpose.
"""

from __future__ import annotations

import dataclasses
import json
import random
from pathlib import Path
from typing import Final

import mujoco
import numpy as np

from engine.body.morphology import Morphology
from engine.control.genome import Controller, Neat
from engine.simulation.evaluation import Evaluation, LocalEvaluator, Solution
from engine.simulation.physics import Physics
from engine.simulation.provenance import body_fingerprint
from engine.simulation.trials import TrialConfig
from engine.tasks import GOAL_REACHING

FILE: Final = Path(__file__).parents[1] / "data" / "known_simulation.json"
TOLERANCE: Final = 1e-4
"""Largest deviation in m that another instruction set may cause in this short time."""
TRIALS: Final = TrialConfig(repeats=1, settle_time=0.4, open_loop_time=0.4, trial_time=1.0, trajectory_bits=0)


@dataclasses.dataclass(frozen=True, slots=True)
class Comparison:
    """The outcome on this computer, compared with the recorded one.

    Attributes:
        deviation: largest difference in m of a final distance or a head position.
        same_body: whether bodies are modelled as they were when it was recorded.
        recorded_with: the version of MuJoCo with which it was recorded.
    """

    deviation: float
    same_body: bool
    recorded_with: str

    @property
    def good(self) -> bool:
        """Whether the outcome agrees with the recorded one."""
        return self.same_body and self.deviation <= TOLERANCE


def compare() -> Comparison:
    """Simulate the recorded simulation again and compare."""
    known = json.loads(FILE.read_text(encoding="utf-8"))
    solution = Solution(
        number=0,
        morphology=Morphology.from_json(known["morphology"]),
        controller=Controller.from_json(known["controller"]),
    )
    e = _simulate(solution)
    deviation = max(
        float(np.abs(e.distances - known["distances"]).max()),
        float(np.abs(e.trajectory - np.array(known["trajectory"], np.float32)).max()),
    )
    if not np.isfinite(deviation):
        deviation = float("inf")
    return Comparison(deviation, known["body"] == body_fingerprint(), known["mujoco"])


def record() -> None:
    """Record the present outcome."""
    rng = random.Random(0)
    neat = Neat(n_inputs=GOAL_REACHING.n_inputs)
    controller = neat.random(rng)
    for _ in range(10):
        controller = neat.mutate(controller, rng)
    solution = Solution(number=0, morphology=Morphology(5, (1, 2, 3)), controller=controller)
    e = _simulate(solution)
    known = {
        "body": body_fingerprint(),
        "mujoco": mujoco.__version__,
        "morphology": solution.morphology.to_json(),
        "controller": controller.to_json(),
        "distances": e.distances.tolist(),
        "trajectory": e.trajectory.astype(float).tolist(),
    }
    FILE.write_text(json.dumps(known) + "\n", encoding="utf-8")


def _simulate(solution: Solution) -> Evaluation:
    evaluator = LocalEvaluator(task=GOAL_REACHING, physics=Physics(), trials=TRIALS, run_seed=0)
    return next(evaluator.evaluate([solution]))[0]


if __name__ == "__main__":
    record()
