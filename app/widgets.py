"""Small helpers around viser's widgets."""

from __future__ import annotations

from typing import Any

from app.viser_private import uuid_of


def put(widget: Any, value: Any) -> None:
    """Set a widget's value, without telling the browser again what it shows already."""
    if widget.value != value:
        widget.value = value


def put_html(element: Any, content: str) -> None:
    """Set an HTML element's content, unless it is on the screen already."""
    if element.content != content:
        element.content = content


def selector(widget: Any) -> str:
    """Return the CSS selector of what viser draws around an input with a label."""
    return f'div:has(> div > div > * > label[for="{uuid_of(widget)}"])'


def side_by_side(first: Any, second: Any) -> str:
    """Return a style that puts two inputs that follow each other into one row, if both are visible."""
    a, b = selector(first), selector(second)
    return (
        f"<style>{a}{{float:left;width:50%}}{a}+{b}{{margin-left:50%}}"
        f"{a}>div>div:has(label),{a}+{b}>div>div:has(label){{width:auto!important;padding-right:6px}}</style>"
    )
