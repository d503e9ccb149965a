"""The command ``drive``: steers a robot by a camera and a serial line, or a simulated one."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING

import tyro
from rich.console import Console

from engine.errors import ExportError, InvalidData, as_typed, printable
from engine.fabrication.markers import HEAD
from engine.search.archive import parse_cell
from engine.storage.reader import RunReader

if TYPE_CHECKING:  # what simulates, draws and shapes takes a while to import; other commands do not need it
    from app.drive.eyes import Eyes, Seen
    from app.drive.link import Link
    from engine.config import RunConfig
    from engine.simulation.evaluation import Evaluation


@dataclasses.dataclass(frozen=True, kw_only=True)
class Drive:
    """Steer a robot that was built: a camera finds its printed tags, a serial line tells its board.

    With --simulate the robot as it would be built, with its real sketch behind a pseudo-terminal.
    """

    path: tyro.conf.Positional[Path | None] = None
    """Run file of the robot; needed to simulate it, or for another task than goal reaching."""
    archive: str = "morphology"
    """Map to take the elite from: morphology or controller, or of MAP-Elites grid."""
    cell: str | None = None
    """Cell of the map, such as 3,7 or 3,7,0,4; all count from 0."""
    port: str | None = None
    """Serial port of the board, such as /dev/ttyUSB0 or COM3."""
    camera: str = "0"
    """Number of the camera, or a video file or stream."""
    tag_mm: float = 50.0
    """Side of the head's black square as printed, in mm; the target's is 1.6 times as large."""
    ahead_mm: float = 0.0
    """How far the head point lies ahead of the middle of the head's tag, in mm."""
    seconds: float = 120.0
    """Longest time that it crawls, the rest at the beginning included."""
    arrive_cm: float = 5.0
    """Distance of the head from the target at which it has arrived."""
    log: Path = Path("drive.jsonl")
    """File to write what happens to; replay-log plays it."""
    page: int = 8090
    """Port of the page that shows the picture, on this computer; 0 for none."""
    simulate: bool = False
    """Simulate robot and board."""
    materials: str = "latex-sheet"
    """What a simulated robot is built from: latex-sheet, tpu-85a, silicone-sheet, or a TOML file of yours."""
    target: int = 1
    """Target of a simulated robot, from 1."""
    speed: float = 1.0
    """Seconds of a simulated robot in one of yours; 0 for as many as there can be."""

    def run(self, console: Console) -> None:
        """Drive until the robot has arrived, its time is over, or Ctrl-C.

        Raises:
            InvalidData: a flag is out of range or missing; there is no such port, camera or cell; a tag is
                not seen; the board does not answer; a library or the compiler is not installed.
            RunFileError: the run cannot be read.
            ExportError: the log is there already or cannot be written.
        """
        self._check()
        from app.drive.host import Host
        from app.drive.log import Driven, LogWriter
        from app.drive.page import PicturePage
        from engine.config import task_of
        from engine.tasks import GOAL_REACHING

        config, evaluation, run = self._robot()
        task = GOAL_REACHING if config is None else task_of(config)
        with contextlib.ExitStack() as stack:
            eyes, link = self._eyes_and_link(stack, config, evaluation, run)
            page = None
            if self.page:
                page = stack.enter_context(contextlib.closing(PicturePage(self.page)))
                console.print(f"The picture is at {page.address}", markup=False)

            def show(seen: Seen, text: str) -> None:
                if page is not None:
                    page.show(seen.picture(), text)

            host = Host(eyes, link, task, show)
            hello = host.meet()
            number = hello.robot if evaluation is None else evaluation.solution.number
            if hello.robot != number:
                raise InvalidData(f"the board has the sketch of robot {hello.robot}, the cell robot {number}")
            driven = Driven(hello.robot, hello.modules, task.name, run, self.simulate)
            log = stack.enter_context(contextlib.closing(LogWriter(self.log, driven)))
            console.print(f"Driving robot {hello.robot}; Ctrl-C stops it", markup=False)
            found = host.drive(hello, log, seconds=self.seconds, arrive=self.arrive_cm / 100)
        console.print(
            f"The head came from {100 * found.before:.1f} to {100 * found.after:.1f} cm from the target in"
            f" {found.seconds:.1f} s: {found.why}. Log: {as_typed(self.log)}",
            markup=False,
        )

    def _check(self) -> None:
        """Refuse what cannot be driven before anything is opened.

        Raises:
            InvalidData: a flag is out of range or missing.
            ExportError: the log is there already.
        """
        if self.simulate and self.port is not None:
            raise InvalidData("--simulate has a port of its own: leave out --port")
        if self.simulate and self.path is None:
            raise InvalidData("name the run to simulate, as in: tensatlas drive --simulate RUN --cell 3,7")
        if not self.simulate and self.port is None:
            raise InvalidData("say where the board is, such as --port /dev/ttyUSB0, or --simulate it")
        if (self.path is None) != (self.cell is None):
            raise InvalidData("a robot of a run is named by both, as in: RUN --cell 3,7")
        for flag, value, low, high in (
            ("tag-mm", self.tag_mm, 5.0, 500.0),
            ("ahead-mm", self.ahead_mm, -500.0, 500.0),
            ("seconds", self.seconds, 0.1, 3600.0),
            ("arrive-cm", self.arrive_cm, 0.0, 300.0),
            ("speed", self.speed, 0.0, 1000.0),
            ("page", self.page, 0, 65535),
        ):
            if not low <= value <= high or not math.isfinite(value):
                raise InvalidData(f"{flag} must be from {low:g} to {high:g}, not {value:g}")
        if self.log.exists():
            raise ExportError(f"{as_typed(self.log)} is there already; name another file with --log")

    def _robot(self) -> tuple[RunConfig | None, Evaluation | None, str]:
        """Return the run's configuration, the robot's evaluation and the run's name, if they were named."""
        if self.path is None or self.cell is None:
            return None, None, ""
        with RunReader(self.path) as reader:
            evaluation = reader.evaluation(reader.elite_at(self.archive, parse_cell(self.cell)))
            return reader.config, evaluation, printable(reader.path.stem)

    def _eyes_and_link(
        self,
        stack: contextlib.ExitStack,
        config: RunConfig | None,
        evaluation: Evaluation | None,
        run: str,
    ) -> tuple[Eyes, Link]:
        """Return what sees the robot, and the line to its board; the stack closes them."""
        from app.drive.link import Link

        if config is None or evaluation is None or not self.simulate:
            from app.drive.camera import Camera

            link = stack.enter_context(contextlib.closing(Link(self.port or "")))
            scale = self.tag_mm / (1000 * HEAD.side)
            camera = Camera(self.camera, scale=scale, ahead=self.ahead_mm / 1000)
            return stack.enter_context(contextlib.closing(camera)), link
        from app.drive.simulated import SimulatedRobot
        from engine.fabrication.as_built import twin_of_robot
        from engine.fabrication.materials import load_materials

        twin = twin_of_robot(config, evaluation, load_materials(self.materials))
        robot = SimulatedRobot(
            config, evaluation, twin.nominal, target=self.target - 1, run=run, speed=self.speed
        )
        stack.enter_context(contextlib.closing(robot))
        return robot, stack.enter_context(contextlib.closing(Link(robot.port)))
