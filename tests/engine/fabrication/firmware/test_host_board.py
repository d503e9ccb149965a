"""The sketch as a program whose clock the test winds: what its servos do."""

import pytest

from engine.errors import InvalidData
from engine.fabrication.firmware import firmware_files, host_board
from engine.fabrication.firmware.host_board import HostBoard, compile_board
from engine.fabrication.firmware.protocol import BoardState, Hello


@pytest.fixture(scope="module")
def files(config, robot):
    return firmware_files(config, robot(3), run="mine")


@pytest.fixture(scope="module")
def program(files, cxx, tmp_path_factory):
    return compile_board(files, tmp_path_factory.mktemp("board"))


def test_it_greets_and_rests_with_its_cables_released(program):
    with HostBoard(program, 3) as board:
        hello, state = board.greeting.decode().splitlines()
        assert Hello.read(hello) == Hello(1, 7, 3, 2, 4)
        assert BoardState.read(state) == BoardState("stopped", 0)
        assert board.advance(5000) == b""
        assert board.pulses.tolist() == [1000] * 3


def test_the_self_test_turns_one_servo_after_the_other(program):
    with HostBoard(program, 3) as board:
        board.advance(10, b"x\n")
        seen = []
        for _ in range(20):
            board.advance(500)
            if not seen or seen[-1] != board.pulses.tolist():
                seen.append(board.pulses.tolist())
        rest = [1000] * 3
        assert seen == [
            [2000, 1000, 1000],
            rest,
            [1000, 2000, 1000],
            rest,
            [1000, 1000, 2000],
            rest,
        ]
        # whoever says stop meanwhile is obeyed at once
        board.advance(100, b"x\n")
        assert b"state stopped 0" in board.advance(1, b"s\n")
        board.advance(3000)
        assert board.pulses.tolist() == rest


def test_one_servo_is_set_alone(program):
    with HostBoard(program, 3) as board:
        board.advance(1, b"a90,2\n")
        assert board.pulses.tolist() == [1000, 1500, 1000]


def test_a_silent_host_leaves_the_servos_at_rest_until_it_speaks_again(program):
    with HostBoard(program, 3) as board:
        board.advance(10, b"g\n")
        moved = set()
        for _ in range(100):
            board.advance(40, b"t450,-700\n")
            moved.update(board.pulses.tolist())
        assert len(moved) > 20
        assert b"state waiting" in board.advance(600)
        assert board.pulses.tolist() == [1000] * 3
        board.advance(2000)
        assert board.pulses.tolist() == [1000] * 3
        assert b"state steering" in board.advance(40, b"t440,-690\n")


def test_what_cannot_be_compiled_or_run_gets_one_line(files, tmp_path, monkeypatch, cxx):
    broken = files | {"tsmr_robot/controller.h": b"#error broken\n"}
    with pytest.raises(InvalidData, match=r"cannot be compiled: .*broken"):
        compile_board(broken, tmp_path)
    monkeypatch.setattr(host_board.shutil, "which", lambda _: None)
    with pytest.raises(InvalidData, match=r"needs a C\+\+ compiler"):
        compile_board(files, tmp_path)
