from __future__ import annotations

import pytest

from app.downloads.buildable import problems_of
from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.fabrication.buildability import problems
from engine.fabrication.materials import load_materials


def test_the_verdict_is_that_of_the_build_sheet() -> None:
    soft, stiff = Morphology(1, (1, 2, 3)), Morphology(5, (1, 2, 3))
    for body in (soft, stiff):
        expected = [p.text for p in problems(body, load_materials("tpu-85a"))]
        assert list(problems_of(body, "tpu-85a")) == expected
    assert problems_of(soft, "tpu-85a")
    assert not problems_of(stiff, "tpu-85a")


def test_only_what_is_on_offer_is_judged() -> None:
    for material in ("/etc/passwd", None, ["tpu-85a"]):
        with pytest.raises(InvalidData, match="Choose a material"):
            problems_of(Morphology(1, (1, 2)), material)
