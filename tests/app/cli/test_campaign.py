"""Campaigns: real runs in processes of their own."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from app.cli.main import main
from engine.storage.reader import RunReader

ROOT = Path(__file__).parents[3]
CAMPAIGN = """
preset = "smoke"
tasks = ["goal-reaching"]
algorithms = ["dm-me", "map-elites"]
seeds = [1]

[config]
evaluations = 10
initial = 6
batch_size = 2
refit_generations = [0]

[config.trials]
repeats = 1
settle_time = 0.2
open_loop_time = 0.2
"""


@pytest.fixture
def campaign(tmp_path):
    """Return a campaign's file and the folder that its runs go to."""
    file = tmp_path / "small.toml"
    file.write_text(CAMPAIGN)
    return file, tmp_path / "runs"


def command(campaign, *more):
    file, out = campaign
    return ["campaign", str(file), "--out", str(out), "--workers", "1", "--images", "none", *more]


def test_a_campaign_stopped_on_the_way_ends_in_a_report(campaign, capfd):
    _, out = campaign
    process = subprocess.Popen(
        [sys.executable, "-m", "app", *command(campaign)],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stderr=subprocess.PIPE,
    )
    first = out / "goal-reaching_dm-me_1.tsmr"
    deadline = time.monotonic() + 120
    while not first.exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGTERM)
    assert process.wait(120) == 130
    assert not (out / "report").exists()
    main(command(campaign, "--jobs", "2"))
    said = capfd.readouterr().err
    for name in ("dm-me", "map-elites"):
        path = out / f"goal-reaching_{name}_1.tsmr"
        assert path.with_suffix(".log").exists()
        with RunReader(path) as reader:
            assert reader.n_evaluations() == 10
    assert "2 runs in" in said
    assert (out / "report" / "report.html").exists()
    main(command(campaign, "--dry-run"))
    assert capfd.readouterr().err.count("is finished: 10 evaluations") == 2


def test_another_run_in_the_place_of_one_is_not_touched(campaign, small_run, capsys):
    _, out = campaign
    out.mkdir()
    path = out / "goal-reaching_dm-me_1.tsmr"
    path.write_bytes(small_run.read_bytes())
    with pytest.raises(SystemExit) as caught:
        main(command(campaign))
    assert caught.value.code == 2
    assert "another configuration" in capsys.readouterr().err
    assert path.read_bytes() == small_run.read_bytes()


def test_a_run_that_cannot_be_made_is_named_and_the_others_are(campaign, capsys):
    file, out = campaign
    variant = '[variants.coarse]\nalgorithm = "dm-me"\nphysics = {timestep = 0.02}\n'
    file.write_text(CAMPAIGN.replace('"dm-me"', '"coarse"') + variant)
    with pytest.raises(SystemExit) as caught:
        main(command(campaign))
    assert caught.value.code == 1
    said = capsys.readouterr().err.splitlines()
    (named,) = [line for line in said if line.startswith("tensatlas: ")]
    assert named.startswith("tensatlas: goal-reaching_coarse_1.tsmr: physics: timestep 0.02 s is too large")
    assert named.endswith(f"(see {out / 'goal-reaching_coarse_1.log'})")
    assert said[-1] == "The same command resumes what is unfinished."
    assert [p.name for p in out.glob("*.tsmr")] == ["goal-reaching_map-elites_1.tsmr"]
    with RunReader(out / "goal-reaching_map-elites_1.tsmr") as reader:
        assert reader.n_evaluations() == 10
    assert not (out / "report").exists()


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (("--jobs", "0"), "jobs must be at least 1"),
        (("--scheduler", "somewhere"), "tcp://HOST:PORT"),
        (("--scheduler", "tcp://a:1", "--slurm", "b.toml"), "choose one"),
        (("--workers", "0"), "workers must be from 1"),
    ],
)
def test_flags_out_of_range_get_one_line(campaign, capsys, flags, message):
    with pytest.raises(SystemExit) as caught:
        main(command(campaign, *flags))
    assert caught.value.code == 2
    assert message in capsys.readouterr().err
