"""Compiles the kernel's code for this processor, or loads it if that has been done.

Whatever the product simulates, evolving, replaying or changing a body, calls the same few entry points for
vectors of the processor's full width. ``python -m engine.simulation.compile_kernel`` compiles them before
anybody waits; so do ``make explore``, ``make test``, ``tensatlas doctor``, ``evolve`` and, in the background,
``tensatlas explore``.
"""

from __future__ import annotations

import random
import time
from pathlib import Path
from typing import Final

from engine.body.morphology import Morphology
from engine.control.operators import Neat
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.simulation.physics import Physics
from engine.simulation.trials import TrialConfig
from engine.tasks import GOAL_REACHING

NOTICE: Final = "Compiling the simulation for this processor: about half a minute"
_SHORTEST: Final = TrialConfig(repeats=1, settle_time=0.02, open_loop_time=0.02, trial_time=1.0)


def is_compiled() -> bool:
    """Whether the kernel's code for this processor is on disk, and whole; then it is loaded, in a second."""
    # Numba takes half a second to import
    from engine.simulation.kernel.lanes.kept import is_kept

    return kept_in() is not None and is_kept(compile_kernel)


def kept_in() -> Path | None:
    """Return the folder where compiled code is kept, None if it cannot be kept there."""
    from engine.simulation.kernel.lanes.compiling import cache_folder
    from engine.simulation.kernel.loop import closed_loop

    folder = cache_folder(Path(closed_loop.__file__))
    return None if folder is None else folder.parent


def compile_kernel() -> float:
    """Compile or load all that evaluations, replays and what-ifs call; return the CPU seconds it took.

    A robot is evaluated for that, as in a run.
    """
    before = time.process_time()
    solution = Solution(
        number=0,
        morphology=Morphology(5, (1, 1)),
        controller=Neat(n_inputs=GOAL_REACHING.n_inputs).random(random.Random(0)),
    )
    evaluator = LocalEvaluator(task=GOAL_REACHING, physics=Physics(), trials=_SHORTEST, run_seed=0)
    list(evaluator.evaluate([solution]))
    return time.process_time() - before


def main() -> None:
    """Compile, and say where the result is kept."""
    if not is_compiled():
        print(NOTICE, flush=True)
    seconds = compile_kernel()
    folder = kept_in()
    where = "it cannot be kept, so every start compiles it" if folder is None else f"it is kept in {folder}"
    print(f"The simulation is compiled ({seconds:.0f} CPU s); {where}")


if __name__ == "__main__":
    main()
