"""The command drive: a simulated robot with its real sketch behind a pseudo-terminal, and bad input."""

import json
import re

import pytest

from app.drive.log import read_log
from engine.fabrication.firmware.host_board import compiler
from engine.storage.reader import RunReader
from tests.support.command_line import Command

needs_a_board = pytest.mark.skipif(compiler() is None, reason="no C++ compiler")


@pytest.fixture(scope="session")
def robot(small_run):
    """Arguments that name a robot of the small run, and its number."""
    with RunReader(small_run) as reader:
        cell, number = min(reader.placements("morphology", reader.last_closed().number).items())
    return (small_run, "--cell", "{},{}".format(*cell)), number


@needs_a_board
def test_a_simulated_robot_is_driven_and_its_log_read(tensatlas: Command, tmp_path, robot) -> None:
    pytest.importorskip("serial")
    named, number = robot
    flags = ("--seconds", 2, "--speed", 0, "--page", 0, "--arrive-cm", 0)
    status, out, err = tensatlas("drive", "--simulate", *named, *flags)
    assert (status, out) == (0, "")
    assert f"Driving robot {number}; Ctrl-C stops it" in err
    found = re.search(r"The head came from (\S+) to (\S+) cm from the target in 2.0 s: its time is over", err)
    assert float(found[1]) == pytest.approx(45.0, abs=2.0)
    driven, records = read_log(tmp_path / "drive.jsonl")
    assert (driven.robot, driven.run, driven.simulated) == (number, "small", True)
    assert len(records) == 50
    assert all(re.fullmatch(r"t\d+,-?\d+", r.sent) for r in records)
    states = [line.split()[1] for r in records for line in r.heard if line.startswith("state")]
    # the settling of this run's trials is short
    assert list(dict.fromkeys(states)) == ["settling", "steering"]
    # a second drive must not overwrite it
    status, _, err = tensatlas("drive", "--simulate", *named, *flags)
    assert (status, err.count("\n"), "is there already; name another file with --log" in err) == (2, 1, True)


BAD = {
    "no port": ((), "say where the board is, such as --port /dev/ttyUSB0, or --simulate it"),
    "no such port": (("--port", "/dev/ttyNONE"), "port /dev/ttyNONE cannot be opened: No such file"),
    "no run": (("--simulate",), "name the run to simulate"),
    "both": (("--simulate", "RUN", "--port", "COM3"), "leave out --port"),
    "no cell": (("--simulate", "RUN"), "a robot of a run is named by both"),
    "empty cell": (("--simulate", "RUN", "--cell", "99,99"), "lies outside"),
    "target": (("--simulate", "RUN", "--cell", "CELL", "--target", "9"), "target must be from 1 to 4, not 9"),
    "target 0": (
        ("--simulate", "RUN", "--cell", "CELL", "--target", "0"),
        "target must be from 1 to 4, not 0",
    ),
    "speed": (("--port", "COM3", "--speed", "-1"), "speed must be from 0 to 1000, not -1"),
    "seconds": (("--port", "COM3", "--seconds", "nan"), "seconds must be from 0.1 to 3600, not nan"),
    "page": (("--port", "COM3", "--page", "99999"), "page must be from 0 to 65535"),
    "materials": (("--simulate", "RUN", "--cell", "CELL", "--materials", "wood"), "wood"),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_input_gets_one_line(tensatlas: Command, tmp_path, robot, what) -> None:
    pytest.importorskip("serial")
    arguments, reason = BAD[what]
    (run, _, cell), _ = robot
    named = [{"RUN": run, "CELL": cell}.get(a, a) for a in arguments]
    status, out, err = tensatlas("drive", *named)
    assert (status, out, err.count("\n")) == (2, "", 1), err
    assert reason in err
    assert not (tmp_path / "drive.jsonl").exists()


def test_the_log_of_another_robot_is_refused(tensatlas: Command, tmp_path, robot) -> None:
    (run, _, _), number = robot
    first = {"format": "tensatlas-drive", "version": 1, "robot": number, "modules": 99, "run": ""}
    first |= {"task": "goal-reaching", "simulated": True}
    (tmp_path / "log").write_text(json.dumps(first))
    status, _, err = tensatlas("replay-log", "log", run)
    assert (status, err.count("\n"), "is of another robot" in err) == (2, 1, True)
    status, _, err = tensatlas("replay-log", "none", run)
    assert (status, err.count("\n"), "cannot be read" in err) == (2, 1, True)
