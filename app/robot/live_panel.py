"""What goes on inside the robot that is replayed: its network and its servos, in step with the replay."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import viser

from app.gui.click_channel import ClickChannel
from app.gui.widgets import put_html
from app.replay.player import ReplayMoment
from engine.body.kinematics import contraction, internal_lengths
from engine.config import RunConfig, task_of
from engine.replay.dump_replay import DumpReplay
from engine.replay.recording import Playable
from engine.simulation.evaluation import Evaluation
from engine.simulation.trials import driving
from engine.tasks import Task
from viz.robot import network_diagram, servo_plot
from viz.robot.network_diagram import NetworkDiagram

INTERVAL = 0.12
"""Seconds between two updates while playing."""
GROWTH_INTERVAL = 0.5
"""Seconds between two pictures of the servos while the simulation is still at what they show."""
SAMPLE_STEP = 3
"""Frames between two samples of the servos' curves."""
LONGEST_COMMAND = 0.2
"""Metres: a servo whose cables are told to be longer is off."""


class LivePanel:
    """Shows network and servos of one robot; ``show`` is to be called for every frame.

    Args:
        gui: of one client.
        tabs: the group that gets a tab for each.
        seek: called with a moment of the replay, in s, that the user points at.
    """

    def __init__(
        self, gui: viser.GuiApi, tabs: viser.GuiTabGroupHandle, seek: Callable[[float], None]
    ) -> None:
        self._seek = seek
        with tabs.add_tab("Network", viser.Icon.SHARE):
            self._network = gui.add_html("")
            self._network_live = gui.add_html("")
        with tabs.add_tab("Servos", viser.Icon.WAVE_SINE):
            self._pointer = ClickChannel(gui, self._pointed, label="moments").along("moment")
            self._servos = gui.add_html("")
            self._servos_live = gui.add_html("")
        self._diagram: NetworkDiagram | None = None
        self._evaluation: Evaluation | None = None
        self._task: Task | None = None
        self._updated = 0.0
        self._shown: tuple[Playable, int] | None = None
        self._plotted: tuple[Playable, tuple[float, float]] | None = None
        self._plotted_frames = 0
        self._plotted_at = 0.0

    def show_robot(self, config: RunConfig, evaluation: Evaluation) -> None:
        """Draw another robot's network."""
        solution = evaluation.solution
        self._task = task = task_of(config)
        diagram = NetworkDiagram(
            driving(solution.controller, config.trials),
            solution.morphology.n_modules,
            task.inputs,
            head_is_end=evaluation.head_is_end,
        )
        self._shown = None
        self._network_live.content = ""
        self._network.content = diagram.render() + network_diagram.legend()
        self._diagram, self._evaluation = diagram, evaluation

    def clear(self) -> None:
        """Show no robot."""
        self._diagram = self._evaluation = self._plotted = self._shown = None
        for element in (self._network, self._network_live, self._servos, self._servos_live):
            put_html(element, "")

    def _pointed(self, _name: str, index: tuple[int, ...]) -> None:
        if self._plotted is not None:
            first, last = self._plotted[1]
            self._seek(first + (last - first) * min(index[0] / 999, 1.0))

    def show(self, moment: ReplayMoment) -> None:
        """Show the recorded frame nearest to a moment; while playing, at most every ``INTERVAL`` and once."""
        now, replay, index = time.monotonic(), moment.replay, moment.index
        if moment.playing and (now - self._updated < INTERVAL or self._shown == (replay, index)):
            return
        self._updated, self._shown = now, (replay, index)
        frame = replay.frames[index]
        # a dump or a variant of the robot has another network or another body: nothing moves in this one
        own = self._evaluation is not None and replay.morphology == self._evaluation.solution.morphology
        self._show_network(frame.sensed if own else None, knows=own and not isinstance(replay, DumpReplay))
        self._show_servos(replay, frame.time, now)

    def _show_network(self, sensed: np.ndarray | None, *, knows: bool) -> None:
        diagram = self._diagram
        task = self._task
        if diagram is None or task is None or (sensed is not None and len(sensed) != task.n_inputs):
            return
        neurons = {} if sensed is None else diagram.network.neurons(sensed)
        put_html(
            self._network_live,
            f"<style>{diagram.style(neurons)}</style>"
            + (network_diagram.sensed_line(task, sensed) if knows else ""),
        )

    def _show_servos(self, replay: Playable, moment: float, now: float) -> None:
        page = servo_plot.page_of(moment, replay.start_time, replay.end_time)
        if self._plotted != (replay, page) or (
            self._grows(replay, page) and now - self._plotted_at >= GROWTH_INTERVAL
        ):
            self._plot(replay, page)
            self._plotted, self._plotted_at = (replay, page), now
        put_html(self._servos_live, f"<style>{servo_plot.cursor_style(moment, page)}</style>")

    def _grows(self, replay: Playable, page: tuple[float, float]) -> bool:
        """Tell whether there are more frames for a picture than it shows."""
        seen = self._plotted_frames
        return seen < len(replay.frames) and replay.frames[seen - 1].time < page[1] - replay.frame_period

    def _plot(self, replay: Playable, page: tuple[float, float]) -> None:
        frames = replay.frames[: len(replay.frames)]
        period = replay.frame_period
        shown = frames[servo_plot.samples(page, replay.start_time, period, len(frames), step=SAMPLE_STEP)]
        self._plotted_frames = len(frames)
        commanded = np.array([f.lengths for f in shown])
        told = contraction(commanded)
        told[commanded.max(axis=-1) > LONGEST_COMMAND] = np.nan
        picture = servo_plot.render(
            np.array([f.time for f in shown]),
            told,
            contraction(internal_lengths(np.array([f.pose for f in shown]))),
            page=page,
            head=replay.head.module,
            on_pointer=self._pointer,
        )
        self._servos.content = picture + servo_plot.legend()
