"""The downloads of one browser: connects the panel with the chosen robot, its replay and the basket."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Sequence
from typing import Final

import viser

from app.downloads.basket import (
    MEMORY_KEY,
    MOST,
    BasketItem,
    added,
    export_basket,
    exported,
    item_of,
)
from app.downloads.basket_panel import BasketEvents, BasketPanel
from app.downloads.buildable import instead_of, problems_of
from app.downloads.recording import recording
from app.gui.actions import Actions
from app.gui.file_maker import FileMaker, MadeFile, ProgressCallback
from app.gui.remembered_robots import Kept, RememberedRobots
from app.gui.top_bar import TopBar
from app.limits import SimulationBudget
from app.replay.player import Player
from app.runs.library import Library
from app.runs.run_names import find_run, run_name
from app.state import Choice, Selection, ShownRun
from engine.analysis.elite_table import csv_bytes, elite_table
from engine.errors import InvalidData, TensAtlasError, printable
from engine.files import zip_bytes
from engine.replay.replay import Replay
from engine.replay.trial import TrialChoice
from engine.search.archive import cell_name
from engine.storage.reader import RunReader
from viz.atlas.page import atlas_page
from viz.atlas.shown import what_to_show

LOOKED_AT: Final = 4.0
"""Seconds after which a chosen robot's buildability is found out, which may take half a second of CPU."""

log = logging.getLogger(__name__)

VIDEO_PRICE = 5
"""A video costs a visitor as much as so many replays."""
NO_ROBOT = "Click a filled cell of a map first."


