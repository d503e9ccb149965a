"""Small helpers around viser's widgets."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from app.gui.viser_private import selector


def panel_widths(window: int) -> tuple[int, int]:
    """Return the widths of the panels at the left and the right of a window, all in pixels.

    What is between them, and 4 pixels at each, is at least half of a window of 1280.
    """
    return (330, 300) if window < 1440 else (400, 330)


def put(widget: Any, value: Any, attribute: str = "value") -> None:
    """Set a widget's value, or another attribute, unless the browser shows it already."""
    if getattr(widget, attribute) != value:
        setattr(widget, attribute, value)


def put_html(element: Any, content: str) -> None:
    """Set an HTML element's content, unless it is on the screen already."""
    if element.content != content:
        element.content = content


def ignoring_event(action: Callable[[], None]) -> Callable[[Any], None]:
    """Return a callback for a widget that does something, whatever the event says."""
    return lambda _event: action()


def in_a_row(*cells: tuple[Any, float], labelled: int | None = None) -> str:
    """Return a style that puts inputs that follow each other into one row, as far as they are visible.

    Args:
        cells: each input and its share of the width in percent; together 100.
        labelled: how many of them, from the left, show their labels; None for all. A label that is not
            seen still names its input to a screen reader.
    """
    rules, left = [], 0.0
    for k, (widget, share) in enumerate(cells):
        this = selector(widget)
        place = f"float:left;width:{share:g}%" if k < len(cells) - 1 else f"margin-left:{left:g}%!important"
        rules.append(f"{this}{{{place}}}" if k == 0 else f"{selector(cells[k - 1][0])}+{this}{{{place}}}")
        label = "width:auto!important;padding-right:6px"
        if labelled is not None and k >= labelled:
            label = "position:absolute;width:1px!important;height:1px;overflow:hidden;clip-path:inset(50%)"
        rules.append(f"{this}{{box-sizing:border-box}}{this} [data-ta-label]{{{label}}}")
        left += share
    return f"<style>{''.join(rules)}</style>"
