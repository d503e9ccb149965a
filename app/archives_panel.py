"""The left panel of one browser: which run, its maps, its trend, its generations."""

from __future__ import annotations

import dataclasses
import html
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import viser

from app.clicks import ClickChannel
from app.widgets import put
from engine.archive import Cell
from engine.reader import Generation, RunReader
from viz import trend
from viz.heatmap import Heatmap, render

WIDTH = 430
TITLES = {"morphology": "Morphology archive", "controller": "Controller archive"}
NO_RUNS = "no runs yet"


@dataclasses.dataclass(frozen=True, slots=True)
class Events:
    """What the panel reports."""

    run_chosen: Callable[[Path], None]
    generation_chosen: Callable[[int], None]
    cell_clicked: Callable[[str, Cell], None]


class ArchivesPanel:
    """Shows a run; keeps no state but what is on the screen."""

    def __init__(self, client: viser.ClientHandle, events: Events) -> None:
        gui = client.gui
        self._paths: dict[str, Path] = {}
        panel = gui.add_panel()
        with panel.add_tab("Archives", viser.Icon.GRID_DOTS):
            self._picker = gui.add_dropdown(
                "Run", (NO_RUNS,), hint="Runs in saved_archives/ and runs/, live ones included"
            )
            self._status = gui.add_html("")
            channel = ClickChannel(gui, events.cell_clicked)
            self._handler = channel.handler
            self._maps = {name: gui.add_html("") for name in TITLES}
            self._slider = gui.add_slider(
                "Generation",
                min=0,
                max=1,
                step=1,
                initial_value=0,
                disabled=True,
                hint="Look at the maps as they were; the last generation follows a live run",
            )
            self._trend = gui.add_html("")
        panel.dock_left()
        panel.set_width(WIDTH)

        @self._picker.on_update
        def _(event: viser.GuiEvent) -> None:
            path = self._paths.get(str(event.target.value))
            if event.client is not None and path is not None:
                events.run_chosen(path)

        @self._slider.on_update
        def _(event: viser.GuiEvent) -> None:
            value = event.target.value
            # a browser may send anything; what Python sets has no client
            if event.client is not None and isinstance(value, int | float) and math.isfinite(value):
                events.generation_chosen(int(min(max(value, 0), self._slider.max)))

    def offer(self, paths: Sequence[Path], chosen: Path | None) -> None:
        """List the runs on offer."""
        self._paths = label_paths(paths)
        labels = tuple(self._paths) or (NO_RUNS,)
        if labels != tuple(self._picker.options):
            self._picker.options = labels
        for label, path in self._paths.items():
            if path == chosen:
                put(self._picker, label)

    def show_nothing(self, message: str) -> None:
        """Say why no maps are shown."""
        self._status.content = f'<div class="ta-status" style="padding:6px 10px">{message}</div>'
        for handle in (*self._maps.values(), self._trend):
            handle.content = ""
        self._slider.disabled = True

    def show_status(
        self, reader: RunReader, generation: Generation | None, n: int, *, live: bool, complete: bool
    ) -> None:
        """Show how far the run is and the figures of a generation."""
        config = reader.config
        badge = '<b style="color:#36b3a0">● live</b>' if live else "finished"
        if not live and not complete:
            badge = '<span style="color:#e0a458">stopped</span>'
        failed = f", {generation.n_failed} failed" if generation and generation.n_failed else ""
        lines = [
            f"{html.escape(config.task)} · {html.escape(config.algorithm)} · {badge}",
            f"{n} of {config.evaluations} evaluations{failed} · {html.escape(reader.created_at[:10])}",
        ]
        self._status.content = (
            '<div class="ta-status" style="font-size:12.5px;line-height:1.5;opacity:.9;padding:0 10px 4px">'
            + "<br>".join(lines)
            + "</div>"
        )
        if generation is None:
            for handle in (*self._maps.values(), self._trend):
                handle.content = ""
            self._maps["morphology"].content = (
                '<div style="padding:24px 10px;opacity:.8">The maps appear when the first generation,'
                f" {config.initial} random robots, has been evaluated.</div>"
            )

    def show_maps(self, maps: dict[str, Heatmap], generation: Generation) -> None:
        """Draw the maps of a generation."""
        for name, handle in self._maps.items():
            heatmap = maps.get(name)
            if heatmap is None:
                handle.content = ""
                continue
            f = generation.archives[name]
            title = (
                '<div style="padding:0 10px"><div style="display:flex;justify-content:space-between;'
                'align-items:baseline;margin:2px 0 3px"><b style="font-size:13px">' + TITLES[name] + "</b>"
                '<span style="font-size:11.5px;opacity:.75">'
                f"{len(heatmap.tiles)} cells, {f.coverage:.0%} · QD score {100 * f.qd_score:.0f} cm"
                "</span></div>"
            )
            svg = f'<div style="max-width:410px">{render(heatmap, self._handler)}</div></div>'
            handle.content = title + svg

    def show_trend(self, generations: Sequence[Generation], shown: int) -> None:
        """Draw the trend and put the slider at the shown generation."""
        drawn = trend.render(generations, "morphology", shown)
        self._trend.content = f'<div style="padding:0 10px">{drawn}</div>'
        last = generations[-1].number
        if self._slider.max != max(last, 1):
            self._slider.max = max(last, 1)
        self._slider.disabled = last == 0
        put(self._slider, shown)


def label_paths(paths: Sequence[Path]) -> dict[str, Path]:
    """Return short, distinct labels for run files: as many folders of the path as it takes."""
    labels: dict[str, Path] = {}
    for path in paths:
        parts = path.with_suffix("").parts
        label = next(
            ("/".join(parts[-n:]) for n in range(1, len(parts)) if _ends(paths, parts[-n:]) == 1), str(path)
        )
        labels[label] = path
    return labels


def _ends(paths: Sequence[Path], end: tuple[str, ...]) -> int:
    return sum(p.with_suffix("").parts[-len(end) :] == end for p in paths)
