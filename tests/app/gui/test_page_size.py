"""The size of a page whose pixels are not those of the screen."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.gui.browser_value import PageSize
from app.replay.scene_camera import Framing, SceneCamera
from app.replay.stage import FIELD_OF_VIEW


class Phone:
    """A phone of 390 x 844 pixels, each of which has nine of the screen."""

    def __init__(self) -> None:
        self.gui: Any = self
        self.camera: Any = SimpleNamespace(
            image_width=1170, image_height=2532, position=np.ones(3), look_at=np.zeros(3), fov=1.3
        )
        self.camera.on_update = lambda _: None
        self.written: list[str] = []
        self._tell: Callable[[Any], None] = lambda _: None

    def atomic(self) -> contextlib.AbstractContextManager[None]:
        return contextlib.nullcontext()

    def add_text(self, *_: object, **__: object) -> Any:
        def on_update(tell: Callable[[Any], None]) -> None:
            self._tell = tell

        return SimpleNamespace(_impl=SimpleNamespace(uuid="channel"), on_update=on_update)

    def add_html(self, content: str) -> Any:
        phone = self

        class Html:
            def __setattr__(self, _name: str, value: str) -> None:
                object.__setattr__(self, "content", value)
                phone.written.append(value)

        html = Html()
        html.content = content  # type: ignore[attr-defined]
        return html

    def tell(self, value: str, *, by_browser: bool = True) -> None:
        target = SimpleNamespace(value=f"{value}|1")
        self._tell(SimpleNamespace(client=self if by_browser else None, target=target))


class Panel:
    def __init__(self) -> None:
        self.widths: list[float] = []

    def set_width(self, width: float) -> None:
        self.widths.append(width)


@pytest.fixture
def phone() -> Phone:
    return Phone()


@pytest.fixture
def page(phone: Phone) -> PageSize:
    return PageSize(phone)  # type: ignore[arg-type]


def test_before_a_page_tells_its_size_it_is_taken_for_the_screens(page: PageSize) -> None:
    assert page.width == 1170
    assert page.scene == (1170, 2532)


def test_a_page_tells_its_size_whenever_that_changes(phone: Phone, page: PageSize) -> None:
    seen: list[tuple[int, tuple[float, float]]] = []
    page.on_change(lambda: seen.append((page.width, page.scene)))
    phone.tell("390,3.000")
    phone.tell("390,3.000")
    phone.camera.image_width, phone.camera.image_height = 878, 1899  # drawn more coarsely
    phone.tell("390,2.250")
    assert seen[0] == (390, (390.0, 844.0))
    assert seen[1][1] == pytest.approx((390, 844), abs=1)
    assert len(seen) == 2
    # every report is answered by another script, or the page would go on sending
    answers = [w for w in phone.written if "taArrived(" in w]
    assert len(set(answers)) >= 3


@pytest.mark.parametrize("value", ["", "390", "390,0.000", "390,3", "-390,1.000", "390,nan", "x" * 9999])
def test_what_is_no_size_changes_nothing(phone: Phone, page: PageSize, value: str) -> None:
    page.on_change(lambda: pytest.fail("it told of a change"))
    phone.tell(value)
    assert page.width == 1170


def test_what_the_server_sets_is_no_report(phone: Phone, page: PageSize) -> None:
    phone.tell("390,3.000", by_browser=False)
    assert page.width == 1170


def test_a_panel_gets_another_width_only_where_another_suits_the_page(phone: Phone, page: PageSize) -> None:
    left, right = Panel(), Panel()
    page.fit_panel(left, "left")  # type: ignore[arg-type]
    page.fit_panel(right, "right")  # type: ignore[arg-type]
    phone.tell("1600,1.000")
    phone.tell("1700,1.000")
    assert left.widths == [330, 400]
    assert right.widths == [300, 330]


def test_a_phones_camera_shows_a_robot_above_the_sheet_once_the_page_has_told_its_size(
    phone: Phone, page: PageSize
) -> None:
    camera = SceneCamera(phone, page)  # type: ignore[arg-type]
    robot = np.array([[0.0, 0.0, 0.0], [0.3, 0.1, 0.1]])
    camera.show(Framing(robot, np.array([-0.5, -0.9, 0.4])))

    def height() -> float:
        """How high the robot is seen: from -1 at the scene's lower edge to 1 at the upper one."""
        way, ahead = robot.mean(axis=0) - camera._eye, camera._focus - camera._eye
        depth = way @ ahead / np.linalg.norm(ahead)
        return float(way @ camera.facing[1] / depth / math.tan(FIELD_OF_VIEW / 2))

    assert height() < 0.3
    phone.tell("390,3.000")
    # the sheet covers what is below -1 + 2 x 0.62
    assert 0.3 < height() < 0.9
