"""The sketch, compiled for this computer with a stand-in for Arduino's headers, against the simulation."""

import dataclasses
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from engine.body import servo
from engine.body.morphology import Morphology
from engine.config import preset, task_of
from engine.control.network import NetworkBatch, silenced
from engine.fabrication.firmware import fill_in, firmware_files, pin_map, start_inputs
from engine.tasks import Task, get_task
from engine.tasks.view import distance_and_bearing
from tests.support.made_up import evaluation, evolved_controller

BENCH = Path(__file__).parent / "arduino"
COMPILER = shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")
FLAGS = ("-std=c++11", "-O1", "-Wall", "-Wextra", "-pedantic", "-Werror")
needs_compiler = pytest.mark.skipif(
    COMPILER is None, reason="no C++ compiler; install one with: sudo apt install g++"
)
CONFIG = dataclasses.replace(
    preset("smoke"), trials=dataclasses.replace(preset("smoke").trials, settle_time=0.4)
)


def robot(n_modules=3, *, seed=4, n_mutations=60, n_inputs=2, head_is_end=False):
    made = evaluation(7, morphology=Morphology(5, (1, 2, 3, 4, 5, 6, 7, 8, 1, 2)[:n_modules]))
    controller = evolved_controller(seed, n_mutations, n_inputs=n_inputs)
    return dataclasses.replace(
        made,
        solution=dataclasses.replace(made.solution, controller=controller),
        head_is_end=head_is_end,
    )


