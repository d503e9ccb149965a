"""Small helpers around viser's widgets."""

from __future__ import annotations

from typing import Any


def put(widget: Any, value: Any) -> None:
    """Set a widget's value, without telling the browser again what it shows already."""
    if widget.value != value:
        widget.value = value


def put_html(element: Any, content: str) -> None:
    """Set an HTML element's content, unless it is on the screen already."""
    if element.content != content:
        element.content = content
