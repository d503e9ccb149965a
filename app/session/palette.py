"""The main actions of one browser in viser's command palette, which Ctrl+K opens."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import viser
from viser import IconName


@dataclasses.dataclass(frozen=True, slots=True)
class Command:
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


def add_commands(gui: viser.GuiApi, commands: Sequence[Command]) -> None:
    """Put commands into a browser's palette."""
    for command in commands:
        handle = gui.add_command(command.label, description=command.description, icon=command.icon)
        handle.on_trigger(_ignoring_the_event(command.action))


def _ignoring_the_event(action: Callable[[], None]) -> Callable[[object], None]:
    return lambda _event: action()
