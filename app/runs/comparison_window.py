"""The window over the app that shows a comparison: the report's sections, wide enough for its figures.

viser's docked panels are narrower than a figure may be without its type becoming too small; its modal
windows are made as wide as the figures here, and get a bar that stays in sight.
"""

from __future__ import annotations

import html
import threading
from collections.abc import Callable, Sequence
from typing import Final

import viser

from app.gui.click_channel import ClickChannel
from app.gui.page_channel import page_file, run_script
from app.gui.viser_private import ModalHandle
from viz.report.report import ReportFigure, ReportSection, style
from viz.report.style import WIDTH

_BAR: Final = "ta-comparison"
"""Class of the bar; the classes and ids of all else begin with it."""
_BESIDE: Final = 68
"""Pixels of the window that are beside its figures: padding and a scroll bar."""


class ComparisonWindow:
    """Shows one comparison at a time.

    Args:
        client: the browser.
        download: called when the user wants the report as a file.
    """

    def __init__(self, client: viser.ClientHandle, *, download: Callable[[], None]) -> None:
        self._gui = client.gui
        self._download = download
        self._modal: ModalHandle | None = None
        self._mutex = threading.Lock()

    def show(self, title: str, sections: Sequence[ReportSection]) -> None:
        """Open the window, in place of one that is open.

        Args:
            title: what is compared.
            sections: to show, drawn for a dark background.
        """
        self.close()
        gui = self._gui
        modal = self._modal = gui.add_modal(title)
        with modal:
            handler = ClickChannel(gui, self._clicked, label="comparison").handler
            gui.add_html(_bar(title, sections, handler))
            for k, section in enumerate(sections):
                gui.add_html(
                    f'<section id="{_BAR}-{k}" class="{_BAR}-section"><h2>{html.escape(section.title)}</h2>'
                    f'<div class="ta-scroll">{section.lead}</div></section>'
                )
                for j, figure in enumerate(section.figures):
                    self._add_figure(figure, f"{_BAR}-figure-{k}-{j}")

    def close(self) -> None:
        """Close the window if it is open."""
        with self._mutex:
            modal, self._modal = self._modal, None
        if modal is not None:
            modal.close()

    def _add_figure(self, figure: ReportFigure, name: str) -> None:
        layout = figure.figure.layout
        # viser stretches figures to the whole width: a smaller one keeps its size
        self._gui.add_html(
            f'<style data-ta-mark="{name}">[data-ta-in~="{name}-1"]+div{{max-width:{layout.width + 2}px}}'
            f'[data-ta-in~="{name}-1"]+div>*{{border:0;background:none}}</style>'
        )
        self._gui.add_plotly(
            figure.figure,
            aspect=layout.height / layout.width,
            config={
                "displaylogo": False,
                "modeBarButtonsToRemove": ["select2d", "lasso2d", "autoScale2d"],
                "toImageButtonOptions": {"format": "svg", "filename": figure.name},
            },
        )
        self._gui.add_html(f'<div class="{_BAR}-caption">{figure.caption}</div>')

    def _clicked(self, name: str, _index: tuple[int, ...]) -> None:
        if name == "close":
            self.close()
        elif name == "report":
            self._download()


def _bar(title: str, sections: Sequence[ReportSection], handler: str) -> str:
    links = "".join(
        f'<button type="button" title="Scroll to this part" onclick="document.getElementById('
        f"'{_BAR}-{k}').scrollIntoView({{behavior:'smooth'}})\">{html.escape(s.title)}</button>"
        for k, s in enumerate(sections)
    )
    buttons = "".join(
        f'<button type="button" data-c="{name}:0" onclick="{handler}" title="{hint}">{text}</button>'
        for name, text, hint in (
            ("report", "⤓ Report", "Download this as one HTML page that opens anywhere"),
            ("close", "Close", "Back to the maps (Esc)"),
        )
    )
    return (
        f"<style>.mantine-Modal-content[data-ta-in~=comparison]{{--ta-width:{WIDTH + _BESIDE}px}}"
        f"{page_file('comparison_window.css', __package__)}{style()}</style>"
        f'<div class="{_BAR}" data-ta-mark="comparison">'
        f"<b>{html.escape(title)}</b><nav>{links}</nav>{buttons}"
        f"{run_script(page_file('comparison_window.js', __package__))}</div>"
    )
