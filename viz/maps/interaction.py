"""What maps do in a browser by themselves: the hover card, the keyboard, the enlarged view.

A page runs ``SCRIPT``, map.js, once, whatever the number of maps. Pictures say what they need in their
attributes:

* ``data-h`` is the text of an element's hover card.
* ``data-map`` is a map's name, ``data-size`` the width and height of its cells, ``data-start`` the cell where
  the keyboard begins. Cells that are elements have ``data-c``, ``name:i,j``, and ``data-filled``.
* ``data-n`` is the number of a cell's robot: pointing at one marks its cells on the other maps.
* A nested map has its cells in the table ``data-cells`` (see ``viz.maps.nested``). It gets ``data-c``, the
  cell that a click means, while a filled one is near the pointer.
* Diagrams of trends have ``data-points`` (see ``viz.runs.trend``): they are read at the generation nearest to
  the pointer.

A map that has the focus takes the arrow keys; elsewhere they turn the camera. An arrow goes to the next
filled cell in its direction, whose hover card is shown at once. When the keys have rested for a moment, or on
Enter, the cell is clicked as by a mouse. Space plays and pauses wherever no field or button has the focus: it
clicks the element that ``render_key`` makes.
"""

from __future__ import annotations

import importlib.resources
from typing import Final

SCRIPT: Final = (importlib.resources.files("viz.maps") / "map.js").read_text(encoding="utf-8")
"""JavaScript for a page with maps; to run it again changes nothing."""

ENLARGE: Final = (
    '<button type="button" onclick="taZoom(this)" title="Enlarge" aria-label="Enlarge" style="border:0;'
    "background:none;color:inherit;opacity:.75;cursor:pointer;padding:0 2px;font-size:14px;line-height:1"
    '">⤢</button>'
)
"""A button inside an element of class ``ta-picture``: shows its picture as large as the window."""


def render_key(key: str, name: str, on_pointer_down: str) -> str:
    """Return an unseen element that a key clicks.

    Args:
        key: ``space``.
        name: that is reported with cell 0.
        on_pointer_down: JavaScript, already escaped for an attribute, as of the maps.
    """
    return (
        f'<i class="ta-key" hidden data-key="{key}" data-c="{name}:0" onpointerdown="{on_pointer_down}"></i>'
    )
