"""The command line as a user types it: one command after another, and what is true of all of them."""

from __future__ import annotations

import csv
import dataclasses
import importlib
import json
import os
import pkgutil
import re
import sqlite3
from pathlib import Path

import pytest

from app import cli
from app.cli.main import COMMANDS
from engine.storage.reader import RunReader
from engine.tasks import BUILT_IN
from tests.support.command_line import TINY, Command


def test_evolve_info_resume_export(tensatlas: Command, tmp_path: Path) -> None:
    status, _, err = tensatlas("evolve", "a.tsmr", *TINY, "--workers", 1)
    assert (status, "Finished" in err) == (0, True)
    status, out, _ = tensatlas("info", "a.tsmr", "--json")
    facts = json.loads(out)
    assert (status, facts["evaluations"], facts["budget"], facts["live"]) == (0, 6, 6, False)
    assert facts["config"]["seed"] == 5

    assert tensatlas("evolve", "b.tsmr", *TINY, "--workers", 2)[0] == 0
    assert json.loads(tensatlas("info", "b.tsmr", "--json")[1])["hash"] == facts["hash"]

    assert tensatlas("resume", "a.tsmr")[0] == 0
    assert json.loads(tensatlas("info", "a.tsmr", "--json")[1])["hash"] == facts["hash"]

    with RunReader(tmp_path / "a.tsmr") as reader:
        cell, number = next(iter(reader.placements("morphology", 1).items()))
    status, _, err = tensatlas("export", "a.tsmr", "--cell", "{},{}".format(*cell), "--out", "robot")
    assert (status, f"robot {number}" in err) == (0, True)
    assert {"robot.xml", "genotype.json", "bill_of_materials.csv", "README.md"} <= set(os.listdir("robot"))
    # a second export into it would overwrite something
    status, _, err = tensatlas("export", "a.tsmr", "--cell", "{},{}".format(*cell), "--out", "robot")
    assert (status, err.count("\n")) == (2, 1)


def test_a_cell_of_five_axes_is_exported_and_verified(tensatlas: Command, tmp_path: Path) -> None:
    options = "--algorithm map-elites --stiffness per-module --workers 1".split()
    assert tensatlas("evolve", "a.tsmr", *TINY, *options)[0] == 0
    _, out, _ = tensatlas("info", "a.tsmr", "--json")
    assert list(json.loads(out)["archives"]) == ["grid"]
    with RunReader(tmp_path / "a.tsmr") as reader:
        cell, number = next(iter(reader.placements("grid", 1).items()))
        body = reader.evaluation(number).solution.morphology
    assert len(cell) == 5
    where = ("--archive", "grid", "--cell", ",".join(map(str, cell)))
    status, _, err = tensatlas("export", "a.tsmr", *where, "--out", "robot")
    assert (status, f"robot {number}" in err) == (0, True)
    # the nets of each stiffness are on a line of their own
    with open("robot/bill_of_materials.csv", newline="") as f:
        nets = [row for row in csv.DictReader(f) if row["part"].startswith("net")]
    levels = sorted(set(body.stiffness_levels))
    assert len(levels) > 1
    assert [row["part"] for row in nets] == [f"net_stiffness_{k / 10:.1f}" for k in levels]
    for row, level in zip(nets, levels, strict=True):
        modules = [i for i, own in enumerate(body.stiffness_levels, 1) if own == level]
        assert int(row["quantity"]) == len(modules)
        assert row["note"].endswith(f"; modules {', '.join(map(str, modules))}")
    assert body.stiffness_text.replace(" ", ", ") in Path("robot/README.md").read_text()
    status, out, _ = tensatlas("verify", "a.tsmr", *where, "--seeds", 1, "--workers", 1)
    assert (status, f"stiffness {body.stiffness_text}" in out) == (0, True)
    assert "identical to what was recorded" in out

    for wrong, reason in (
        (("--cell", "3,7"), "has no morphology archive; choose with --archive: grid"),
        (("--archive", "grid", "--cell", "3,7"), "has 5 indices (0..8, 0..9, 0..9, 0..8, 0..9), not 2: 3,7"),
        (("--archive", "grid", "--cell", "0,9,0,0,0"), "is empty"),
    ):
        status, _, err = tensatlas("export", "a.tsmr", *wrong, "--out", "other")
        assert (status, err.count("\n")) == (2, 1)
        assert reason in err


