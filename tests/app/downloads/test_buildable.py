from __future__ import annotations

import pytest

from app.downloads.buildable import instead_of, problems_of
from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.fabrication.buildability import problems
from engine.fabrication.materials import load_materials


def test_the_verdict_is_that_of_the_build_sheet() -> None:
    soft, stiff = Morphology(1, (1, 2, 3)), Morphology(5, (1, 2, 3))
    for body in (soft, stiff):
        for material in ("silicone-sheet", "latex-sheet"):
            expected = [p.text for p in problems(body, load_materials(material))]
            assert list(problems_of(body, material)) == expected
    # no silicone sheet on sale is thin enough for the softest modules
    assert problems_of(soft, "silicone-sheet")
    assert not problems_of(stiff, "silicone-sheet")
    assert not problems_of(soft, "latex-sheet")
    found = [
        instead_of(body, material) for body in (soft, stiff) for material in ("silicone-sheet", "tpu-85a")
    ]
    assert found == ["latex-sheet", "latex-sheet", "", "latex-sheet"]


def test_only_what_is_on_offer_is_judged() -> None:
    for material in ("/etc/passwd", None, ["tpu-85a"]):
        with pytest.raises(InvalidData, match="Choose a material"):
            problems_of(Morphology(1, (1, 2)), material)
