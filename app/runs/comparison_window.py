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
from app.gui.viser_private import ModalHandle
from viz.report.report import ReportFigure, ReportSection, style
from viz.report.style import WIDTH

_PADDING: Final = 24
_BAR: Final = "ta-comparison"

# the figures are drawn for the dark: so is what they lie on, also where the app is light
_STYLE: Final = f"""
.mantine-Modal-content:has(.{_BAR}){{flex:0 0 min({WIDTH + 2 * _PADDING + 20}px,97vw)!important;
max-height:94dvh!important;border-radius:10px;background:#242424;color:#c9c9c9;--mantine-color-body:#242424}}
.mantine-Modal-content:has(.{_BAR}) .mantine-Modal-header{{display:none}}
.mantine-Modal-content:has(.{_BAR}) .mantine-Modal-body{{padding:0 {_PADDING}px 18px}}
div:has(>.{_BAR}){{position:sticky;top:0;z-index:1100}}
div:has(>div>.{_BAR}){{padding-top:0!important}}
.{_BAR}{{display:flex;flex-wrap:wrap;gap:6px 16px;align-items:center;margin:0 -{_PADDING}px;
padding:12px {_PADDING}px;background:var(--mantine-color-body);border-bottom:1px solid #ffffff1f}}
.{_BAR} b{{font-size:16px}}
.{_BAR} nav{{flex:1;display:flex;flex-wrap:wrap;gap:5px}}
.{_BAR} button{{border:0;border-radius:6px;background:#ffffff17;color:inherit;font:inherit;font-size:12.5px;
padding:4px 11px;cursor:pointer}}
.{_BAR} nav button{{border-radius:999px;background:#36b3a024;color:#7fd8ca}}
.{_BAR} button:hover,.{_BAR} button:focus-visible{{background:#ffffff2e}}
.{_BAR}-section{{scroll-margin-top:64px;padding-top:22px}}
.{_BAR}-section h2{{font-size:19px;font-weight:620;margin:0 0 12px}}
.{_BAR}-section p{{font-size:13.5px;max-width:86ch;opacity:.85;margin:0 0 14px}}
.{_BAR}-caption{{font-size:12.5px;opacity:.75;max-width:100ch;margin:2px 0 22px}}
"""

_KEYS: Final = (
    "var c=this.parentNode.querySelector('[data-c=\"close:0\"]'),o=this.closest('.mantine-Modal-inner');"
    "document.addEventListener('keydown',function k(e){"
    "if(!c.isConnected)document.removeEventListener('keydown',k);else if(e.key=='Escape')c.click()});"
    "if(o)o.addEventListener('click',function(e){if(e.target==o)c.click()})"
)
"""Escape and a click beside the window close it."""


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
            f'<style class="{name}">div:has(>.{name})+div{{max-width:{layout.width + 2}px}}'
            f"div:has(>.{name})+div>*{{border:0;background:none}}</style>"
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
        f"<style>{_STYLE}{style()}</style>"
        f'<div class="{_BAR}"><b>{html.escape(title)}</b><nav>{links}</nav>{buttons}'
        f'<img alt="" src="data:," style="display:none" onerror="{html.escape(_KEYS)}"></div>'
    )
