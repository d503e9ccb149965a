"""The left panel of one browser: which run, its maps, its trend, its generations."""

from __future__ import annotations

import dataclasses
import html
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import viser

from app.gui.browser_value import PageSize
from app.gui.click_channel import ClickChannel
from app.gui.page_channel import page_file, run_script
from app.gui.widgets import ignoring_event, in_a_row, put, put_html
from app.maps.color_controls import ColorControls, ColorWish
from app.maps.run_picker import RunPicker
from app.runs.library import run_state
from app.state import ShownRun
from engine.search.archive import Cell
from engine.storage.reader import RunReader
from engine.storage.rows import Generation
from viz import theme, words
from viz.maps.interaction import ENLARGE, SCRIPT, render_key
from viz.maps.map_parts import Ring
from viz.maps.map_pictures import MapPicture
from viz.runs import trend
from viz.runs.run_list import RunFacts, state_markup

KEYS = "← → ↑ ↓ choose · Enter replays · Space pauses"
PLAY_HINT = "Run through the generations, from the first one if the last is shown"
MAX_MAPS = 4
"""Maps shown at a time; no layout of the archives of this method has more."""


@dataclasses.dataclass(frozen=True, slots=True)
class ArchivesEvents:
    """What the panel reports."""

    run_chosen: Callable[[Path], None]
    generation_chosen: Callable[[int], None]
    cell_clicked: Callable[[str, Cell], None]
    layout_chosen: Callable[[str], None]
    colors_changed: Callable[[ColorWish], None]
    growth_played: Callable[[], None]
    space_pressed: Callable[[], None]


