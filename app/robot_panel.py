"""The right panel of one browser: the chosen robot, and runs to start and stop."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable

import viser

from app.evolution import NewRun, choices
from app.widgets import put
from engine.config import PRESETS, RunConfig
from engine.evaluation import Evaluation
from viz import network_diagram, robot_card

WIDTH = 330
WELCOME = (
    "**1** · Every cell of a map is a robot: the best of its kind.\n\n"
    "**2** · Click a filled cell to watch it crawl towards its target, the cyan post.\n\n"
    "**3** · Take it along with *Export*, or evolve your own below."
)


@dataclasses.dataclass(frozen=True, slots=True)
class Events:
    """What the panel reports."""

    export: Callable[[], None]
    start: Callable[[NewRun], None]
    stop: Callable[[], None]
    resume: Callable[[], None]


def dock(gui: viser.GuiApi) -> None:
    """Put a browser's main panel to the right, where what is said about a robot goes."""
    gui.set_panel_label("TensAtlas")
    gui.main_panel.dock_right()
    gui.main_panel.set_width(WIDTH)


class RobotPanel:
    """Shows a robot and the run control."""

    def __init__(self, client: viser.ClientHandle, events: Events) -> None:
        gui, defaults = client.gui, RunConfig()
        dock(gui)
        with gui.add_folder("Robot"):
            self._welcome = gui.add_markdown(WELCOME)
            self._card = gui.add_html("")
            self._export = gui.add_button(
                "Export",
                icon=viser.Icon.DOWNLOAD,
                disabled=True,
                hint="Download this robot as a zip: MJCF, genotypes, bill of materials",
            )
            with gui.add_folder("Controller network", expand_by_default=False):
                self._network = gui.add_html('<div style="opacity:.7">no robot chosen</div>')
        with gui.add_folder("This run"):
            self._progress = gui.add_progress_bar(0.0)
            self._stop = gui.add_button(
                "Stop", icon=viser.Icon.PLAYER_STOP, disabled=True, hint="Save and stop"
            )
            self._resume = gui.add_button(
                "Resume",
                icon=viser.Icon.PLAYER_TRACK_NEXT,
                disabled=True,
                hint="Go on with this run",
            )
        with gui.add_folder("New run", expand_by_default=False):
            name = gui.add_text("Name", "my-run", hint="Becomes runs/NAME.tsmr")
            task = gui.add_dropdown(
                "Task", choices("task"), initial_value=defaults.task, hint="What the robots are asked to do"
            )
            algorithm = gui.add_dropdown(
                "Algorithm",
                choices("algorithm"),
                initial_value=defaults.algorithm,
                hint="How bodies and controllers are searched",
            )
            preset = gui.add_dropdown(
                "Preset",
                tuple(PRESETS),
                initial_value="quick",
                hint="smoke: seconds. quick: about an hour. paper: the published experiment, days",
            )
            evaluations = gui.add_number(
                "Evaluations",
                PRESETS["quick"].evaluations,
                min=2,
                max=1_000_000,
                step=1,
                hint="Robots to evaluate in all",
            )
            seed = gui.add_number("Seed", 1, min=0, max=2**32 - 1, step=1, hint="Same seed, same maps")
            n_cores = os.cpu_count() or 1
            workers = gui.add_slider(
                "Workers",
                min=1,
                max=max(n_cores, 2),
                step=1,
                initial_value=n_cores,
                hint="Threads that simulate; the result does not depend on it",
            )
            self._start = gui.add_button("Start", icon=viser.Icon.PLAYER_PLAY)

        @preset.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None and event.target.value in PRESETS:
                put(evaluations, PRESETS[event.target.value].evaluations)

        @self._export.on_click
        def _(_event: viser.GuiEvent) -> None:
            events.export()

        @self._start.on_click
        def _(_event: viser.GuiEvent) -> None:
            self._start.disabled = True
            try:
                events.start(
                    NewRun(
                        name=str(name.value),
                        task=str(task.value),
                        algorithm=str(algorithm.value),
                        preset=str(preset.value),
                        evaluations=int(evaluations.value),
                        seed=int(seed.value),
                        workers=int(min(max(workers.value, 1), 256)),
                    )
                )
            finally:
                self._start.disabled = False

        @self._stop.on_click
        def _(_event: viser.GuiEvent) -> None:
            events.stop()

        @self._resume.on_click
        def _(_event: viser.GuiEvent) -> None:
            events.resume()

    def show_robot(self, config: RunConfig, evaluation: Evaluation, where: str, entered: int | None) -> None:
        """Show a robot."""
        self._welcome.visible = False
        self._card.content = robot_card.render(config, evaluation, where, entered)
        s = evaluation.solution
        self._network.content = network_diagram.render(s.controller, s.morphology.n_modules)
        self._export.disabled = False

    def show_no_robot(self) -> None:
        """Show none, as at the start."""
        self._welcome.visible = True
        self._card.content = self._network.content = ""
        self._export.disabled = True

    def show_run(self, n: int, budget: int, *, live: bool, complete: bool) -> None:
        """Show how far the run is and what can be done with it."""
        put(self._progress, 100.0 * min(n / budget, 1.0))
        self._stop.disabled = not live
        self._resume.disabled = live or complete
