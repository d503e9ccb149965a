"""Every benchmark once, in miniature; the figures of such short runs say nothing."""

from __future__ import annotations

from pathlib import Path

import pytest
import tyro

from benchmarks import agreement, attack, explorer, free_energy, simulation
from benchmarks.timing import machine, timed
from engine.body.morphology import Morphology
from engine.simulation.evaluation import Solution
from engine.storage.layouts.plain import to_row
from engine.workers.evaluator import create_evaluator
from tests.support.made_up import TINY, some_controller


def test_simulation(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    trials = "--trials.settle-time 0.2 --trials.open-loop-time 0.2 --trials.trial-time 1"
    line = f"--sizes 2 --robots 1 --seconds 0.2 --batch 3 {trials}".split()
    status = simulation.main(tyro.cli(simulation.Arguments, args=line))
    out = capsys.readouterr().out
    assert out.startswith(machine())
    for figure in (
        "2 modules, squeezed",
        "operations of 2 modules that crawl: cables ",
        "an evaluation, 8 simulations of 1.2 s, of 3 robots",
        "share outside the kernel's compiled code",
        "price of the real inertia, 2 modules",
        "a run of preset quick on 2 cores",
        "a run of preset paper",
        "a whole replay of 1 s of 2 modules",
    ):
        assert figure in out
    assert "0 diverged" in out
    assert status == int("every figure is met" not in out)


def test_timing_changes_nothing_and_adds_up() -> None:
    evaluator = create_evaluator(TINY)
    solution = Solution(number=0, morphology=Morphology(5, (1, 2)), controller=some_controller())
    ((expected,),) = evaluator.evaluate([solution])
    with timed() as clock:
        ((found,),) = evaluator.evaluate([solution])
    assert to_row(0, found) == to_row(0, expected)
    assert 0.0 < clock.inside < clock.cpu
    assert 0.0 < clock.outside < 1.0
    before = clock.inside
    list(evaluator.evaluate([solution]))
    assert clock.inside == before


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
        "opening the first page until its robot moves",
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
