"""The sketch, compiled for this computer with a stand-in for Arduino's headers, against the simulation."""

import dataclasses
import re

import numpy as np
import pytest

from engine.body import servo
from engine.config import task_of
from engine.control.network import NetworkBatch, silenced
from engine.errors import InvalidData
from engine.fabrication.firmware import fill_in, firmware_files, pin_map, sketch
from engine.fabrication.firmware.gaits import RecordedGait
from engine.fabrication.firmware.protocol import Hello, sensed_line
from engine.tasks import Task, get_task
from engine.tasks.view import distance_and_bearing


@pytest.fixture
def unsimulated(monkeypatch):
    """Tests of the network need no gaits, which take a simulation."""
    gait = RecordedGait(0, 0.1, np.array([0]), np.zeros((1, 10), int))

    def made(_config, evaluation, _physics):
        n = evaluation.solution.morphology.n_modules
        return [dataclasses.replace(gait, choices=gait.choices[:, :n])]

    monkeypatch.setattr(sketch, "recorded_gaits", made)


@pytest.mark.parametrize(
    ("real", "task", "n_modules", "head_is_end", "tolerance", "unfed"),
    [
        ("float", "goal-reaching", 10, True, 2e-5, "zero"),
        ("double", "squeezing", 2, False, 1e-13, "bias"),
    ],
)
def test_the_network_gives_what_the_simulation_computes(
    unsimulated, build, config, robot, real, task, n_modules, head_is_end, tolerance, unfed
):
    trials = dataclasses.replace(config.trials, unfed_outputs=unfed)
    config, n_inputs = dataclasses.replace(config, task=task, trials=trials), get_task(task).n_inputs
    # after many mutations this network of two inputs has none left
    n_mutations = 20 if unfed == "zero" else 60
    made = robot(n_modules, n_mutations=n_mutations, n_inputs=n_inputs, head_is_end=head_is_end)
    # the float one also with the headers that an ESP32 has
    run = build(
        firmware_files(config, made, run="mine"), f"-DTSMR_REAL={real}", *["-DESP32"] * (real == "float")
    )
    rng = np.random.default_rng(3)
    inputs = rng.normal(size=(10_000, n_inputs)) * rng.choice([1.0, 60.0], size=(10_000, 1))
    given, _ = run("network", given=inputs.tobytes())
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


@pytest.mark.parametrize(("sensors", "seed"), [("centimetres", 45), ("relative", 71)])
def test_a_host_steers_the_servos_as_the_simulation_does(unsimulated, build, config, robot, sensors, seed):
    # the target makes this controller change its gait several times
    made = robot(4, seed=seed, n_mutations=0, head_is_end=True)
    config = dataclasses.replace(config, sensors=sensors)
    run = build(firmware_files(config, made, run="mine"), "-DTSMR_REAL=double")
    # a head that wanders past the target for a minute, told at every update and then no longer
    time = 0.02 * np.arange(3000)
    head = np.stack([time / 100, 0.1 * time / 60], axis=-1)
    direction = np.stack([np.cos(time / 20), np.sin(time / 20)], axis=-1)
    sensed = np.stack(distance_and_bearing(head, direction, np.array([0.3, 0.1])), axis=-1)
    lines = ["0 g", *(f"{399 if k == 0 else 20} {sensed_line(s)}" for k, s in enumerate(sensed)), "2000 s"]
    pulses, printed = run("host", given="\n".join(lines).encode())
    settling = 20
    pulses = pulses.reshape(-1, 4)
    # control begins at update 20, 0.4 s after go
    np.testing.assert_array_equal(pulses[: settling - 1], 1000)
    pulses = pulses[settling - 1 :]
    whole = np.rint(1000 * sensed) / 1000 * task_of(config).units
    outputs = NetworkBatch([made.solution.controller], n_outputs=8).activate(whole[None])[0]
    frequency = servo.pick(servo.FREQUENCIES, outputs[:, 0::2])
    phase = servo.pick(servo.PHASES, outputs[:, 1::2])
    command = np.array(
        [servo.command_angle(f, p, 0.4 + s) for f, p, s in zip(frequency, phase, time, strict=True)]
    )[:, ::-1]
    assert np.abs(pulses[:3000] - (1000 + 1000 * command / 180)).max() < 0.51
    # every module moves, and what the robot senses changes what it does
    assert np.ptp(pulses, axis=0).min() > 900
    assert len(np.unique(np.concatenate([frequency, phase], axis=1), axis=0)) > 3
    # half a second after the last line it lets go and waits
    np.testing.assert_array_equal(pulses[3000 + 25 :], 1000)
    assert (pulses[3000 : 3000 + 24] > 1000).any()
    states = re.findall("state ([a-z]+) ", printed)
    assert list(dict.fromkeys(states)) == ["stopped", "settling", "steering", "waiting"]
    assert states[-1] == "stopped"


