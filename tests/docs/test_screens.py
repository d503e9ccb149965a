"""The pictures of the app: all there, of their size, small enough to be looked at by everybody."""

import re
from pathlib import Path

import pytest
from PIL import Image

from tests.browser import animation
from tests.browser.screens import ALBUM, SIZES

DOCS = Path(__file__).resolve().parents[2] / "docs"
NAMES = {f"{screen.name}-{size}-{theme}" for size, theme, screens in ALBUM for screen in screens}


def test_the_page_shows_every_picture_of_the_album():
    linked = set(re.findall(r"screens/([\w-]+)\.webp", (DOCS / "screens.md").read_text(encoding="utf-8")))
    assert linked == NAMES == {p.stem for p in (DOCS / "screens").iterdir()}
    assert sum(p.stat().st_size for p in (DOCS / "screens").iterdir()) < 1_500_000


@pytest.mark.parametrize("name", sorted(NAMES))
def test_a_picture_has_its_size_and_shows_something(name):
    with Image.open(DOCS / "screens" / f"{name}.webp") as picture:
        assert picture.size == SIZES[name.split("-")[-2]]
        assert len(picture.convert("RGB").resize((64, 64)).getcolors(1 << 16)) > 100


def test_the_animation_moves_and_is_small():
    path = DOCS / "explorer.webp"
    assert path.stat().st_size <= animation.MOST
    with Image.open(path) as film:
        assert film.size == animation.SIZE
        assert film.n_frames > 40
