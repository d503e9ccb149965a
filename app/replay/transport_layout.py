"""Where the widgets of the replay's panel are: in rows, on a desk and on a phone."""

from __future__ import annotations

WIDTH = 760
MIN_WIDTH = 420
_WIDE = (6, 28, 6, 12, 8, 6, 6, 8, 4, 6, 6, 6, 6, 6, 6)
_NARROW = (10, 22, 8, 11, 9, 6, 8, 6, 0, 7, 8, 7, 5, 7, 6)
"""Fortieths of the panel's width that the widgets take, in their order; 0 for what there is no room for."""
_UNLABELLED = range(5, 10)
"""Children of a narrow panel that do without their label: what they show says what it is."""


def layout(width: int) -> str:
    """Return a style that puts the widgets in rows; on a phone the panel is as wide as the window."""
    panel = "div:has(> div > .ta-transport)"

    def rows(spans: tuple[int, ...]) -> str:
        return "".join(
            f"{panel} > :nth-child({k}) {{ {f'grid-column: span {span}' if span else 'display: none'}; }}"
            for k, span in enumerate(spans, start=2)
        )

    labels = ", ".join(f"{panel} > :nth-child({k}) > div > div:has(label)" for k in _UNLABELLED)
    narrow = (
        f"{rows(_NARROW)} {labels} {{ display: none; }}"
        f"{panel} > * > div, {panel} button"
        " { padding-left: 4px !important; padding-right: 4px !important; }"
        f"{panel} > :nth-child(n+11) label {{ font-size: 12px !important; }}"
    )
    return (
        '<style class="ta-transport">'
        f"{panel} {{ display: grid; grid-template-columns: repeat(40, 1fr); align-items: center;"
        " row-gap: 2px; padding: 8px 4px 2px; }"
        f"{panel} > * {{ grid-column: span 40; padding-bottom: 0 !important; min-width: 0; }}"
        f"{panel} > :nth-child(1) {{ display: none; }}{rows(_WIDE) if width >= WIDTH else narrow}"
        f"{panel} > :nth-child(3) {{ padding-top: 6px; }}"
        f"{panel} > * > div > div:has(label) {{ width: auto !important; }}"
        f"@media (max-width: 700px) {{{narrow}}}</style>"
    )
