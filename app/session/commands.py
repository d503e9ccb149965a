"""The main actions of one browser in viser's command palette, which Ctrl+K opens."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import Final, Protocol

import viser
from viser import IconName

from app.gui.actions import Actions
from app.gui.widgets import ignoring_event
from app.maps.run_picker import RunPicker
from app.replay.scene import View
from app.runs.run_panel import RunPanel
from app.session.chosen_robot import ChosenRobot

LOOKS: Final[Sequence[tuple[View, str, str]]] = (
    ("frame", "Frame the robot", "It and its target, as F does"),
    ("top", "Look from above", "As T does"),
    ("side", "Look from beside", "As B does"),
    ("head", "Look at the head", "As H does"),
)


@dataclasses.dataclass(frozen=True, slots=True)
class PaletteCommand:
    """Something to do.

    Attributes:
        label: what it does, in an imperative.
        description: what there is to know about it.
        icon: one of viser's.
        action: does it.
    """

    label: str
    description: str
    icon: IconName
    action: Callable[[], None]


class Viewer(Protocol):
    """What can be asked of a session."""

    def open_next(self) -> None:
        """Show the next run of the list."""
        ...

    def show_generation(self, number: int) -> None:
        """Show the maps as they were."""
        ...

    def show_newest(self) -> None:
        """Show the maps as they are."""
        ...


def viewing_commands(
    session: Viewer, robot: ChosenRobot, actions: Actions, picker: RunPicker
) -> list[PaletteCommand]:
    """Return what everybody may do."""
    guarded, icon, downloads = actions.guarded, viser.Icon, robot.downloads
    return [
        PaletteCommand(
            "Choose a run",
            "Unfold the list of runs",
            icon.LIST,
            guarded(picker.show_list),
        ),
        PaletteCommand(
            "Show the next run", "The one below in the list", icon.ARROW_DOWN, guarded(session.open_next)
        ),
        PaletteCommand(
            "Show the first generation",
            "The maps as they began",
            icon.PLAYER_SKIP_BACK,
            guarded(lambda: session.show_generation(0)),
        ),
        PaletteCommand(
            "Show the newest generation",
            "The maps as they are, and as a live run goes on",
            icon.PLAYER_SKIP_FORWARD,
            guarded(session.show_newest),
        ),
        PaletteCommand(
            "Play or pause the replay", "As Space does", icon.PLAYER_PLAY, guarded(robot.player.toggle)
        ),
        PaletteCommand(
            "Replay from the start", "As the robot is dropped", icon.REFRESH, guarded(robot.replay_again)
        ),
        PaletteCommand(
            "Place the target",
            "Click on the ground where the robot is to crawl to",
            icon.TARGET,
            guarded(robot.place_target),
        ),
        *(
            PaletteCommand(label, hint, icon.CAMERA, guarded(functools.partial(robot.look, view)))
            for view, label, hint in LOOKS
        ),
        PaletteCommand(
            "Export this robot",
            "Download it as a zip: build sheet, parts, firmware, MJCF",
            icon.DOWNLOAD,
            guarded(downloads.export),
        ),
        PaletteCommand(
            "Add this robot to the basket",
            "Keep it, to download several at once",
            icon.BASKET,
            guarded(downloads.add),
        ),
        PaletteCommand(
            "Save the replay as a video",
            "An MP4 of the trial that is shown",
            icon.MOVIE,
            guarded(lambda: downloads.record("mp4")),
        ),
        PaletteCommand(
            "Save the replay as a page",
            "One HTML file that plays without a server",
            icon.FILE_CODE,
            guarded(lambda: downloads.record("html")),
        ),
    ]


def steering_commands(run: RunPanel, actions: Actions) -> list[PaletteCommand]:
    """Return what visitors may not do."""
    icon = viser.Icon
    return [
        PaletteCommand(
            "Start the new run",
            "As its form on the right says",
            icon.ROCKET,
            actions.slow(run.start_run),
        ),
        PaletteCommand(
            "Pause this run",
            "Its process saves and ends; Resume goes on exactly there",
            icon.PLAYER_PAUSE,
            actions.slow(run.pause_run),
        ),
        PaletteCommand(
            "Resume this run",
            "As if it had never stopped",
            icon.PLAYER_TRACK_NEXT,
            actions.slow(run.resume_run),
        ),
        PaletteCommand(
            "Stop this run",
            "Its process saves and ends",
            icon.PLAYER_STOP,
            actions.slow(run.stop_run),
        ),
    ]


def add_commands(gui: viser.GuiApi, commands: Sequence[PaletteCommand]) -> None:
    """Put commands into a browser's palette."""
    for command in commands:
        handle = gui.add_command(command.label, description=command.description, icon=command.icon)
        handle.on_trigger(ignoring_event(command.action))
