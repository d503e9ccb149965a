"""The simulated robot behind its pseudo-terminal: what is seen of it, and when it moves."""

import dataclasses
import io
import math

import numpy as np
import pytest
from PIL import Image

from app.drive.simulated import AROUND, WIDE, SimulatedRobot
from engine.body.morphology import Morphology
from engine.config import preset
from engine.errors import InvalidData
from engine.fabrication.firmware.host_board import compiler
from engine.simulation.built import Built
from tests.support.made_up import evaluation, evolved_controller

link = pytest.importorskip("app.drive.link")
pytest.importorskip("serial")
needs_a_board = pytest.mark.skipif(compiler() is None, reason="no C++ compiler")


@pytest.fixture(scope="module")
def config():
    usual = preset("smoke")
    times = dataclasses.replace(usual.trials, settle_time=3.0, trial_time=2.0)
    return dataclasses.replace(usual, task="squeezing", trials=times)


@pytest.fixture(scope="module")
def made():
    found = evaluation(7, morphology=Morphology(2, (1, 2)))
    controller = evolved_controller(4, 20, n_inputs=5)
    return dataclasses.replace(found, solution=dataclasses.replace(found.solution, controller=controller))


@needs_a_board
def test_it_is_seen_late_moves_when_told_and_stops(config, made):
    late = dataclasses.replace(config.physics, built=Built(sensing_delay=0.08))
    told, true = [], []
    for goes in (False, True):
        robot = SimulatedRobot(config, made, late, target=1, speed=0)
        board = link.Link(robot.port)
        seen = robot.look()
        board.send("g" if goes else "?")
        distances = [], []
        for _ in range(110):
            seen = robot.look()
            distances[0].append(math.dist(seen.head.position, seen.target))
            distances[1].append(robot.distance)
            board.send("t600,-87,158,-90,0")
        told.append(distances[0])
        true.append(distances[1])
        said = " ".join(board.lines())
        assert ("state steering" in said) == goes
        if not goes:
            board.close()
            robot.close()
    assert seen.time == pytest.approx(0.04 * 111)
    # two control updates a look, four of delay
    np.testing.assert_allclose(np.array(told)[:, 5:], np.array(true)[:, 3:-2], rtol=0, atol=1e-12)
    # the same robot until its controller begins, 3 s after it was told to go
    assert true[0][:74] == true[1][:74]
    assert abs(true[0][-1] - true[1][-1]) > 1e-3
    board.send("s")
    robot.look()
    assert any(line.startswith("state stopped") for line in board.lines())
    picture = Image.open(io.BytesIO(robot.look().picture()))
    assert picture.size == (WIDE, WIDE)
    # the target's ring is orange, 60 cm from the middle
    shown = np.asarray(picture).astype(int)
    rows, columns = np.nonzero((shown[..., 0] > 180) & (shown[..., 2] < 90))
    away = np.hypot(rows.mean() - WIDE / 2, columns.mean() - WIDE / 2) * (2 * AROUND / WIDE)
    assert away == pytest.approx(0.6, abs=0.02)
    board.close()
    robot.close()
    robot.close()


@needs_a_board
def test_a_camera_is_as_inexact_as_the_twin_says(config, made):
    noisy = dataclasses.replace(config.physics, built=Built(position_noise=0.003, heading_noise=2.0))
    robot = SimulatedRobot(config, made, noisy, speed=0)
    heads = [robot.look().head for _ in range(40)]
    robot.close()
    # the fall is over after some pictures
    places = np.array([(h.x, h.y, math.degrees(h.direction)) for h in heads[10:]])
    x, y, degrees = places.std(axis=0)
    assert 0.0015 < x < 0.006
    assert 0.0015 < y < 0.006
    assert 1.0 < degrees < 4.0


def test_what_cannot_be_simulated_gets_one_line(config, made):
    with pytest.raises(InvalidData, match="target must be from 1 to 2, not 3"):
        SimulatedRobot(config, made, config.physics, target=2)
    walking = dataclasses.replace(made.solution.morphology, feet="end")
    walker = dataclasses.replace(made, solution=dataclasses.replace(made.solution, morphology=walking))
    with pytest.raises(InvalidData, match="MuJoCo knows no directional feet"):
        SimulatedRobot(config, walker, config.physics)