def test_good_lines_are_obeyed_and_others_get_an_error(unsimulated, build, config, robot):
    run = build(firmware_files(config, robot(3), run="mine"))
    wrong = ["t450", "t450,1,2", "t450,", "t,450", "t4-5,1", "t99999999,1", "g0", "g2", "g1,1", "s1", "a"]
    wrong += ["a-5", "a181", "a90,0", "a90,4", "a9,1,1", "x3", "hello", "\x01\xff", "t" + "1," * 500, "?1"]
    for text in wrong:
        _, printed = run("host", given=f"5 {text}".encode("latin-1"))
        assert printed.splitlines()[2:] == ["error: not understood; ? tells who this is"], text
    _, printed = run("host", given=b"5 ?")
    lines = printed.splitlines()
    assert lines == 2 * ["hello tensatlas 1 robot 7 modules 3 inputs 2 gaits 1", "state stopped 0"]
    assert Hello.read(lines[0]) == Hello(1, 7, 3, 2, 1)
    # after any rubbish the next line is read as ever; blanks do not matter
    _, printed = run("host", given=b"5 t1,2,3,4\n5 a90 , 2\n5 t450, -785\n5 g1\n1500 ?")
    assert "error" in printed
    assert re.findall("state ([a-z]+) ", printed) == [
        *("stopped", "held", "settling", "steering", "waiting", "waiting", "waiting")
    ]


def test_bench_button_and_cable_lengths(unsimulated, build, config, robot):
    run = build(firmware_files(config, robot(2), run="*/ \\"), "-DTSMR_REAL=double")
    given, printed = run("hands")
    assert given.reshape(2, 2).tolist() == [[2000.0, 2.0], [2000.0, 3.0]]
    assert re.findall("state ([a-z]+) ", printed) == ["stopped", "settling", "stopped", "held"]
    assert f"cable to node 10 should measure, in mm: {1000 * servo.TARGET_LENGTHS[180, 0]:.2f}" in printed
    degrees = np.linspace(-5.0, 190.0, 400)
    lengths, _ = run("lengths", given=degrees.tobytes())
    np.testing.assert_allclose(
        lengths.reshape(-1, 5) / 1000, servo.target_lengths(degrees), rtol=0, atol=1e-8
    )


def test_a_task_of_ones_own_has_its_inputs_named(build, config, robot, monkeypatch):
    task = Task(
        name="mine",
        inputs=("light */ left", "light right \\"),
        sense=lambda view: np.stack([view.distance, view.distance], axis=-1),
        target_distance=0.3,
        target_bearings=(0.0,),
        units=(1.0, 2.5),
        sensed_in=("", "m"),
    )
    monkeypatch.setattr("engine.fabrication.firmware.sketch.task_of", lambda _: task)
    monkeypatch.setattr("engine.fabrication.firmware.gaits.task_of", lambda _: task)
    files = firmware_files(config, robot(2), run="mine")
    text = files["tsmr_robot/controller.h"].decode()
    assert "//   0: light * / left\n//   1: light right /\n" in text
    assert "INPUT_UNIT[INPUTS] = {0.001, 0.0025};" in text
    assert (
        "t<light * / left in thousandths>,<light right / in mm>"
        in files["tsmr_robot/tsmr_robot.ino"].decode()
    )
    build(files)


def test_the_pin_map_is_what_the_settings_say(unsimulated, config, robot):
    files = firmware_files(config, robot(10), run="mine")
    uno = files["tsmr_robot/settings.h"].decode().split("#else")[1]
    lines = re.findall(r"\{(\d+), 1000, 2000\},  // module (\d+)", uno)
    assert [int(m) for _, m in lines] == list(range(1, 11))
    assert [int(pin) for pin, _ in lines] == list(pin_map(10).values())
    assert files == firmware_files(config, robot(10), run="mine")


def test_a_robot_that_does_not_survive_as_built_has_the_gaits_of_the_simulated_one(
    config, robot, monkeypatch
):
    def made(_config, _evaluation, physics):
        if physics is not config.physics:
            raise InvalidData("it breaks")
        return [RecordedGait(1, 0.1, np.array([0]), np.zeros((1, 3), int))]

    monkeypatch.setattr(sketch, "recorded_gaits", made)
    other = dataclasses.replace(config.physics, friction=0.5)
    text = firmware_files(config, robot(3), run="mine", as_built=other)["tsmr_robot/gaits.h"].decode()
    assert "of the simulated robot its modules chose so" in text
    assert "gait 1: target 45° left, 10.0 cm closer, the best" in text


def test_a_template_that_names_nothing_known_is_a_fault():
    assert fill_in("a @b@ c", {"b": 1}) == "a 1 c"
    with pytest.raises(KeyError):
        fill_in("@unknown@", {})
