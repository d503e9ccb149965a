"""How robots are exported: on which paper their build sheets are, and what they are built from."""

from __future__ import annotations

import dataclasses
from typing import Final

import viser

from app.gui.widgets import in_a_row
from engine.errors import InvalidData
from engine.fabrication.materials import PRESETS, Materials, load_materials
from viz.build_sheet.style import PaperName

PAPERS: Final[dict[str, PaperName]] = {"A4": "a4", "Letter": "letter"}
"""Names for people, the usual one first."""


@dataclasses.dataclass(frozen=True, slots=True)
class ExportChoice:
    """What an export is made with."""

    materials: Materials
    paper: PaperName

    @classmethod
    def of(cls, paper: object, material: object) -> ExportChoice:
        """Read what a browser sends: nothing but what is on offer, so that no name is ever used as a path.

        Raises:
            InvalidData: one of the two is not on offer.
        """
        if not isinstance(paper, str) or paper not in PAPERS:
            raise InvalidData(f"Choose a paper: {' or '.join(PAPERS)}.")
        if not isinstance(material, str) or material not in PRESETS:
            raise InvalidData(f"Choose a material: {', '.join(PRESETS)}.")
        return cls(load_materials(material), PAPERS[paper])


class ExportChooser:
    """Two lists in a row.

    Args:
        gui: of one browser, at the place where the lists go.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        self._paper = gui.add_dropdown(
            "Paper", tuple(PAPERS), hint="Paper that the build sheets of exports are printed on"
        )
        self._material = gui.add_dropdown(
            "Material", PRESETS, hint="What exported robots are built from; docs/fabrication.md has more"
        )
        gui.add_html(in_a_row((self._paper, 38), (self._material, 62), labelled=1))

    @property
    def choice(self) -> ExportChoice:
        """What is chosen.

        Raises:
            InvalidData: the browser has sent what is not on offer.
        """
        return ExportChoice.of(self._paper.value, self._material.value)