def test_a_deep_grid_shows_the_best_of_each_cell(tensatlas: Command, tmp_path: Path) -> None:
    more = "--evaluations 12 --initial 8 --trials.trial-time 1 --cell-capacity 3 --workers 1".split()
    assert tensatlas("evolve", "a.tsmr", *TINY, *more)[0] == 0
    with RunReader(tmp_path / "a.tsmr") as reader:
        members, placed = reader.members("controller"), reader.placements("controller", 2)
        assert sorted(n for there in members.values() for n in there) == list(range(12))
        assert max(map(len, members.values())) > 1
        for cell, there in members.items():
            assert placed[cell] == min(there, key=lambda n: (reader.evaluation(n).fitness or 9.0, n))
    status, _, err = tensatlas("evolve", "b.tsmr", *TINY, "--cell-capacity", 3, "--algorithm", "map-elites")
    assert (status, err.count("\n"), "is for dm-me only" in err) == (2, 1, True)


def test_bare_command_prints_help(tensatlas: Command) -> None:
    status, out, _ = tensatlas()
    assert status == 0
    commands = "explore evolve resume campaign info export drive record page replay-dump replay-log"
    commands += " verify reevaluate compare table project doctor recover migrate slim"
    assert re.findall(r"^[│ ]+• ([a-z-]+) ", out, flags=re.MULTILINE) == commands.split()


def test_every_command_is_in_the_list() -> None:
    found = set()
    for module in pkgutil.iter_modules(cli.__path__):
        for name, kind in vars(importlib.import_module(f"app.cli.{module.name}")).items():
            if dataclasses.is_dataclass(kind) and hasattr(kind, "run") and not name.startswith("_"):
                found.add(kind)
    assert found == set(COMMANDS)
    assert len(found) == len(COMMANDS)


def test_every_field_of_the_configuration_is_a_flag(tensatlas: Command) -> None:
    _, out, _ = tensatlas("evolve", "--help")
    # by their names, which scripts use
    groups = {
        "": "algorithm batch-size bonus cell-capacity controller-cells controller-share evaluations fill"
        " head-search initial"
        " overlap parents preset reevaluations refit-generations seed sensors sensory stiffness task",
        "variation.": "morphology-weight controller-weight both-weight exchange-weight switch-weight"
        " donors crossover",
        "body.": "feet feet-toward feet-axis",
        "variation.body.": "body-rate face-rate feet-rate module-rate",
        "variation.neat.": "bias-power bias-rate bias-replace hidden link-add link-remove link-toggle"
        " neuron-add neuron-remove version weight-power weight-rate weight-replace",
        "trials.": "open-loop-time repeats settle-time trajectory-bits trial-time unfed-outputs",
        "physics.": "contact-damping contact-time control-period feet-backward feet-forward friction impratio"
        " inertia-scale rod-inertia servo-noise simulator timestep",
        "vie-neat.": "boundary-rate compatibility-threshold controllers elitism maximise morphologies mutants"
        " species-elitism",
    }
    flags = {prefix + name for prefix, names in groups.items() for name in names.split()}
    flags |= {"config", "as-built", "spread"}
    flags |= {"from", "pool", "scheduler", "slurm", "timeout", "workers"}  # what computes
    shown = re.findall(r"^[│ ]+--([a-z][a-z.-]+)[ ,]", out, flags=re.MULTILINE)
    assert set(shown) == flags
    assert len(shown) == len(flags)


def test_a_run_is_described_by_a_file_and_flags_win_over_it(tensatlas: Command, tmp_path: Path) -> None:
    described = ["preset = 'smoke'", "evaluations = 6", "initial = 4", "batch_size = 2", "[trials]"]
    described += ["repeats = 1", "trial_time = 1.0", "settle_time = 0.2", "open_loop_time = 0.2"]
    (tmp_path / "run.toml").write_text("\n".join(described))
    one = ["--config", "run.toml", "--seed", 5, "--workers", 1]
    assert tensatlas("evolve", "a.tsmr", *one)[0] == 0
    status, text, _ = tensatlas("info", "a.tsmr", "--config")
    assert (status, "seed = 5\n" in text, "repeats = 1\n" in text) == (0, True, True)
    (tmp_path / "again.toml").write_text(text)
    # the file that the run itself gives repeats it, whatever the preset; its evaluations are left as they are
    assert (
        tensatlas("evolve", "b.tsmr", "--config", "again.toml", "--preset", "paper", "--workers", 1)[0] == 0
    )
    with RunReader(tmp_path / "a.tsmr") as a, RunReader(tmp_path / "b.tsmr") as b:
        assert a.config == b.config
        assert (a.config.seed, a.config.evaluations, a.config.trials.repeats) == (5, 6, 1)
        assert a.canonical_hash() == b.canonical_hash()
    status, out, err = tensatlas("evolve", "c.tsmr", "--config", "run.toml", "--trials.repeats", 0)
    assert (status, out, err.count("\n"), "repeats" in err) == (2, "", 1, True)