class ArchivesPanel:
    """Shows a run; keeps no state but what is on the screen.

    Args:
        client: the browser.
        facts: what is known of a run on offer.
        page: its size.
    """

    def __init__(self, client: viser.ClientHandle, facts: Callable[[Path], RunFacts], page: PageSize) -> None:
        gui = client.gui
        panel = gui.add_panel()
        with panel.add_tab("Maps", viser.Icon.GRID_DOTS):
            self.picker = RunPicker(gui, facts)
            """The list of runs."""
            self._status = gui.add_html("")
            self._notice = gui.add_html("")
            self._layout = gui.add_dropdown(
                "View", ("-",), visible=False, hint="How the archives of more than two axes are drawn"
            )
            self._colors = ColorControls(gui)
            self._cells = ClickChannel(gui)
            self._maps = [gui.add_html("") for _ in range(MAX_MAPS)]
            self._rings = gui.add_html("")
            self._slider = gui.add_slider(
                "Generation",
                min=0,
                max=1,
                step=1,
                initial_value=0,
                disabled=True,
                hint="Look at the maps as they were; the last generation follows a live run",
            )
            self._play = gui.add_button(
                "Grow", color="gray", disabled=True, hint=PLAY_HINT, icon=viser.Icon.PLAYER_PLAY
            )
            self._trend = gui.add_html("")
            self._keys = ClickChannel(gui, label="keys")
            gui.add_html(
                theme.TEXT_STYLE
                + f"<style data-ta-mark='plain'>{page_file('archives_panel.css', __package__)}</style>"
                + run_script(SCRIPT)
                + render_key("space", "key-space", self._keys.handler)
                + in_a_row((self._slider, 70), (self._play, 30))
            )
        panel.dock_left()
        panel.expand()  # which a phone's sheet would leave to the user
        page.fit_panel(panel, "left")

    def connect(self, events: ArchivesEvents) -> None:
        """Report from now on what the user does; call it once, when all that it is reported to is there."""
        self._cells.on_click(events.cell_clicked)
        self._keys.on_click(lambda _name, _cell: events.space_pressed())
        self.picker.on_choose(events.run_chosen)
        self._colors.on_change(events.colors_changed)
        self._play.on_click(ignoring_event(events.growth_played))

        @self._layout.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                events.layout_chosen(str(event.target.value))

        @self._slider.on_update
        def _(event: viser.GuiEvent) -> None:
            value = event.target.value
            # a browser may send anything; what Python sets has no client
            if event.client is not None and isinstance(value, int | float) and math.isfinite(value):
                events.generation_chosen(int(min(max(value, 0), self._slider.max)))

    def show_nothing(self, message: str) -> None:
        """Say why no maps are shown."""
        self._status.content = f'<div class="ta-status" style="padding:6px 10px">{message}</div>'
        self._clear()
        self.show_changes(())
        self._slider.disabled = self._play.disabled = True
        put(self._slider, 0)

    def show_status(
        self, reader: RunReader, generation: Generation | None, n: int, *, live: bool, complete: bool
    ) -> None:
        """Show how far the run is and the figures of a generation."""
        config = reader.config
        state = run_state(reader.path, live=live, complete=complete)
        failed = f", {generation.n_failed} failed" if generation and generation.n_failed else ""
        found = [f.best for f in generation.archives.values() if f.best is not None] if generation else []
        best = f" · best f<sub>s</sub> {100 * max(found):.2f} cm" if found else ""
        lines = [
            f"{html.escape(config.task)} · {html.escape(config.algorithm)} · {state_markup(state)}"
            f" · {html.escape(reader.created_at[:10])}",
            f"{n:,} of {config.evaluations:,} evaluations{failed}{best}",
        ]
        put_html(
            self._status,
            '<div class="ta-status" style="font-size:12.5px;line-height:1.5;opacity:.9;padding:0 10px 2px">'
            + "<br>".join(lines)
            + "</div>",
        )
        if generation is None:
            self._clear()
            self._slider.disabled = self._play.disabled = True
            put(self._slider, 0)
            self._maps[0].content = (
                '<div style="padding:24px 10px;opacity:.8">The maps appear when the first generation,'
                " all of random robots, has been evaluated.</div>"
            )

    def show_changes(self, changes: Sequence[str]) -> None:
        """Say what has changed since the run was made, if anything."""
        text = html.escape(", ".join(changes).replace("->", "→"))
        self._notice.content = (
            '<div class="ta-changes" style="font-size:11.5px;line-height:1.45;margin:2px 10px 4px;'
            'padding:3px 8px;border-left:2px solid #e0a458;opacity:.85">replays may differ: '
            f"{text}</div>"
            if changes
            else ""
        )

    def offer_views(
        self, layouts: Sequence[str], layout: str, colorings: Sequence[str], coloring: str
    ) -> None:
        """List the ways to draw the run's maps and to colour them."""
        if tuple(layouts) != tuple(self._layout.options):
            self._layout.options = tuple(layouts)
        put(self._layout, layout)
        self._colors.offer(colorings, coloring)
        self._layout.visible = len(layouts) > 1

    def show_maps(self, pictures: Sequence[MapPicture], rings: Sequence[Ring | None]) -> None:
        """Draw the maps of a generation, each with the mark of the chosen robot, if it has one."""
        lengths = [p.scale for p in pictures if p.scale.title.startswith("f_s")]
        self._colors.show_limits((lengths[0].low, lengths[0].high) if lengths else None)
        drawn = [self._draw(p, r) for p, r in zip(pictures, rings, strict=True)]
        drawn = drawn or [
            '<div style="padding:24px 10px;opacity:.8">Archives of two to four axes can be drawn;'
            " this run has none.</div>"
        ]
        for k, handle in enumerate(self._maps):
            put_html(handle, drawn[k] if k < len(drawn) else "")
        put_html(self._rings, "".join(p.ring_style(r) for p, r in zip(pictures, rings, strict=True)))

    def show_trend(self, run: ShownRun, shown: int) -> None:
        """Draw the trends of a run and put the slider at the shown generation."""
        if run.last is None or run.history is None:
            return
        last = run.last.number
        # before the trend: who sees that may move the slider at once
        put(self._slider, max(last, 1), "max")
        put(self._slider, last == 0, "disabled")
        put(self._play, last == 0, "disabled")
        put(self._slider, shown)
        drawn = trend.render(run.generations, run.history, shown)
        put_html(self._trend, f'<div style="padding:0 10px;max-width:420px">{drawn}</div>')

    def show_growth_playing(self, playing: bool) -> None:
        """Let the button by the slider stop what plays, or play."""
        self._play.label = "Hold" if playing else "Grow"
        self._play.icon = viser.Icon.PLAYER_PAUSE if playing else viser.Icon.PLAYER_PLAY

    def _draw(self, picture: MapPicture, ring: Ring | None) -> str:
        title = html.escape(picture.title)
        return (
            '<div class="ta-picture" style="padding:0 16px 0 10px"><div style="display:flex;gap:5px;'
            f'align-items:baseline;margin:2px 0 3px"><b title="{title}" style="font-size:12.5px;'
            f'flex:1;min-width:0;overflow:hidden;text-overflow:ellipsis;white-space:nowrap">{title}</b>'
            f'<span class="ta-figures" title="{_explanation(picture)}" style="font-size:10.5px;opacity:.8;'
            f'white-space:nowrap;cursor:help">{html.escape(picture.figures)}'
            f'</span><span class="ta-keys" style="font-size:11.5px">{KEYS}</span>{ENLARGE}</div>'
            f'<div style="max-width:410px">{picture.render(ring, self._cells.handler)}</div></div>'
        )

    def _clear(self) -> None:
        self._layout.visible = False
        for handle in (*self._maps, self._rings, self._trend):
            put_html(handle, "")


def _explanation(picture: MapPicture) -> str:
    """Return what a map's figures mean, escaped for an attribute."""
    sentences = [words.F_S, words.QD_SCORE, words.COVERAGE]
    still = max((e.still_below for e in picture.elites.values()), default=0.0)
    if still:
        sentences.append(words.STILL.format(still))
    if any(axis.name.startswith("PCA") for axis in picture.axes):
        sentences.append(words.PCA)
    return html.escape("\n".join(map(words.plain, sentences)))
