"""What describes SLURM jobs: the file, and the job script that comes of it."""

from pathlib import Path

import pytest
from dask_jobqueue import SLURMCluster

import engine
from engine.errors import InvalidData
from engine.workers.slurm import MARGIN, lifetime, read_settings, slurm_cluster

GOOD = """
jobs = 3
cores = 4
memory = "8GB"
walltime = "08:00:00"
queue = "short"
directives = ["--constraint=avx2"]
prologue = ["source ~/venv/bin/activate"]
"""


def test_the_job_script_has_what_the_file_says(tmp_path, monkeypatch):
    file = tmp_path / "slurm.toml"
    file.write_text(GOOD)
    monkeypatch.setenv("PYTHONPATH", "/of/others")
    asked = {}
    monkeypatch.setattr(SLURMCluster, "scale", lambda _self, *_, **sizes: asked.update(sizes))
    cluster, _ = slurm_cluster(file)
    with cluster:
        script = cluster.job_script()
    assert asked == {"jobs": 3}
    for line in ("#SBATCH -p short", "#SBATCH -t 08:00:00", "#SBATCH --constraint=avx2", "#SBATCH -n 1"):
        assert line in script.splitlines()
    assert "#SBATCH --cpus-per-task=4" in script.splitlines()
    assert "source ~/venv/bin/activate" in script.splitlines()
    # nobody else's engine is found first, in the folder that the jobs are sent from or elsewhere
    assert "export PYTHONSAFEPATH=1" in script.splitlines()
    assert f"export PYTHONPATH={Path(engine.__file__).parents[1]}:/of/others" in script.splitlines()
    assert "--nworkers 4" in script
    assert "--nthreads 1" in script
    assert f"--lifetime {8 * 3600 - MARGIN}s" in script


@pytest.mark.parametrize(
    ("walltime", "seconds"),
    [("00:10:00", 600), ("08:00:00", 28800), ("1-02:03:04", 93784), ("100:00:00", 360000)],
)
def test_a_worker_leaves_before_its_walltime(walltime, seconds):
    assert lifetime(walltime) == seconds - MARGIN


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("jobs = 3", "", "jobs is missing"),
        ("jobs = 3", "jobs = 0", "jobs must be from 1"),
        ("jobs = 3", "jobs = true", "jobs must be a whole number"),
        ("cores = 4", "cores = -1", "cores must be from 1"),
        ('"8GB"', "8", "memory must be a text"),
        ('"08:00:00"', '"8h"', "walltime must be written"),
        ('"08:00:00"', '"00:05:00"', "walltime must be at least"),
        ('["--constraint=avx2"]', "[1]", "directives must be a list of texts"),
        ("queue", "que", "unknown 'que'"),
        ("jobs = 3", "jobs = ", "slurm.toml"),
    ],
)
def test_a_mistake_in_the_file_gets_one_line(tmp_path, old, new, message):
    file = tmp_path / "slurm.toml"
    file.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(InvalidData, match=message) as caught:
        read_settings(file)
    assert "slurm.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InvalidData, match=r"nowhere.toml cannot be read"):
        read_settings(tmp_path / "nowhere.toml")
