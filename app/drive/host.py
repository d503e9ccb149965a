"""Starts a robot, tells it what it senses, and stops it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Final, Protocol

from app.drive.eyes import Eyes, Seen
from app.drive.log import LogWriter
from app.drive.sensing import Sensing
from engine.errors import InvalidData
from engine.fabrication.firmware import protocol
from engine.fabrication.firmware.protocol import BoardState, Hello, sensed_line
from engine.tasks import Task

GREETING_TIME: Final = 6.0
"""Seconds in which the board must answer; it starts anew when its port is opened, which takes two."""
ASKED_EVERY: Final = 1.0
"""Seconds between two times that it is asked."""
FINDING_TIME: Final = 10.0
"""Seconds in which both tags must be seen."""
STARTING_TIME: Final = 2.0
"""Seconds in which the board must say that it goes."""


class Board(Protocol):
    """A line to the board."""

    port: str

    def lines(self) -> list[str]:
        """Return the lines that have come since the last call."""
        ...

    def send(self, line: str) -> None:
        """Send a line."""
        ...


@dataclasses.dataclass(frozen=True, slots=True)
class Drive:
    """How a drive went.

    Attributes:
        seconds: from go to its end.
        before, after: how far the head was from the target, in m.
        why: it ended.
    """

    seconds: float
    before: float
    after: float
    why: str


class Host:
    """Drives one robot.

    Args:
        eyes: that see it.
        board: that moves it.
        task: what its controller senses.
        show: shown every picture, with a line of text.
    """

    def __init__(
        self,
        eyes: Eyes,
        board: Board,
        task: Task,
        show: Callable[[Seen, str], None] = lambda _seen, _text: None,
    ) -> None:
        self._eyes, self._board, self._task, self._show = eyes, board, task, show
        self._state = BoardState("stopped", 0)

    def meet(self) -> Hello:
        """Wait until the board says who it is.

        Raises:
            InvalidData: it does not, or it has another robot's sketch.
        """
        begun, asked = math.nan, -math.inf
        while True:
            seen = self._look("waiting for the board")
            begun = seen.time if math.isnan(begun) else begun
            for line in self._board.lines():
                hello = Hello.read(line)
                if hello is not None:
                    return self._checked(hello)
            if seen.time - begun > GREETING_TIME:
                raise InvalidData(
                    f"the board at {self._board.port} does not answer; is the robot's sketch on it, and no"
                    " serial monitor open?"
                )
            if seen.time - asked >= ASKED_EVERY:
                self._board.send("?")
                asked = seen.time

    def find(self) -> Seen:
        """Wait until head and target are seen.

        Raises:
            InvalidData: one of them is not.
        """
        begun = math.nan
        while True:
            seen = self._look("looking for the tags")
            if seen.head is not None and seen.target is not None:
                return seen
            begun = seen.time if math.isnan(begun) else begun
            if seen.time - begun > FINDING_TIME:
                missing = [n for n, tag in (("head", seen.head), ("target", seen.target)) if tag is None]
                raise InvalidData(
                    f"the camera sees no tag of the {' and none of the '.join(missing)}; the build sheet has"
                    " them (“To steer it”): all of their white border must be in the picture, without glare"
                )

    def drive(self, hello: Hello, log: LogWriter | None, *, seconds: float, arrive: float) -> Drive:
        """Start the robot and steer it until it has arrived; it is stopped whatever happens.

        Args:
            hello: of the board.
            log: written to.
            seconds: after which it is stopped.
            arrive: distance from the target at which it is stopped, in m.

        Raises:
            InvalidData: the camera or the board is gone.
        """
        seen = self.find()
        assert seen.head is not None
        assert seen.target is not None
        sensing = Sensing(self._task, hello.modules, seen.head, seen.target)
        begun, last = seen.time, seen
        before = distance = _distance(seen)
        self._board.send("g")
        why = "its time is over"
        try:
            while seen.time - begun < seconds:
                heard = tuple(self._board.lines())
                stopped = self._stopped(heard)
                sent = ""
                if seen.head is not None and seen.target is not None:
                    values = sensing.values(seen.head, seen.target, seen.time - begun)
                    sent = sensed_line(values)
                    self._board.send(sent)
                    distance, last = _distance(seen), seen
                if log is not None:
                    log.add(seen.time - begun, seen, sent, heard)
                if distance <= arrive:
                    why = "it has arrived"
                    break
                if stopped and seen.time - begun > STARTING_TIME:
                    why = "the board has stopped"
                    break
                hidden = "" if sent else "; a tag is hidden"
                seen = self._look(f"{self._state.name}, {100 * distance:.1f} cm to go{hidden}")
        except KeyboardInterrupt:
            why = "you stopped it"
        finally:
            self._board.send("s")
        # a picture more, so that a board behind a simulation hears it
        self._eyes.look()
        return Drive(last.time - begun, before, distance, why)

    def _look(self, text: str) -> Seen:
        seen = self._eyes.look()
        self._show(seen, text)
        return seen

    def _stopped(self, heard: tuple[str, ...]) -> bool:
        """Take note of what the board says; return whether it does not move the robot."""
        for line in heard:
            self._state = BoardState.read(line) or self._state
        return self._state.name in ("stopped", "held", "testing")

    def _checked(self, hello: Hello) -> Hello:
        if hello.version != protocol.VERSION:
            raise InvalidData(
                f"the board speaks version {hello.version} of the protocol, not {protocol.VERSION}; upload a"
                " sketch that this TensAtlas has exported"
            )
        if hello.inputs != self._task.n_inputs:
            raise InvalidData(
                f"the board's robot has {hello.inputs} sensors, the task {self._task.name}"
                f" {self._task.n_inputs}; name its run, as in: tensatlas drive RUN --cell 3,7"
            )
        return hello


def _distance(seen: Seen) -> float:
    assert seen.head is not None
    assert seen.target is not None
    return math.dist(seen.head.position, seen.target)
