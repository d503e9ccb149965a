"""A robot and its sketch, compiled for this computer."""

import dataclasses
import subprocess
from pathlib import Path

import numpy as np
import pytest

from engine.body.morphology import Morphology
from engine.config import preset
from engine.fabrication.firmware.host_board import compiler
from tests.support.made_up import evaluation, evolved_controller

BENCH = Path(__file__).parent
BOARD = Path(__file__).parents[4] / "engine" / "data" / "firmware" / "board"
STRICT = ("-std=c++11", "-O1", "-Wall", "-Wextra", "-pedantic", "-Werror")


@pytest.fixture(scope="session")
def cxx():
    """The C++ compiler."""
    found = compiler()
    if found is None:
        pytest.skip("no C++ compiler; install one with: sudo apt install g++")
    return found


@pytest.fixture(scope="session")
def config():
    """A run with short trials."""
    usual = preset("smoke")
    return dataclasses.replace(
        usual, trials=dataclasses.replace(usual.trials, settle_time=0.4, trial_time=4.0)
    )


@pytest.fixture(scope="session")
def robot():
    """Return a made-up robot."""

    def make(n_modules=3, *, seed=4, n_mutations=60, n_inputs=2, head_is_end=False):
        made = evaluation(7, morphology=Morphology(5, (1, 2, 3, 4, 5, 6, 7, 8, 1, 2)[:n_modules]))
        controller = evolved_controller(seed, n_mutations, n_inputs=n_inputs)
        return dataclasses.replace(
            made,
            solution=dataclasses.replace(made.solution, controller=controller),
            head_is_end=head_is_end,
        )

    return make


@pytest.fixture
def build(tmp_path, cxx):
    """Compile a sketch with the bench; return a function that runs it."""

    def make(files, *flags):
        for name, content in files.items():
            (tmp_path / Path(name).name).write_bytes(content)
        program = tmp_path / "bench"
        paths = [f"-I{BOARD}", f"-I{tmp_path}", BENCH / "bench.cpp", "-o", program]
        done = subprocess.run([cxx, *STRICT, *flags, *paths], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

        def run(*arguments, given=b""):
            """Return the numbers that the bench gives and what the sketch prints."""
            done = subprocess.run(
                [program, *map(str, arguments)], input=given, capture_output=True, timeout=60
            )
            assert done.returncode == 0, done.stderr
            return np.frombuffer(done.stdout), done.stderr.decode().replace("\r", "")

        return run

    return make
