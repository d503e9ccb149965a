"""Clicks on pictures. No picture element of viser reports them, so they come through a hidden input."""

from __future__ import annotations

import re
from collections.abc import Callable

import viser

from app.widgets import selector

_CLICK = re.compile(r"([a-z0-9-]{1,40}):(\d{1,3}(?:,\d{1,3}){0,5})\|\d{1,16}")

_SCRIPT = (
    "var t=event.target.closest('[data-c]');if(t&&event.button===0){"
    "var e=document.querySelector('label[for=&quot;UUID&quot;]'),i=null;"
    "while(e&&!(i=e.querySelector('input')))e=e.parentElement;"
    "Object.getOwnPropertyDescriptor(HTMLInputElement.prototype,'value').set"
    ".call(i,t.dataset.c+'|'+Date.now());i.dispatchEvent(new Event('input',{bubbles:true}))}"
)


class ClickChannel:
    """Receives clicks on elements that carry ``data-c="name:i,j"``.

    Args:
        gui: of one client; create it inside the container that also holds the pictures.
        clicked: called with the name and the cell. Whatever else a browser sends is dropped.
        label: of the hidden input.
    """

    def __init__(
        self, gui: viser.GuiApi, clicked: Callable[[str, tuple[int, ...]], None], *, label: str = "clicks"
    ) -> None:
        channel = gui.add_text(label, "")
        uuid = channel._impl.uuid
        # visible=False would take it out of the page
        gui.add_html(f"<style>{selector(channel)}{{display:none}}</style>")
        self.handler = _SCRIPT.replace("UUID", uuid)
        """JavaScript for ``onpointerdown`` of a picture or ``onclick`` of a button, escaped."""

        @channel.on_update
        def _(event: viser.GuiEvent) -> None:
            match = _CLICK.fullmatch(str(event.target.value))
            if match:
                clicked(match[1], tuple(int(n) for n in match[2].split(",")))