class Downloads:
    """Makes the files that a user asks for, and keeps the basket.

    Args:
        client: the browser.
        bar: of the browser.
        run: that is shown.
        choice: the chosen robot and its trial.
        library: the runs.
        actions: of the browser.
        maker: of its files.
        player: of the replay that is shown.
        budget: how much the browser may still simulate.
        judged: called with a material, why the chosen robot cannot be built from it, and what is instead.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        bar: TopBar,
        run: ShownRun,
        choice: Choice,
        library: Library,
        actions: Actions,
        maker: FileMaker,
        player: Player,
        *,
        budget: SimulationBudget,
        judged: Callable[[str, Sequence[str], str], None],
    ) -> None:
        self._run, self._choice, self._library, self._actions = run, choice, library, actions
        self._maker, self._player, self._budget = maker, player, budget
        self._basket: tuple[BasketItem, ...] = ()
        self._memory: RememberedRobots | None = None
        guarded = actions.guarded
        self.panel = BasketPanel(
            client,
            bar,
            BasketEvents(
                record=guarded(self.record),
                table=guarded(self.table),
                atlas=guarded(self.atlas),
                add=guarded(self.add),
                remove=guarded(self.remove),
                clear=guarded(self.clear),
                download=guarded(self.download),
            ),
        )

        self._judged = judged
        self.judge = actions.slow(self._judge)
        """Say whether the chosen robot can be built from the chosen material."""
        self.panel.exports.on_material(self.judge)

    def judge_later(self) -> None:
        """Do so once the chosen robot has been looked at for a while: it is to crawl first."""
        chosen = self._choice.selection

        def still_there() -> None:
            if chosen is not None and self._choice.selection is chosen:
                self.judge()

        timer = threading.Timer(LOOKED_AT, still_there)
        timer.daemon = True
        timer.start()

    def _judge(self) -> None:
        chosen, material = self._choice.selection, self.panel.exports.material
        if chosen is not None:
            body = chosen.evaluation.solution.morphology
            problems = problems_of(body, material)
            instead = instead_of(body, str(material)) if problems else ""
            if self._choice.selection is chosen:  # nobody has gone on in the meantime
                self._judged(str(material), problems, instead)

    @property
    def basket(self) -> tuple[BasketItem, ...]:
        """The robots in the basket."""
        return self._basket

    def begin(self, gui: viser.GuiApi) -> None:
        """Ask the browser what its basket held before the page was loaded again.

        Args:
            gui: at a place that is always on the page.
        """
        self._memory = RememberedRobots(gui, MEMORY_KEY, MOST, self._actions.guarded(self._restore))

    def export(self) -> None:
        """Send the folder of the chosen robot as a zip.

        Raises:
            InvalidData: no robot is chosen, another file is being made, or paper or material is none on
                offer.
        """
        (reader, item), choice = self._chosen_item(), self.panel.exports.choice
        name = item.name

        def make(progress: ProgressCallback) -> MadeFile:
            files = exported(item, reader, progress, choice)
            progress("packing", 1, 1)
            return f"{name}.zip", zip_bytes(files, name)

        self._start(f"{name}.zip", make, self._seconds(reader))

    def add(self) -> None:
        """Put the chosen robot into the basket.

        Raises:
            InvalidData: no robot is chosen, it is there already, or the basket is full.
        """
        self._put(added(self._basket, self._chosen_item()[1]))

    def remove(self, position: int) -> None:
        """Take a robot out of the basket; an unknown position does nothing."""
        self._put(tuple(item for k, item in enumerate(self._basket) if k != position))

    def clear(self) -> None:
        """Take all robots out."""
        self._put(())

    def download(self) -> None:
        """Send the exports of all robots in the basket as one zip.

        Raises:
            InvalidData: it is empty, another file is being made, or paper or material is none on offer.
        """
        items, choice = self._basket, self.panel.exports.choice
        if not items:
            raise InvalidData("The basket is empty; add the chosen robot first.")
        seconds = sum(self._seconds(self._library.reader(i.path)) for i in items)

        def make(progress: ProgressCallback) -> MadeFile:
            name = "tensatlas_basket"
            files = export_basket(items, self._library.reader, progress, choice)
            return f"{name}.zip", zip_bytes(files, name)

        self._start("the basket", make, seconds)

    def record(self, kind: str) -> None:
        """Send the trial that is shown as a page, a picture of the present moment or a video.

        Raises:
            InvalidData: no robot is chosen.
        """
        reader, chosen = self._chosen()
        trial, moment, run = self._choice.trial, self._player.time, printable(reader.path.stem)
        # a new one: the replay that is played may be cancelled at any time
        replay = Replay.of(reader.config, chosen.evaluation, trial)
        where = chosen.archive if chosen.cell is None else f"{chosen.archive} cell {cell_name(chosen.cell)}"
        name = f"{run}_robot_{chosen.number}_{_file_part(trial)}.{kind}"

        def make(progress: ProgressCallback) -> MadeFile:
            content = recording(
                replay,
                kind,
                run=run,
                where=where,
                entered=chosen.entered,
                at=moment,
                progress=progress,
            )
            return name, content

        self._start(name, make, self._seconds(reader) * (VIDEO_PRICE if kind == "mp4" else 1))

    def table(self) -> None:
        """Send the elites of the shown run as CSV."""
        reader = self._reader()
        name = f"{printable(reader.path.stem)}.csv"
        self._start(name, lambda _: (name, csv_bytes(elite_table(reader))), 0.0)

    def atlas(self) -> None:
        """Send the shown run as a page with its maps and every elite.

        Raises:
            RunFileError: it has no finished generation, or is damaged.
            ExportError: there is nothing to show.
            InvalidData: another file is being made, or what lies beside the run is damaged.
        """
        reader = self._reader()
        name, shown = f"{printable(reader.path.stem)}_atlas.html", what_to_show(reader)

        def make(progress: ProgressCallback) -> MadeFile:
            return name, atlas_page(
                reader, shown=shown, progress=lambda n, total: progress("simulating", n, total)
            )

        self._start(name, make, shown.seconds)

    def _start(self, what: str, make: Callable[[ProgressCallback], MadeFile], seconds: float) -> None:
        def paid(progress: ProgressCallback) -> MadeFile:
            self._budget.spend(seconds)
            return make(progress)

        self._maker.start(what, paid)

    def _put(self, items: tuple[BasketItem, ...]) -> None:
        self._basket = items
        self.panel.show_basket(items)
        if self._memory is not None:
            paths = self._library.runs()
            named = [(run_name(i.path, paths), i.number) for i in items]
            self._memory.keep([(name, number) for name, number in named if name is not None])

    def _restore(self, kept: list[Kept], _marked: bool) -> None:
        """Put back what the basket held; say so if some of it is gone."""
        paths, items = self._library.runs(), self._basket
        for name, number in kept:
            path = find_run(name, paths)
            try:
                if path is not None:
                    reader = self._library.reader(path)
                    items = added(items, item_of(reader, reader.evaluation(number)))
            except TensAtlasError:
                log.info("robot %d of %s cannot be put back into a basket", number, path)
        if items != self._basket:
            self._put(items)
        if len(items) < len(kept):
            self._actions.notify("The basket", "Some of its robots are not here any more.")

    def _seconds(self, reader: RunReader) -> float:
        trials = reader.config.trials
        return trials.settle_time + trials.trial_time

    def _reader(self) -> RunReader:
        return self._library.shown(self._run.path)

    def _chosen_item(self) -> tuple[RunReader, BasketItem]:
        reader, chosen = self._chosen()
        return reader, item_of(reader, chosen.evaluation, chosen.archive, chosen.own_cell)

    def _chosen(self) -> tuple[RunReader, Selection]:
        if self._choice.selection is None:
            raise InvalidData(NO_ROBOT)
        return self._reader(), self._choice.selection


def _file_part(trial: TrialChoice) -> str:
    """Return the part of a recording's name that tells its target."""
    if trial.aim is None:
        return f"target_{trial.target + 1}"
    return f"target_at_{trial.aim.bearing}_degrees_{trial.aim.distance}_cm"
