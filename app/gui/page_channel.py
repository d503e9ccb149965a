"""Scripts in a browser's page, and their way to the app: a hidden text field.

viser has no element that runs a script, and none that reports what a script has found. The functions that
fill such a field are in ``page_channel.js``; every channel brings them along.
"""

from __future__ import annotations

import functools
import html
import importlib.resources
from typing import Final

import viser

from app.gui.viser_private import run_now, selector


@functools.cache
def page_file(name: str, package: str) -> str:
    """Return the text of a script or a style that lies beside a module of a package."""
    return (importlib.resources.files(package) / name).read_text(encoding="utf-8")


def run_script(code: str) -> str:
    """Return HTML that runs JavaScript: scripts inside added HTML do not, but the error of an image does."""
    return f'<img alt="" src="data:," style="display:none" onerror="{html.escape(code)}">'


def mark_page(client: viser.ClientHandle) -> None:
    """Let styles find what is around a widget or an element: see ``marks.js``. To be called first of all."""
    run_now(client, page_file("marks.js", __package__))


SCRIPT: Final = page_file("page_channel.js", __package__)
"""The functions that fill a channel."""


def add_channel(gui: viser.GuiApi, label: str) -> viser.GuiTextHandle:
    """Add an invisible text field, and the functions with which scripts of the page fill it."""
    channel = gui.add_text(label, "", hint="Between the page and the app; not for people")
    # visible=False would take it out of the page
    gui.add_html(f"<style>{selector(channel)}{{display:none}}</style>{run_script(SCRIPT)}")
    return channel
