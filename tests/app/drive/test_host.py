"""The host and its robot, both made up: what is said, when, and what ends a drive."""

import math

import numpy as np
import pytest

from app.drive.eyes import HeadPose, Seen
from app.drive.host import Host
from app.drive.log import Driven, LogWriter, read_log
from engine.errors import InvalidData
from engine.fabrication.firmware.protocol import Hello
from engine.tasks import GOAL_REACHING

HELLO = "hello tensatlas 1 robot 7 modules 3 inputs 2 gaits 4"
PICTURE = 0.04


class Eyes:
    """A head that goes towards the target, 1 cm a picture once it was told to."""

    def __init__(self, board, hidden=lambda _k: (False, False)):
        self.board, self.hidden = board, hidden
        self.n, self.x = 0, 0.0

    def look(self):
        self.n += 1
        if self.board.goes:
            self.x += 0.01
        head, target = self.hidden(self.n)
        return Seen(
            100.0 + PICTURE * self.n,
            None if head else HeadPose(self.x, 0.0, math.pi / 2),
            None if target else np.array([0.4, 0.0]),
            lambda: b"",
        )

    def close(self):
        pass


class Board:
    """A board that greets after a while and goes when it is told to."""

    port = "/dev/made-up"

    def __init__(self, greeting=HELLO, asked=1):
        self.greeting, self.asked = greeting, asked
        self.said, self.sent, self.goes = [], [], False

    def lines(self):
        said, self.said = self.said, []
        return said

    def send(self, line):
        self.sent.append(line)
        if line == "?" and self.sent.count("?") >= self.asked:
            self.said.append(self.greeting)
        if line == "g":
            self.goes = True
            self.said += ["state settling 0", "state steering 150"]
        if line == "s":
            self.goes = False


def host(board, **eyes):
    shown = []
    made = Host(Eyes(board, **eyes), board, GOAL_REACHING, lambda _seen, text: shown.append(text))
    return made, shown


def test_a_robot_is_met_started_told_and_stopped(tmp_path):
    board = Board(asked=3)
    made, shown = host(board)
    hello = made.meet()
    assert (hello, board.sent) == (Hello(1, 7, 3, 2, 4), ["?"] * 3)
    log = LogWriter(tmp_path / "log", Driven(7, 3, "goal-reaching", "mine", True))
    found = made.drive(hello, log, seconds=10.0, arrive=0.1)
    log.close()
    assert (found.why, found.before) == ("it has arrived", 0.4)
    assert found.after == pytest.approx(0.1, abs=1e-6)
    sent = board.sent[3:]
    assert (sent[0], sent[-1]) == ("g", "s")
    # the head looks along y, the target is to its right
    assert sent[1:4] == ["t400,-1571", "t390,-1571", "t380,-1571"]
    assert len(sent) == 2 + 31
    driven, records = read_log(tmp_path / "log")
    assert driven == Driven(7, 3, "goal-reaching", "mine", True)
    assert [r.sent for r in records] == sent[1:-1]
    assert records[0].heard == ("state settling 0", "state steering 150")
    assert [r.time for r in records[:3]] == pytest.approx([0.0, PICTURE, 2 * PICTURE])
    assert shown[-1] == "steering, 11.0 cm to go"


def test_nothing_is_told_while_a_tag_is_hidden():
    board = Board()
    made, shown = host(board, hidden=lambda k: (10 < k <= 15, 20 < k <= 22))
    made.drive(made.meet(), None, seconds=1.2, arrive=0.0)
    told = [line for line in board.sent if line.startswith("t")]
    n = round(1.2 / PICTURE)
    assert len(told) in (n - 7, n - 6)
    assert any("a tag is hidden" in text for text in shown)


def test_it_ends_when_its_time_is_over_or_the_board_stops():
    board = Board()
    made, _ = host(board)
    found = made.drive(made.meet(), None, seconds=0.5, arrive=0.0)
    assert (found.why, board.sent[-1]) == ("its time is over", "s")

    class Stops(Board):
        def lines(self):
            return [*super().lines(), "state stopped 0"]

    board = Stops()
    made, _ = host(board)
    found = made.drive(made.meet(), None, seconds=60.0, arrive=0.0)
    assert (found.why, board.sent[-1]) == ("the board has stopped", "s")
    assert found.seconds < 3.0


@pytest.mark.parametrize("error", [KeyboardInterrupt, InvalidData("the camera is gone")])
def test_the_robot_is_stopped_whatever_happens(error):
    board = Board()

    def hidden(k):
        if k == 20:
            raise error
        return False, False

    made, _ = host(board, hidden=hidden)
    hello = made.meet()
    if error is KeyboardInterrupt:
        assert made.drive(hello, None, seconds=9.0, arrive=0.0).why == "you stopped it"
    else:
        with pytest.raises(InvalidData, match="the camera is gone"):
            made.drive(hello, None, seconds=9.0, arrive=0.0)
    assert board.sent[-1] == "s"


@pytest.mark.parametrize(
    ("greeting", "reason"),
    [
        ("ready: robot 7", "the board at /dev/made-up does not answer; is the robot's sketch on it"),
        (HELLO.replace("tensatlas 1", "tensatlas 2"), "speaks version 2 of the protocol, not 1"),
        (HELLO.replace("inputs 2", "inputs 5"), "has 5 sensors, the task goal-reaching 2; name its run"),
    ],
)
def test_another_board_gets_one_line(greeting, reason):
    made, _ = host(Board(greeting))
    with pytest.raises(InvalidData, match=reason):
        made.meet()


@pytest.mark.parametrize(
    ("hidden", "reason"),
    [
        ((True, False), "no tag of the head;"),
        ((False, True), "no tag of the target;"),
        ((True, True), "no tag of the head and none of the target;"),
    ],
)
def test_a_camera_without_tags_gets_one_line(hidden, reason):
    board = Board()
    made, _ = host(board, hidden=lambda _k: hidden)
    with pytest.raises(InvalidData, match=f"the camera sees {reason} the build sheet has them"):
        made.drive(made.meet(), None, seconds=9.0, arrive=0.0)
    assert "g" not in board.sent
