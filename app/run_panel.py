"""Run control of one browser, below the robot: the shown run's progress, and new runs."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import viser

from app import evolution
from app.actions import Actions
from app.evolution import NewRun, choices
from app.widgets import put
from engine.config import PRESETS, RunConfig
from engine.errors import InvalidData


class RunPanel:
    """Starts, stops and resumes runs.

    Args:
        client: the browser; the folders go into its main panel.
        actions: of the browser.
        shown: returns the run that is shown, None if none is.
        show: called with a run that was started.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        actions: Actions,
        *,
        shown: Callable[[], Path | None],
        show: Callable[[Path], None],
    ) -> None:
        gui, defaults = client.gui, RunConfig()
        self._actions, self._shown, self._show = actions, shown, show
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
            self._name = gui.add_text("Name", "my-run", hint="Becomes runs/NAME.tsmr")
            self._task = gui.add_dropdown(
                "Task", choices("task"), initial_value=defaults.task, hint="What the robots are asked to do"
            )
            self._algorithm = gui.add_dropdown(
                "Algorithm",
                choices("algorithm"),
                initial_value=defaults.algorithm,
                hint="How bodies and controllers are searched",
            )
            self._preset = gui.add_dropdown(
                "Preset",
                tuple(PRESETS),
                initial_value="quick",
                hint="smoke: seconds. quick: about an hour. paper: the published experiment, days",
            )
            self._evaluations = gui.add_number(
                "Evaluations",
                PRESETS["quick"].evaluations,
                min=2,
                max=1_000_000,
                step=1,
                hint="Robots to evaluate in all",
            )
            self._seed = gui.add_number("Seed", 1, min=0, max=2**32 - 1, step=1, hint="Same seed, same maps")
            n_cores = os.cpu_count() or 1
            self._workers = gui.add_slider(
                "Workers",
                min=1,
                max=max(n_cores, 2),
                step=1,
                initial_value=n_cores,
                hint="Threads that simulate; the result does not depend on it",
            )
            self._start = gui.add_button("Start", icon=viser.Icon.PLAYER_PLAY)

        @self._preset.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None and event.target.value in PRESETS:
                put(self._evaluations, PRESETS[event.target.value].evaluations)

        self._start.on_click(lambda _event: actions.guarded(self._start_run, alone=False)())
        self._stop.on_click(lambda _event: actions.guarded(self._stop_run, alone=False)())
        self._resume.on_click(lambda _event: actions.guarded(self._resume_run, alone=False)())

    def show_run(self, n: int, budget: int, *, live: bool, complete: bool) -> None:
        """Show how far the run is and what can be done with it."""
        put(self._progress, 100.0 * min(n / budget, 1.0))
        self._stop.disabled = not live
        self._resume.disabled = live or complete

    def _start_run(self) -> None:
        self._start.disabled = True
        try:
            path = evolution.start(
                NewRun(
                    name=str(self._name.value),
                    task=str(self._task.value),
                    algorithm=str(self._algorithm.value),
                    preset=str(self._preset.value),
                    evaluations=int(self._evaluations.value),
                    seed=int(self._seed.value),
                    workers=int(min(max(self._workers.value, 1), 256)),
                )
            )
        finally:
            self._start.disabled = False
        with self._actions.mutex:
            self._show(path)
        self._actions.notify("Started", f"{path.name} evolves in a process of its own.")

    def _stop_run(self) -> None:
        path = self._path()
        evolution.stop(path)
        self._actions.notify("Stopping", f"{path.name} saves what is finished and stops.")

    def _resume_run(self) -> None:
        evolution.resume(self._path(), workers=os.cpu_count() or 1)

    def _path(self) -> Path:
        path = self._shown()
        if path is None:
            raise InvalidData("Choose a run first.")
        return path
