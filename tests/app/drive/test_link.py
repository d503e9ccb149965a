"""The serial line, with a pseudo-terminal in place of a board."""

import os
import tty

import pytest

from app.drive.link import Link
from engine.errors import InvalidData

pytest.importorskip("serial")
pty = pytest.importorskip("pty")


@pytest.fixture
def board():
    """The board's end and the name of the host's."""
    mine, theirs = pty.openpty()
    tty.setraw(theirs)
    yield mine, os.ttyname(theirs)
    os.close(theirs)
    os.close(mine)


def test_lines_go_both_ways_whatever_their_pieces(board):
    mine, port = board
    link = Link(port)
    os.write(mine, b"hello ten")
    assert link.lines() == []
    os.write(mine, b"satlas\r\n\r\nstate stopped 0\r\nhal")
    assert link.lines() == ["hello tensatlas", "state stopped 0"]
    os.write(mine, b"f \xff\n")
    assert link.lines() == ["half \ufffd"]
    link.send("t450,-785")
    assert os.read(mine, 100) == b"t450,-785\n"
    # rubbish without an end does not pile up
    for _ in range(5):
        os.write(mine, b"x" * 3000)
        link.lines()
    os.write(mine, b"\n")
    assert len(link.lines()[0]) == 1000
    link.close()


def test_a_board_that_goes_gets_one_line():
    mine, theirs = pty.openpty()
    link = Link(os.ttyname(theirs))
    os.close(theirs)
    os.close(mine)
    with pytest.raises(InvalidData, match=r"the board at /dev/.* is gone"):
        link.lines()
    with pytest.raises(InvalidData, match=r"the board at /dev/.* is gone"):
        link.send("s")


def test_a_port_that_is_not_there_gets_one_line(tmp_path, monkeypatch):
    with pytest.raises(InvalidData, match=r"port /dev/ttyNONE cannot be opened: No such file .* is among: "):
        Link("/dev/ttyNONE")
    (tmp_path / "file").touch()
    with pytest.raises(InvalidData, match="cannot be opened: it is no serial port; the board's is among"):
        Link(str(tmp_path / "file"))
    monkeypatch.setitem(__import__("sys").modules, "serial", None)
    with pytest.raises(InvalidData, match=r"needs pySerial; install it with: pip install 'tens"):
        Link("/dev/ttyNONE")
