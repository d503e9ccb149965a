"""How build sheets look: paper, fonts, colours, paragraph styles; how texts and numbers are written."""

from __future__ import annotations

import dataclasses
import functools
import html
import re
from collections.abc import Sequence
from typing import Final, Literal

from reportlab.lib.colors import Color, HexColor
from reportlab.lib.pagesizes import A4, LETTER
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont

from engine.body.module import module_number

PaperName = Literal["a4", "letter"]

# Bitstream Vera comes with reportlab and is embedded, so that °, Ω, ± and ≤ print everywhere
REGULAR: Final = "Vera"
BOLD: Final = "VeraBd"
for _name in (REGULAR, BOLD):
    pdfmetrics.registerFont(TTFont(_name, f"{_name}.ttf"))
pdfmetrics.registerFontFamily(REGULAR, normal=REGULAR, bold=BOLD, italic=REGULAR, boldItalic=BOLD)

MARGIN: Final = 16 * mm
HEADER: Final = 11 * mm
FOOTER: Final = 8 * mm

INK: Final = HexColor("#17212b")
SOFT: Final = HexColor("#5b6875")
RULE: Final = HexColor("#c3ccd4")
BAND: Final = HexColor("#eef2f5")
ACCENT: Final = HexColor("#0b6b62")
WARN: Final = HexColor("#a8321f")
WARN_BAND: Final = HexColor("#fdf0ec")
ROD: Final = HexColor("#9aa6b2")
SERVO: Final = HexColor("#e07a1f")
HEAD: Final = HexColor("#15998a")
CABLE: Final = HexColor("#2f7fc2")
SERVO_CABLE: Final = HexColor("#c2570c")
LINK: Final = HexColor("#7d2fb0")
GHOST: Final = HexColor("#c9d1d9")
NODE: Final = HexColor("#52606d")
PATHS: Final = tuple(HexColor(c) for c in ("#0b6b62", "#c2570c", "#2f5fc2", "#9c2f7a", "#7a6a10", "#4b5563"))


@dataclasses.dataclass(frozen=True, slots=True)
class Paper:
    """A sheet of paper, in points: its size and the room inside the margins."""

    name: str
    width: float
    height: float

    @property
    def inner_width(self) -> float:
        """Width between the margins."""
        return self.width - 2 * MARGIN

    @property
    def inner_height(self) -> float:
        """Height between header and footer."""
        return self.height - 2 * MARGIN - HEADER - FOOTER


PAPERS: Final[dict[str, Paper]] = {"a4": Paper("A4", *A4), "letter": Paper("Letter", *LETTER)}


def _style(name: str, size: float, lead: float, **more: object) -> ParagraphStyle:
    settings: dict[str, object] = {"fontName": REGULAR, "textColor": INK, "fontSize": size, "leading": lead}
    return ParagraphStyle(name, **(settings | more))


TITLE: Final = _style("title", 21, 26, fontName=BOLD)
HEADING: Final = _style(
    "heading", 14, 18, fontName=BOLD, textColor=ACCENT, spaceBefore=14, spaceAfter=5, keepWithNext=1
)
SUBHEADING: Final = _style("subheading", 10.5, 14, fontName=BOLD, spaceBefore=7, spaceAfter=2, keepWithNext=1)
BODY: Final = _style("body", 9.2, 13, spaceAfter=4)
BULLET: Final = _style("bullet", 9.2, 13, leftIndent=12, bulletIndent=2, spaceAfter=2)
CELL: Final = _style("cell", 8.4, 10.8)
CELL_RIGHT: Final = _style("cell-right", 8.4, 10.8, alignment=2)
CELL_HEAD: Final = _style("cell-head", 8.2, 10.4, fontName=BOLD)
CELL_HEAD_RIGHT: Final = _style("cell-head-right", 8.2, 10.4, fontName=BOLD, alignment=2)
NOTE: Final = _style("note", 8.2, 11, textColor=SOFT, spaceAfter=4)
WARNING: Final = _style(
    "warning", 9.2, 13, textColor=WARN, backColor=WARN_BAND, borderPadding=5, spaceBefore=6, spaceAfter=8
)


@functools.cache
def _glyphs() -> frozenset[int]:
    return frozenset(pdfmetrics.getFont(REGULAR).face.charToGlyph)


def printable(text: str) -> str:
    """Return a text with a ``?`` for every character that the fonts do not have."""
    return "".join(c if ord(c) in _glyphs() else "?" for c in text)


def escaped(text: str) -> str:
    """Return a user's text for a paragraph: what looks like markup in it is shown as it is."""
    return html.escape(printable(re.sub(r"\bmm2\b", "mm²", text)), quote=False)


def mixed(color: Color, other: Color, part: float) -> Color:
    """Return a colour on the way to another: 0 is the first, 1 the second."""
    values = zip(color.rgb(), other.rgb(), strict=True)
    return Color(*(round(a + (b - a) * part, 3) for a, b in values))


def signed(value: float, decimals: int) -> str:
    """Return a number with a real minus sign; no minus before a zero."""
    text = f"{value:.{decimals}f}"
    if float(text) == 0.0:
        return text.removeprefix("-")
    return text.replace("-", "\N{MINUS SIGN}")


def module_names(modules: Sequence[int]) -> str:
    """Return the numbers of modules, given by index, runs of them shortened: ``1 to 5, 7``."""
    runs: list[list[int]] = []
    for m in map(module_number, modules):
        if runs and m == runs[-1][-1] + 1:
            runs[-1].append(m)
        else:
            runs.append([m])
    return ", ".join(f"{r[0]} to {r[-1]}" if len(r) > 2 else ", ".join(map(str, r)) for r in runs)
