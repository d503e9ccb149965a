"""Breeding in one browser: the designer chooses parents, sees their children come, and breeds again."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import viser

from app.gui.actions import Actions
from app.gui.click_channel import ClickChannel
from app.gui.widgets import put, put_html
from app.runs import launcher
from app.runs.launcher import NewRun
from app.runs.library import NEW_RUNS, Library, RunStatus
from engine.errors import InvalidData, RunFileError, printable
from engine.runs.breeding import MAX_PARENTS, Breeding, Held, breeding_config
from engine.storage.reader import RunReader
from engine.storage.schema import SUFFIX
from engine.tasks import get_task
from viz.robot import breeding_strip

Robot = tuple[Path, int]
"""Run and number of a robot."""
GENERATIONS: Final = 5
"""That are bred at first."""
MOST_GENERATIONS: Final = 30
_PREFIX: Final = "breed-"


class BreedPanel:
    """Starts runs from chosen robots and shows their children.

    Args:
        gui: of the browser.
        container: to build it in.
        actions: of the browser.
        library: the runs.
        sources: return the robots that can be chosen, by the names of their buttons; the first one has the
            robot that is shown.
        show: called with a run that was started.
        replay: called with a robot that the user wants to see.
        tell: called with how many robots are marked to be bred from.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        container: Any,
        actions: Actions,
        library: Library,
        sources: Mapping[str, Callable[[], Sequence[Robot]]],
        *,
        show: Callable[[Path], None],
        replay: Callable[[Path, int], None],
        tell: Callable[[int], None],
    ) -> None:
        self._actions, self._library, self._sources = actions, library, sources
        self._show, self._replay, self._tell = show, replay, tell
        self._parents: list[Robot] = []
        self._path: Path | None = None
        self._live = self._is_mine = False
        self._dropped: set[int] = set()
        self._shown: int | None = None
        with container:
            self._handler = ClickChannel(gui, actions.guarded(self._clicked), label="breeding").handler
            self._chosen = gui.add_html("")
            add = gui.add_button_group("Add", tuple(sources), hint="Robots to breed from, up to eight")
            self._strength = gui.add_slider(
                "Children",
                min=0.0,
                max=1.0,
                step=0.05,
                initial_value=0.25,
                marks=((0.0, "near"), (0.5, "usual"), (1.0, "far")),
                hint="How strongly bodies and networks are mutated: near their parents, or far from them",
            )
            self._bodies = gui.add_checkbox(
                "Same bodies", False, hint="Only the networks of the children are mutated"
            )
            self._networks = gui.add_checkbox(
                "Same networks", False, hint="Only the bodies of the children are mutated"
            )
            self._generations = gui.add_slider(
                "Generations",
                min=1,
                max=MOST_GENERATIONS,
                step=1,
                initial_value=GENERATIONS,
                hint="Eight children each; those that do best, or that do something new, become parents",
            )
            self._follow = gui.add_checkbox(
                "Replay the best", True, hint="Let the best child crawl as soon as it is born"
            )
            self._breed = gui.add_button(
                "Breed", icon=viser.Icon.HEART, hint="Evolve from the robots above, or from the one you see"
            )
            self._stop = gui.add_button(
                "Stop breeding",
                icon=viser.Icon.PLAYER_STOP,
                color="gray",
                visible=False,
                hint="Save the children and end this run; Resume goes on",
            )
            self._children = gui.add_html("")

        @add.on_click
        def _(event: viser.GuiEvent) -> None:
            self._actions.guarded(self.add)(str(event.target.value))

        # either the bodies or the networks must change
        for box, other in ((self._bodies, self._networks), (self._networks, self._bodies)):
            box.on_update(functools.partial(_untick, other))
        self._breed.on_click(actions.slow(self.breed))
        self._stop.on_click(actions.slow(self.stop))
        self._draw_parents()

    @property
    def parents(self) -> tuple[Robot, ...]:
        """The robots that will be bred from."""
        return tuple(self._parents)

    def add(self, source: str) -> None:
        """Add the robots of a source to those that will be bred from.

        Raises:
            InvalidData: there are none, or there is no room for all of them.
        """
        found = self._sources[source]() if source in self._sources else ()
        if not found:
            raise InvalidData(f"There is nothing to add from {source.lower()}.")
        new = [robot for robot in dict.fromkeys(found) if robot not in self._parents]
        room = MAX_PARENTS - len(self._parents)
        self._parents += new[:room]
        self._draw()
        if len(new) > room:
            raise InvalidData(
                f"Up to {MAX_PARENTS} robots can be bred at once; {len(new) - room} are left out."
            )

    def breed(self) -> None:
        """Start a run from the chosen robots, or from the one that is shown, and show it.

        Raises:
            InvalidData: there is none, or they cannot be bred together.
            RunFileError: the run did not start.
        """
        with self._actions.mutex:
            robots = self._parents or list(self._sources[next(iter(self._sources))]())
            configs = [self._library.reader(path).config for path, _ in robots]
        if not robots:
            raise InvalidData("Click a robot on a map first: it is the parent.")
        name, k = _free_name()
        held: Held = "bodies" if self._bodies.value else "controllers" if self._networks.value else "nothing"
        config = breeding_config(
            Breeding(
                strength=float(self._strength.value),
                hold=held,
                generations=int(self._generations.value),
                seed=k,
            ),
            configs,
        )
        given = tuple(f"{path}#{number}" for path, number in robots)
        new = NewRun(
            name=name,
            preset="quick",
            config=config,
            workers=os.cpu_count() or 1,
            given=given,
            in_one_process=True,
        )
        self._breed.disabled = True
        try:
            if self._live and self._is_mine:
                self.stop()  # two at once would take each other's time
            path = launcher.start(new)
        finally:
            self._breed.disabled = False
        with self._actions.mutex:
            self._parents = []
            self._show(path)
            self._is_mine = True
            self._draw()

    def stop(self) -> None:
        """End the run that is bred; what is finished is saved.

        Raises:
            RunFileError: it is not running.
        """
        if self._path is not None:
            launcher.stop(self._path)

    def begin(self, path: Path, reader: RunReader) -> None:
        """Show the children of a run if it was bred; any other leaves those that are shown."""
        if reader.config.map_search.fill != "mutants" or path == self._path:
            return
        self._path, self._shown, self._is_mine = path, None, False
        self._dropped.clear()
        status = self._library.status(path)
        self._live = status.live
        self._library.watch(self, path, self._moved, status)
        self._draw()

    def cancel(self) -> None:
        """Watch no run any more."""
        self._library.unwatch(self)

    def _moved(self, path: Path, status: RunStatus) -> None:
        """Show new children; on the library's thread, which waits for no browser."""

        def update() -> None:
            if path == self._path:
                self._live = status.live
                self._draw()

        self._actions.put("children", update)

    def _clicked(self, name: str, index: tuple[int, ...]) -> None:
        if name == "unmark":
            del self._parents[index[0] : index[0] + 1]
        number = breeding_strip.clicked_number(index)
        if number is not None and self._path is not None:
            robot = self._path, number
            if name == "replay":
                put(self._follow, False)
                self._play(number)
            elif name == "drop":
                self._dropped.add(number)
                self._parents = [parent for parent in self._parents if parent != robot]
            elif name == "keep" and robot in self._parents:
                self._parents.remove(robot)
            elif name == "keep":
                if len(self._parents) >= MAX_PARENTS:
                    raise InvalidData(f"Up to {MAX_PARENTS} robots can be bred at once.")
                self._parents.append(robot)
        self._draw()

    def _play(self, number: int) -> None:
        assert self._path is not None
        self._shown = number
        self._replay(self._path, number)

    def _draw(self) -> None:
        self._draw_parents()
        put(self._stop, self._live, "visible")
        if self._path is None:
            return
        try:
            reader = self._library.reader(self._path)
        except RunFileError:  # it was renamed or deleted
            self._path, self._live = None, False
            put_html(self._children, "")
            return
        distance = get_task(reader.config.task).target_distance
        given, born = breeding_strip.tiles_of(reader.records(), distance)
        best = next((t.number for t in born if t.f_s is not None and t.number not in self._dropped), None)
        if self._is_mine and self._follow.value and best is not None and best != self._shown:
            self._play(best)
        put(self._breed, "Breed again" if born else "Breed", "label")
        name = printable(self._path.stem)
        n = reader.config.evaluations - len(reader.given())
        kept = {number for path, number in self._parents if path == self._path}
        content = breeding_strip.render_children(
            given,
            born,
            kept=kept,
            dropped=self._dropped,
            shown=self._shown,
            heading=f"{name}: {len(born)} of {n} children" + (", being born" if self._live else ""),
            handler=self._handler,
        )
        put_html(self._children, content)

    def _draw_parents(self) -> None:
        drawn = []
        for path, number in list(self._parents):
            try:
                evaluation = self._library.reader(path).evaluation(number)
            except RunFileError:
                self._parents.remove((path, number))
                continue
            body = evaluation.solution.morphology
            head = body.n_modules - 1 if evaluation.head_is_end else 0
            drawn.append((f"{printable(path.stem)} {number}", body, head))
        self._tell(len(drawn))
        put_html(self._chosen, breeding_strip.render_parents(drawn, self._handler))


def _untick(other: viser.GuiCheckboxHandle, event: viser.GuiEvent) -> None:
    if event.target.value:
        put(other, False)


def _free_name() -> tuple[str, int]:
    """Return a name that no run has yet, and its number."""
    k = 1
    while (NEW_RUNS / f"{_PREFIX}{k}{SUFFIX}").exists():
        k += 1
    return f"{_PREFIX}{k}", k
