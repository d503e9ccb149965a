"""Every benchmark once, in miniature; the figures of such short runs say nothing."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
import tyro

from benchmarks import agreement, attack, explorer, free_energy, simulation
from benchmarks.timing import machine, simulate, timed
from engine.body.morphology import Morphology
from engine.control.genome import Neat
from engine.simulation.physics import Physics, with_inertia


def test_simulation(capsys: pytest.CaptureFixture[str]) -> None:
    line = "--quick --batch 2 --sizes 2 --settle-time 0.2 --trial-time 1".split()
    status = simulation.main(tyro.cli(simulation.Arguments, args=line))
    out = capsys.readouterr().out
    assert out.startswith(machine())
    assert f"inertia_scale 1, time step {1000 * with_inertia(Physics(), 1.0).timestep:g} ms" in out
    assert "mixed batch of 2 robots, 8 simulations each" in out
    assert status == int("every goal reached" not in out)
    assert "diverged:" in out


def test_timing_changes_nothing_and_adds_up() -> None:
    body, controller = Morphology(5, (1, 2)), Neat(n_inputs=2).random(random.Random(0))
    run = simulate(body, controller, physics=Physics(), copies=2, settle_time=0.2, trial_time=1.0)
    with timed() as clock:
        again = simulate(body, controller, physics=Physics(), settle_time=0.2, trial_time=1.0)
    assert 0.0 < again.clock.stepping < again.clock.cpu <= clock.cpu
    assert 0.0 < run.clock.outside < 1.0
    assert run.n_steps == round(1.2 / Physics().timestep)
    assert np.array_equal(run.trajectory, again.trajectory)
    assert run.path >= run.net > 0.0
    assert not run.failed


def test_free_energy(small_run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = "--elites 1 --seeds 2 --passive 1 --passive-time 0.4".split()
    status = free_energy.main(tyro.cli(free_energy.Arguments, args=[str(small_run), *line]))
    out = capsys.readouterr().out
    assert "1 best elites of small.tsmr" in out
    assert status == 1  # a robot is still falling after 0.4 s
    assert out.count("falls short") >= 2
    assert "largest residual speed" in out


def test_agreement(capsys: pytest.CaptureFixture[str]) -> None:
    line = "--robots 2 --trial-time 1 --task squeezing".split()
    assert agreement.main(tyro.cli(agreement.Arguments, args=line)) == 0
    out = capsys.readouterr().out
    assert "4 heads differ at the end of 1 s by" in out
    assert "2 of 2 robots have the same head" in out


def test_attack(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    status = attack.main(attack.Arguments(quick=True))
    out = " ".join(capsys.readouterr().out.split())
    for figure in (
        "sends 20 at once",
        "sends 200 a second",
        "a new page in the meantime",
        "3 browsers that each click another robot",
        "empty maps",
        "lines on the terminal",
        "pipes among the runs",
        "end by SIGTERM",
        "the largest networks",
        "clicked and been closed",
    ):
        assert figure in out
    assert status == int("a figure falls short" in out)


def test_explorer(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "300")  # so that no figure's name is broken into lines
    status = explorer.main(explorer.Arguments(quick=True))
    out = " ".join(capsys.readouterr().out.split())
    for figure in (
        "the first click after the start",
        "clicked for the first time",
        "clicked again",
        "the end of the whole replay",
        "frames a second",
        "share of one core",
        "bytes per frame",
        "memory after",
        "opening a run of 600 evaluations",
        "maps of a live run",
        "end of a generation",
    ):
        assert figure in out
    assert status == int("a figure falls short" in out)
