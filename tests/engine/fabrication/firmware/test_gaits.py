"""Recorded gaits: the board without a host does what the robot did in simulation."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.body import servo
from engine.fabrication.firmware import firmware_files
from engine.fabrication.firmware.gaits import RecordedGait, best_of, fitting, recorded_gaits
from engine.fabrication.firmware.host_board import HostBoard, compile_board
from engine.replay.replay import Replay


@pytest.fixture(scope="module")
def exact(config):
    """A run without noise."""
    return dataclasses.replace(config, physics=dataclasses.replace(config.physics, servo_noise=0.0))


def test_the_board_repeats_the_commands_of_a_trial(exact, robot, cxx, tmp_path):
    # its modules choose anew during the trial
    made = robot(3, seed=53, n_mutations=0, head_is_end=True)
    gaits = recorded_gaits(exact, made, exact.physics)
    assert [g.target for g in gaits] == [0, 1, 2, 3]
    assert len(gaits[0].switches) > 10
    program = compile_board(firmware_files(exact, made, run="mine"), tmp_path)
    for target in (0, 1):
        spans = []
        replay = Replay(exact, made, target=target, observer=spans.append)
        replay.advance(replay.end_time)
        assert gaits[target].gained == pytest.approx(0.45 - replay.score)
        lengths = np.concatenate([s.commanded[:, 0, 0] for s in spans if s.sensed is not None])
        with HostBoard(program, 3) as board:
            # the line is read after a millisecond
            board.advance(381, f"g{target + 1}\n".encode())
            pulses = []
            for _ in lengths:
                board.advance(20)
                pulses.append(board.pulses)
        told = servo.target_lengths(180 * (np.array(pulses) - 1000) / 1000)
        # pulses are whole microseconds, of 0.18 degrees each
        np.testing.assert_allclose(told, lengths, rtol=0, atol=1e-4)
    assert np.ptp(pulses, axis=0).min() > 500


CHOICES = st.lists(st.lists(st.integers(0, 7), min_size=2, max_size=2), min_size=1, max_size=200)


@given(st.lists(CHOICES, min_size=1, max_size=4), st.integers(16, 400))
def test_gaits_fit_and_hold_their_choices(every, room):
    gaits = []
    for k, rows in enumerate(every):
        chosen = np.array(rows)
        new = np.array([True, *(chosen[1:] != chosen[:-1]).any(axis=1)])
        gaits.append(RecordedGait(k, 0.0, np.flatnonzero(new), chosen[new]))
    found = fitting(gaits, room)
    assert sum(g.n_bytes for g in found) <= max(room, 4 * len(gaits))
    for before, after in zip(gaits, found, strict=True):
        assert after.switches[0] == 0
        assert (np.diff(after.switches) >= after.held).all()
        if after.held == 1:
            assert after.switches.tolist() == before.switches.tolist()
            assert after.choices.tolist() == before.choices.tolist()
        else:
            # a block has what was chosen most often meanwhile
            rows = before.choices[np.searchsorted(before.switches, np.arange(after.held), side="right") - 1]
            n = int(before.switches[-1]) + 1
            if n >= after.held:
                assert [(rows[:, m] == after.choices[0, m]).sum() for m in (0, 1)] == [
                    np.bincount(rows[:, m]).max() for m in (0, 1)
                ]


def test_the_best_gains_most():
    gaits = [RecordedGait(k, g, np.array([0]), np.zeros((1, 2), int)) for k, g in enumerate([0.1, 0.3, -0.2])]
    assert best_of(gaits) == 1
