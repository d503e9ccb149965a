"""A run with feet that grip one way, through the commands that a user types."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from app.cli.main import main
from engine.body.feet import FEET
from engine.fabrication.as_built.twin import FEET_PAIRS
from engine.fabrication.materials import preset_text
from engine.search.archive import cell_name
from engine.storage.reader import RunReader
from tests.support.run_hash import hash_of

Read = pytest.CaptureFixture[str]
COMMON = "--preset smoke --workers 1 --pool threads".split()


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("feet") / "feet.tsmr"
    main(["evolve", str(path), *COMMON, "--body.feet", "evolved", "--variation.body.feet-rate", "1"])
    return path


def test_every_kind_of_feet_is_there_and_mutates(run: Path) -> None:
    with RunReader(run) as reader:
        found = {e.solution.number: e.solution for _, e in reader.each_evaluation()}
    assert {s.morphology.feet for s in found.values()} == {"none", "start", "end"}
    changed = [
        s
        for s in found.values()
        if s.parent is not None and found[s.parent].morphology.feet != s.morphology.feet
    ]
    assert changed
    assert {s.operator for s in changed} <= {"morphology", "both"}


def test_info_names_them(run: Path, capsys: Read) -> None:
    main(["info", str(run)])
    out = " ".join(capsys.readouterr().out.split())
    assert "evolved (none or toward the start or toward the end), friction 0.3 forward, 0.8 backward" in out
    main(["info", str(run), "--json"])
    assert json.loads(capsys.readouterr().out)["feet"] == "evolved"


def test_a_table_has_them(run: Path, tmp_path: Path) -> None:
    main(["table", str(run), "--out", str(tmp_path / "t.csv")])
    with (tmp_path / "t.csv").open(encoding="utf-8") as f:
        bodies = [json.loads(row["solution_morphology"]) for row in csv.DictReader(f)]
    assert {b.get("feet") for b in bodies} == {None, "start", "end"}


def test_verify_says_what_mujoco_does_not_know(run: Path, capsys: Read) -> None:
    with RunReader(run) as reader:
        last = reader.last_generation()
        assert last is not None
        held = reader.contents("morphology", last)
        cell = next(c for c, e in held.items() if e.solution.morphology.feet == "start")
    main(["verify", str(run), "--cell", cell_name(cell), "--simulator", "mujoco", "--seeds", "1"])
    out = " ".join(capsys.readouterr().out.split())
    assert "feet toward the start" in out
    assert "identical to what was recorded" in out
    assert "MuJoCo knows no feet that grip one way" in out
    assert "Without feet, kernel" in out


def test_a_robot_is_verified_with_the_feet_that_were_measured(
    run: Path, tmp_path: Path, capsys: Read
) -> None:
    test = "[feet_test]\nforward_degrees = [20, 22]\nbackward_degrees = [35, 40]\n"
    (tmp_path / "mine.toml").write_text(preset_text("latex-sheet") + test, encoding="utf-8")
    with RunReader(run) as reader:
        held = reader.contents("morphology", reader.finished_generation().number)
        cell = next(c for c, e in held.items() if e.solution.morphology.feet == "end")
    few = ["--cell", cell_name(cell), "--as-built", "--samples", "1", "--seeds", "1"]
    main(["verify", str(run), *few, "--materials", str(tmp_path / "mine.toml"), "--json"])
    found = json.loads(capsys.readouterr().out)
    feet = next(d for d in found["deviations"] if d["key"] == "feet")
    assert (feet["origin"], feet["built"]) == ("measured", "0.38 forward, 0.77 backward")
    assert [(row["forward"], row["backward"]) for row in found["feet"]] == list(FEET_PAIRS)
    assert len({row["f_s_mean_cm"] for row in found["feet"]}) == len(FEET_PAIRS)


def test_directional_feet_change_nothing_but_how_robots_move(tmp_path: Path) -> None:
    short = [*COMMON, "--evaluations", "16"]
    main(["evolve", str(tmp_path / "plain.tsmr"), *short])
    main(["evolve", str(tmp_path / "none.tsmr"), *short, "--body.feet", "none"])
    toward = ["--body.feet", "directional", "--body.feet-toward", "start"]
    main(["evolve", str(tmp_path / "feet.tsmr"), *short, *toward])
    assert hash_of(tmp_path / "plain.tsmr") == hash_of(tmp_path / "none.tsmr")
    found = []
    for name in ("plain", "feet"):
        with RunReader(tmp_path / f"{name}.tsmr") as reader:
            found.append([e for _, e in reader.each_evaluation()])
    for plain, feet in zip(*found, strict=True):
        assert plain.solution.controller == feet.solution.controller
        assert plain.solution.morphology.faces == feet.solution.morphology.faces
        assert feet.solution.morphology.feet == "start"
        assert plain.distances.tobytes() != feet.distances.tobytes()


@pytest.mark.parametrize("algorithm", ["dm-me", "map-elites", "vie-neat"])
def test_feet_may_be_an_axis_of_the_maps(tmp_path: Path, algorithm: str, capsys: Read) -> None:
    path = tmp_path / "axis.tsmr"
    few = ["--algorithm", algorithm, *("" if algorithm == "vie-neat" else "--evaluations 16").split()]
    main(["evolve", str(path), *COMMON, *few, "--body.feet", "evolved", "--body.feet-axis"])
    archive = "grid" if algorithm == "map-elites" else "morphology"
    with RunReader(path) as reader:
        assert reader.config.body.feet_axis
        last = reader.finished_generation()
        names = [axis.name for axis in last.archives[archive].axes]
        assert names[:3] == ["modules", "stiffness", "feet"]
        held = reader.contents(archive, last.number)
        assert {cell[2] for cell in held} > {0}
        assert all(FEET[cell[2]] == e.solution.morphology.feet for cell, e in held.items())
    capsys.readouterr()
    main(["table", str(path), "--out", str(tmp_path / "t.csv")])
    with (tmp_path / "t.csv").open(encoding="utf-8") as f:
        assert {row["archive"] for row in csv.DictReader(f)} >= {archive}


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        ("--physics.feet-backward 0.2", "backward at least as large as forward"),
        ("--physics.feet-forward -1", "feet_forward must be positive"),
        ("--physics.feet-backward 6", "at most 5"),
        ("--body.feet evolved --physics.simulator mujoco", "knows no directional feet"),
        ("--variation.body.feet-rate 2", "feet_rate must be from 0 to 1"),
        (
            "--body.feet directional --body.feet-axis",
            "feet_axis is for feet that evolve; feet is directional",
        ),
    ],
)
def test_impossible_feet_get_one_line(tmp_path: Path, flags: str, said: str, capsys: Read) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["evolve", str(tmp_path / "x.tsmr"), "--preset", "smoke", *flags.split()])
    error = " ".join((capsys.readouterr().err or str(stopped.value.code)).split())
    assert said in error
    assert not list(tmp_path.iterdir())
