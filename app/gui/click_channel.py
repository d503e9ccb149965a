"""Clicks on pictures. No picture element of viser reports them, so they come through a hidden input."""

from __future__ import annotations

import html
import re
from collections.abc import Callable
from typing import Final

import viser

from app.gui.viser_private import uuid_of
from app.gui.widgets import add_channel

AGAIN_MS: Final = 700
"""Milliseconds until a value that has not arrived is sent again."""
_CLICK = re.compile(r"([a-z0-9-]{1,40}):(\d{1,3}(?:,\d{1,3}){0,5})\|\d{1,16}")


def sender(uuid: str, value: str, *, until: str = "") -> str:
    """Return JavaScript that sets an input as if the user had; it waits for the input to appear.

    Args:
        uuid: of the input.
        value: a JavaScript expression; an equal value twice is not noticed.
        until: a JavaScript expression that is true once the value has arrived; until then it is sent again
            and again. Of what is set within 50 ms viser's client may drop all but the last.
    """
    stop, again = (f"if({until})return;", f"if(n)setTimeout(go,{AGAIN_MS},n-1)") if until else ("", "")
    return (
        f"(function go(n){{{stop}var e=document.querySelector('label[for=\"{uuid}\"]'),i=null;"
        "while(e&&!(i=e.querySelector('input')))e=e.parentElement;"
        "if(!i){if(n)setTimeout(go,100,n-1);return}"
        "Object.getOwnPropertyDescriptor(HTMLInputElement.prototype,'value').set"
        f".call(i,{value});i.dispatchEvent(new Event('input',{{bubbles:true}}));{again}}})(99)"
    )


def script(code: str) -> str:
    """Return HTML that runs JavaScript: scripts inside added HTML do not, but the error of an image does."""
    return f'<img alt="" src="data:," style="display:none" onerror="{html.escape(code)}">'


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
        channel = add_channel(gui, label)
        send = sender(uuid_of(channel), "t.dataset.c+'|'+Date.now()")
        self.handler = html.escape(
            f"var t=event.target.closest('[data-c]');if(t&&event.button===0){{{send}}}"
        )
        """JavaScript for ``onpointerdown`` of a picture or ``onclick`` of a button, escaped."""

        @channel.on_update
        def _(event: viser.GuiEvent) -> None:
            match = _CLICK.fullmatch(str(event.target.value))
            if match:
                clicked(match[1], tuple(int(n) for n in match[2].split(",")))
