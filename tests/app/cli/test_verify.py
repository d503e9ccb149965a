"""``tensatlas verify`` as a user types it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.cli.main import main
from engine.search.archive import cell_name
from engine.storage.reader import RunReader


@pytest.fixture(scope="module")
def cell(small_run: Path) -> str:
    with RunReader(small_run) as reader:
        placed = reader.placements("controller", reader.last_generation() or 0)
        return cell_name(min(placed))


def test_a_table_for_people(small_run: Path, cell: str, capsys: pytest.CaptureFixture[str]) -> None:
    main(["verify", str(small_run), "--archive", "controller", "--cell", cell, "--seeds", "2"])
    out = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert f"controller cell {cell}" in out
    assert "identical" in out
    assert "not identical" not in out
    assert "ground contact" in out


def test_json_with_another_physics(small_run: Path, cell: str, capsys: pytest.CaptureFixture[str]) -> None:
    extra = "--inertia-scale 5 --timestep-factor 0.5 --seeds 2 --json --workers 2".split()
    main(["verify", str(small_run), "--archive", "controller", "--cell", cell, *extra])
    facts = json.loads(capsys.readouterr().out)
    assert facts["identical"] is True
    assert facts["recorded"]["f_s_cm"] == pytest.approx(45.0 - 100.0 * facts["recorded"]["fitness_m"])
    assert facts["own"]["recorded_noise"]["distances_m"] == facts["recorded"]["distances_m"]
    physics = facts["changed"]["physics"]
    assert physics["inertia_scale"] == 5.0
    assert physics["timestep"] < facts["own"]["physics"]["timestep"] / 2
    assert len(facts["changed"]["fresh_noise"]) == 2
    assert facts["changed"]["motion"]["height_m"] > 0.0


def test_the_chosen_time_step_is_named(
    small_run: Path, cell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    extra = "--inertia-scale 5 --seeds 1".split()
    main(["verify", str(small_run), "--archive", "controller", "--cell", cell, *extra])
    assert "time step follows the inertia" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ("--cell 99,0", "lies outside"),
        ("--cell a,b", "written like 3,7"),
        ("--cell CELL --seeds 0", "seeds must be"),
        ("--cell CELL --workers 0", "workers must be"),
        ("--cell CELL --inertia-scale -1", "inertia_scale must be positive"),
        ("--cell CELL --timestep-factor 0.3", "whole number of time steps"),
        ("--cell CELL --timestep-factor 2", "too large"),
        ("--cell EMPTY", "is empty"),
        ("", "--cell, or --best"),
        ("--cell CELL --best 3 --as-built", "--cell, or --best"),
        ("--best 3", "--best needs --as-built"),
        ("--best 0 --as-built", "best must be at least 1"),
        ("--cell CELL --as-built --samples 0", "samples must be"),
        ("--cell CELL --as-built --materials none.toml", "none.toml"),
        ("--cell CELL --as-built --simulator mujoco", "does not go with"),
    ],
)
def test_mistakes_get_one_line(
    small_run: Path, cell: str, arguments: str, reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with RunReader(small_run) as reader:
        last = reader.generations()[-1]
        placed = reader.placements("controller", last.number)
    columns, rows = (a.n for a in last.archives["controller"].axes)
    empty = next((i, j) for i in range(columns) for j in range(rows) if (i, j) not in placed)
    line = arguments.replace("CELL", cell).replace("EMPTY", cell_name(empty)).split()
    with pytest.raises(SystemExit) as stopped:
        main(["verify", str(small_run), "--archive", "controller", *line])
    out, err = capsys.readouterr()
    assert (stopped.value.code, out, err.count("\n")) == (2, "", 1)
    assert reason in err


def test_as_built_for_people(small_run: Path, cell: str, capsys: pytest.CaptureFixture[str]) -> None:
    extra = "--as-built --materials latex-sheet --samples 3 --seeds 1".split()
    main(["verify", str(small_run), "--archive", "controller", "--cell", cell, *extra])
    out = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "3 robots of that design" in out
    assert "masses" in out
    assert "as built" in out


def test_the_best_as_built(small_run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    extra = "--archive controller --as-built --samples 1 --seeds 1 --best 2".split()
    main(["verify", str(small_run), *extra])
    head, rule, *rows = capsys.readouterr().out.splitlines()
    assert len(rows) == 2
    assert {line.count("|") for line in (head, rule, *rows)} == {9}
    main(["verify", str(small_run), *extra, "--json"])
    robots = json.loads(capsys.readouterr().out)["robots"]
    assert [f"| {r['cell']} | {r['number']} |" in row for r, row in zip(robots, rows, strict=True)] == [
        True,
        True,
    ]
    with RunReader(small_run) as reader:
        found = [reader.evaluation(r["number"]).fitness for r in robots]
        every = [e.fitness for e in reader.contents("controller", reader.last_generation() or 0).values()]
    assert found == sorted(f for f in every if f is not None)[:2]


def test_as_built_as_json(small_run: Path, cell: str, capsys: pytest.CaptureFixture[str]) -> None:
    extra = "--as-built --samples 2 --seeds 1 --json".split()
    main(["verify", str(small_run), "--archive", "controller", "--cell", cell, *extra])
    facts = json.loads(capsys.readouterr().out)
    assert len(facts["robots"]["f_s_cm"]) == 2
    assert {d["key"] for d in facts["deviations"]} > set(facts["costs_cm"])
    assert facts["materials"] == "latex-sheet"