def test_the_help_lists_the_tasks(tensatlas: Command) -> None:
    _, out, _ = tensatlas("evolve", "--help")
    assert all(name in out for name in BUILT_IN)


BAD_RUNS = {
    "missing.tsmr": (None, "does not exist"),
    "empty.tsmr": (b"", "is empty"),
    "text.tsmr": (b"hello " * 100, "is not a TensAtlas run file"),
    "short.tsmr": (b"SQLite format 3\0", "is not a TensAtlas run file"),
}


@pytest.mark.parametrize(
    "command",
    ["info", "resume", "explore", "export", "verify", "table", "project", "compare", "reevaluate", "page"],
)
@pytest.mark.parametrize("name", [*BAD_RUNS, "cut.tsmr", "foreign.tsmr", "newer.tsmr"])
def test_bad_run_files_get_one_line(
    tensatlas: Command, tmp_path: Path, small_run: Path, command: str, name: str
) -> None:
    path = tmp_path / name
    content, reason = BAD_RUNS.get(name, (None, ""))
    if content is not None:
        path.write_bytes(content)
    if name == "cut.tsmr":
        path.write_bytes(small_run.read_bytes()[:9000])
        reason = "is cut short"
    if name in ("foreign.tsmr", "newer.tsmr"):
        if name == "newer.tsmr":
            path.write_bytes(small_run.read_bytes())
        with sqlite3.connect(path) as db:
            db.execute("PRAGMA user_version = 99")
            db.execute("CREATE TABLE other (x)")
        db.close()
        reason = "newer TensAtlas" if name == "newer.tsmr" else "of another program"
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    extra = {
        "export": ["--cell", "0,0", "--out", "out"],
        "verify": ["--cell", "0,0"],
        "table": ["--out", "out.csv"],
        "project": ["--out", "out.tsmr"],
        "page": ["--out", "out.html"],
    }.get(command, [])
    status, out, err = tensatlas(command, name, *extra)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"tensatlas: {name}")
    assert reason in err
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ("evolve x.tsmr --preset fast", "choose from atlas, paper, quick, smoke"),
        ("evolve x.tsmr --preset quick --initial 700", "initial (700)"),
        ("evolve x.tsmr --evaluations 1", "evaluations"),
        ("evolve x.tsmr --batch-size 5", "even number"),
        ("evolve x.tsmr --refit-generations 5", "must include 0"),
        ("evolve x.tsmr --seed -1", "seed"),
        (
            "evolve x.tsmr --reevaluations 24",
            "reevaluations must be from 0 to less than batch_size (24), not 24",
        ),
        ("evolve x.tsmr --reevaluations 2 --cell-capacity 5", "a deep grid has its own rule"),
        ("evolve x.tsmr --controller-share 1.5", "controller_share must be from 0 to 1, not 1.5"),
        ("evolve x.tsmr --parents curiosity --cell-capacity 5", "a deep grid has its own rule"),
        (
            "evolve x.tsmr --controller-cells 0 9",
            "controller_cells must be two numbers from 1 to 50, not 0, 9",
        ),
        ("evolve x.tsmr --variation.neat.weight-rate 1.5", "weight_rate must be from 0 to 1, not 1.5"),
        ("evolve x.tsmr --variation.neat.weight-power -1", "weight_power must be from 0.001 to 30, not -1.0"),
        ("evolve x.tsmr --variation.neat.hidden 101", "hidden must be from 0 to 100, not 101"),
        ("evolve x.tsmr --variation.body.face-rate nan", "face_rate must be from 0 to 1, not nan"),
        ("evolve x.tsmr --variation.crossover 1.5", "crossover must be from 0 to 1, not 1.5"),
        ("evolve x.tsmr --variation.both-weight -1", "both_weight must be from 0 to 100, not -1"),
        ("evolve x.tsmr --workers 0", "workers"),
        ("evolve x.tsmr --physics.timestep 0.003", "whole number of time steps"),
        ("evolve x.tsmr --physics.timestep 0.005", "robots would fly apart"),
        ("evolve x.tsmr --trials.trial-time nan", "trial_time"),
        ("evolve x.txt", "ends in .tsmr"),
        ("evolve x.tsmr --config file/run.toml", "file/run.toml cannot be read"),
        ("evolve file/x.tsmr", "not a folder"),
        ("explore --port 99999", "port must be"),
        ("explore --host 203.0.113.1", "cannot listen on 203.0.113.1"),
    ],
)
def test_contradictions_get_one_line(tensatlas: Command, tmp_path: Path, arguments: str, reason: str) -> None:
    (tmp_path / "file").write_text("not a folder")
    status, out, err = tensatlas(*arguments.split())
    assert (status, out, err.count("\n")) == (2, "", 1), err
    assert reason in err
    assert os.listdir(tmp_path) == ["file"]