def build(folder, files, *, real="float", sensing=None):
    """Compile the sketch with a bench; return the program."""
    for name, content in files.items():
        (folder / Path(name).name).write_bytes(content)
    if sensing is not None:
        path = folder / "sensing.h"
        text, n = re.subn(r"inline bool senseTarget.*?\n}\n", lambda _: sensing, path.read_text(), flags=re.S)
        assert n == 1
        path.write_text(text)
    program = folder / f"bench_{real}"
    done = subprocess.run(
        [
            COMPILER,
            *FLAGS,
            f"-DTSMR_REAL={real}",
            f"-I{BENCH}",
            f"-I{folder}",
            BENCH / "bench.cpp",
            "-o",
            program,
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return program


def run(program, *arguments, numbers=()):
    """Return what the bench gives and what the sketch prints."""
    done = subprocess.run(
        [program, *map(str, arguments)],
        input=np.asarray(numbers, dtype=float).tobytes(),
        capture_output=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    return np.frombuffer(done.stdout), done.stderr.decode()


@needs_compiler
@pytest.mark.parametrize(
    ("real", "task", "n_modules", "head_is_end", "tolerance", "unfed"),
    [
        ("float", "goal-reaching", 10, True, 2e-5, "zero"),
        ("double", "squeezing", 2, False, 1e-13, "bias"),
    ],
)
def test_the_network_gives_what_the_simulation_computes(
    tmp_path, real, task, n_modules, head_is_end, tolerance, unfed
):
    trials = dataclasses.replace(CONFIG.trials, unfed_outputs=unfed)
    config, n_inputs = dataclasses.replace(CONFIG, task=task, trials=trials), get_task(task).n_inputs
    # after many mutations this network of two inputs has none left
    n_mutations = 20 if unfed == "zero" else 60
    made = robot(n_modules, n_mutations=n_mutations, n_inputs=n_inputs, head_is_end=head_is_end)
    program = build(tmp_path, firmware_files(config, made, run="mine"), real=real)
    rng = np.random.default_rng(3)
    inputs = rng.normal(size=(10_000, n_inputs)) * rng.choice([1.0, 60.0], size=(10_000, 1))
    given, _ = run(program, "network", numbers=inputs)
    given = given.reshape(10_000, 2 * n_modules, 2)
    outputs, gaits = given[:, :n_modules].reshape(10_000, -1), given[:, n_modules:]
    controller = silenced(made.solution.controller) if unfed == "zero" else made.solution.controller
    assert (controller is not made.solution.controller) == (unfed == "zero")
    network = NetworkBatch([controller], n_outputs=2 * n_modules)
    expected = network.activate(inputs[None])[0]
    np.testing.assert_allclose(outputs, expected, rtol=0, atol=tolerance)
    order = range(n_modules)[::-1] if head_is_end else range(n_modules)
    for column, options in ((0, servo.FREQUENCIES), (1, servo.PHASES)):
        chosen = servo.pick(options, expected[:, column::2])[:, list(order)]
        scaled = expected[:, column::2][:, list(order)] * len(options)
        # float may fall on the other side of a boundary, but only next to it
        inner = np.clip(np.round(scaled), 1, len(options) - 1)
        clear = np.abs(scaled - inner) > 4 * tolerance
        assert clear.mean() > 0.99
        np.testing.assert_allclose(gaits[..., column][clear], chosen[clear], rtol=1e-6)
    # the network is not a constant
    assert np.ptp(expected, axis=0).max() > 0.1


SENSING = """inline bool senseTarget(tsmr::real *distance, tsmr::real *bearing) {
  static int asked = 0;
  const tsmr::real t = asked++ * tsmr::real(0.02);
  // a head that wanders past the target, while the tracker is blind for a while
  const tsmr::real y = tsmr::real(0.1) * t / 60;
  tsmr::towards(t / 100, y, t / 20, tsmr::real(0.3), tsmr::real(0.1), distance, bearing);
  return !(t > tsmr::real(20.01) && t < tsmr::real(25.01));
}
"""


@needs_compiler
@pytest.mark.parametrize(("sensors", "seed"), [("centimetres", 45), ("relative", 71)])
def test_the_sketch_commands_the_servos_as_the_simulation_does_for_a_minute(tmp_path, sensors, seed):
    # the target makes this controller change its gait several times
    made = robot(4, seed=seed, n_mutations=0, head_is_end=True)
    config = dataclasses.replace(CONFIG, sensors=sensors)
    program = build(tmp_path, firmware_files(config, made, run="mine"), sensing=SENSING)
    pulses, printed = run(program, "sketch", 60.4)
    settling, n = 20, 3000
    pulses = pulses.reshape(-1, 4)
    assert len(pulses) == settling + n
    # control begins at update 20, 0.4 s after go
    np.testing.assert_array_equal(pulses[: settling - 1], 1000)

    time = 0.02 * np.arange(n + 1)
    head = np.stack([time / 100, 0.1 * time / 60], axis=-1)
    direction = np.stack([np.cos(time / 20), np.sin(time / 20)], axis=-1)
    distance, bearing = distance_and_bearing(head, direction, np.array([0.3, 0.1]))
    inputs = np.stack([distance, bearing], axis=-1) * task_of(config).units
    blind = (time > 20.01) & (time < 25.01)
    last = np.flatnonzero(~blind & (time < 20.01))[-1]
    inputs[blind] = np.where(
        (time[blind] - time[last] <= 1.0 + 1e-9)[:, None], inputs[last], start_inputs(config, made)
    )
    outputs = NetworkBatch([made.solution.controller], n_outputs=8).activate(inputs[None])[0]
    frequency = servo.pick(servo.FREQUENCIES, outputs[:, 0::2])
    phase = servo.pick(servo.PHASES, outputs[:, 1::2])
    command = np.array(
        [servo.command_angle(f, p, 0.4 + s) for f, p, s in zip(frequency, phase, time, strict=True)]
    )[:, ::-1]
    expected = 1000 + 1000 * command / 180
    assert np.abs(pulses[settling - 1 :] - expected).max() < 0.51
    # every module moves, and what the robot senses changes what it does
    assert np.ptp(pulses, axis=0).min() > 900
    assert len(np.unique(np.concatenate([frequency, phase], axis=1), axis=0)) > 3
    assert re.findall("sensing the target|no target: open loop", printed) == [
        "sensing the target",
        "no target: open loop",
        "sensing the target",
    ]


@needs_compiler
def test_bench_button_and_cable_lengths(tmp_path):
    program = build(tmp_path, firmware_files(CONFIG, robot(2), run="*/ \\"), real="double")
    given, printed = run(program, "hands")
    assert given.reshape(2, 2).tolist() == [[2000.0, 2.0], [2000.0, 3.0]]
    lines = printed.splitlines()
    assert [line for line in lines if line.startswith(("going", "stopped"))] == [
        "going: first at rest, then crawling",
        "stopped, cables released",
    ]
    assert f"cable to node 10 should measure, in mm: {1000 * servo.TARGET_LENGTHS[180, 0]:.2f}" in lines
    degrees = np.linspace(-5.0, 190.0, 400)
    lengths, _ = run(program, "lengths", numbers=degrees)
    np.testing.assert_allclose(
        lengths.reshape(-1, 5) / 1000, servo.target_lengths(degrees), rtol=0, atol=1e-8
    )


@needs_compiler
def test_a_task_of_ones_own_has_its_inputs_named(tmp_path, monkeypatch):
    task = Task(
        name="mine",
        inputs=("light */ left", "light right \\"),
        sense=lambda view: np.stack([view.distance, view.distance], axis=-1),
        target_distance=0.3,
        target_bearings=(0.0,),
        units=(1.0, 2.5),
    )
    monkeypatch.setattr("engine.fabrication.firmware.task_of", lambda _: task)
    monkeypatch.setattr("engine.replay.replay.task_of", lambda _: task)
    files = firmware_files(CONFIG, robot(2), run="mine")
    assert "inputs[0]: light * / left\n" in files["tsmr_robot/sensing.h"].decode()
    assert "inputs[1]: light right /, times 2.5\n" in files["tsmr_robot/sensing.h"].decode()
    assert "START_INPUTS[INPUTS] = {0.3, 0.75};" in files["tsmr_robot/controller.h"].decode()
    build(tmp_path, files)


def test_the_pin_map_is_what_the_settings_say():
    files = firmware_files(CONFIG, robot(10), run="mine")
    lines = re.findall(r"\{(\d+), 1000, 2000\},  // module (\d+)", files["tsmr_robot/settings.h"].decode())
    assert {int(m) - 1: int(pin) for pin, m in lines} == pin_map(10)
    assert files == firmware_files(CONFIG, robot(10), run="mine")


def test_a_template_that_names_nothing_known_is_a_fault():
    assert fill_in("a @b@ c", {"b": 1}) == "a 1 c"
    with pytest.raises(KeyError):
        fill_in("@unknown@", {})
