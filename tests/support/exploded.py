"""A run whose robots fly apart."""

from __future__ import annotations

from pathlib import Path

import pytest

from engine.config import preset, replaced
from engine.runs import evolve as run
from engine.simulation.physics import Physics
from engine.simulation.trials import TrialConfig
from engine.storage.schema import failures_folder

EXPLOSIVE = Physics(simulator="mujoco", timestep=0.004)
"""A time step that the cables' damping does not bear; evolving refuses it. Dumps of MuJoCo's are longer."""


def evolve(path: Path) -> list[Path]:
    """Evolve four robots; return the dumps of those that failed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("engine.runs.evolve.check_timestep", lambda _physics: None)
        config = replaced(
            preset("smoke"),
            evaluations=4,
            initial=2,
            batch_size=2,
            seed=2,
            physics=EXPLOSIVE,
            trials=TrialConfig(repeats=1, settle_time=0.6, open_loop_time=0.4, trial_time=1.0),
        )
        run.evolve(path, config, n_threads=2)
    return sorted(failures_folder(path).iterdir())
