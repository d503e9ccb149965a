"""The camera of a scene whose browser is slow, or whose user takes it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from viser import InitialCameraConfig

from app.replay.scene_camera import BEGINNINGS, Framing, SceneCamera
from app.replay.stage import FIELD_OF_VIEW

POINTS = np.array([[0.0, 0.0, 0.0], [0.3, 0.1, 0.1]])
TOWARDS = np.array([-0.5, -0.9, 0.4])


class Browser:
    """A browser whose camera a test reports."""

    def __init__(self) -> None:
        self.camera: Any = self
        self.position, self.look_at = np.array([3.0, 3.0, 3.0]), np.zeros(3)
        self.image_width, self.image_height, self.fov = 1280, 720, 1.3
        self.width, self.ratio = 1280, 1.0
        self._told: Callable[[Any], None] = lambda _: None

    def on_update(self, told: Callable[[Any], None]) -> None:
        self._told = told

    @property
    def scene(self) -> tuple[float, float]:
        return self.image_width / self.ratio, self.image_height / self.ratio

    def on_change(self, _changed: Callable[[], None]) -> None:
        """The page's size: it stays."""

    def atomic(self) -> contextlib.AbstractContextManager[None]:
        return contextlib.nullcontext()

    def report(self, position: np.ndarray, look_at: np.ndarray | None = None) -> None:
        self.position = np.array(position)
        self.look_at = self.look_at if look_at is None else look_at
        self._told(self)


@pytest.fixture
def browser() -> Browser:
    return Browser()


@pytest.fixture
def camera(browser: Browser) -> SceneCamera:
    camera = SceneCamera(browser, browser)  # type: ignore[arg-type]
    camera.start_following(np.zeros(2))
    camera.show(Framing(POINTS, TOWARDS))
    return camera


def test_a_slow_browser_that_reports_old_places_loses_no_step(browser: Browser, camera: SceneCamera) -> None:
    before, placed = np.array([3.0, 3.0, 3.0]), np.array(browser.position)
    browser.report(before)  # sent before it heard of the new place
    for k in range(1, 6):
        camera.follow(np.array([0.01 * k, 0.0]))
        browser.report(placed if k % 2 else before)
    assert np.allclose(placed + np.array([0.05, 0.0, 0.0]), camera._eye)
    camera.follow(np.array([0.06, 0.0]))
    assert np.allclose(browser.position, placed + np.array([0.06, 0.0, 0.0]))


def test_where_viser_began_is_nobodys_turn_however_late_it_is_reported(browser: Browser) -> None:
    browser.position = np.array([-5.0, 0.0, 0.0])
    camera = SceneCamera(browser, browser)  # type: ignore[arg-type]
    camera.show(Framing(POINTS, TOWARDS))
    placed = np.array(browser.position)
    assert np.allclose(BEGINNINGS[-1], InitialCameraConfig(broadcast=lambda _: None).position)
    for place in BEGINNINGS:
        browser.report(place)
    camera.follow(np.array([0.01, 0.0]))
    assert np.allclose(browser.position, placed + np.array([0.01, 0.0, 0.0]))


def test_a_camera_that_its_user_has_turned_goes_on_from_there(browser: Browser, camera: SceneCamera) -> None:
    theirs, focus = np.array([0.9, -0.2, 0.7]), np.array([0.1, 0.0, 0.0])
    browser.report(theirs, focus)
    camera.follow(np.array([0.1, 0.05]))
    assert np.allclose(browser.position, theirs + np.array([0.1, 0.05, 0.0]))
    assert np.allclose(browser.look_at, focus + np.array([0.1, 0.05, 0.0]))
    # and a scene of another size is not framed anew
    browser.image_width = 500
    browser.report(browser.position)
    assert np.allclose(browser.position, theirs + np.array([0.1, 0.05, 0.0]))


def test_what_is_framed_stays_framed_when_panels_narrow_the_scene(
    browser: Browser, camera: SceneCamera
) -> None:
    near = np.linalg.norm(browser.position - POINTS.mean(axis=0))
    browser.image_width = 400
    browser.report(browser.position)
    assert np.linalg.norm(browser.position - POINTS.mean(axis=0)) > 1.2 * near


def test_a_circling_camera_keeps_its_distance_and_comes_round(browser: Browser, camera: SceneCamera) -> None:
    start = np.array(browser.position)
    for _ in range(8):
        camera.follow(np.zeros(2), turn=np.pi / 4)
        if _ == 3:
            assert np.allclose(browser.position, start * np.array([-1.0, -1.0, 1.0]))
    assert np.allclose(browser.position, start)


def test_a_part_of_the_width_is_filled(browser: Browser, camera: SceneCamera) -> None:
    wide = np.array([[0.0, -0.2, 0.0], [0.0, 0.2, 0.0]])
    away = []
    for part in (1.0, 0.5):
        camera.show(Framing(wide, np.array([-1.0, 0.0, 0.2]), part))
        away.append(np.linalg.norm(browser.position))
    assert away[1] == pytest.approx(away[0] * (1280 - 50) / 640, rel=0.05)


@pytest.mark.parametrize("towards", [(-0.5, -0.9, 0.4), (0.0, -0.02, 1.0), (0.7, 0.1, 0.05)])
def test_what_faces_the_camera_faces_where_it_was_sent(
    browser: Browser, camera: SceneCamera, towards: tuple[float, float, float]
) -> None:
    camera.show(Framing(POINTS, np.array(towards)))
    right, up = camera.facing
    out = np.array(browser.position) - np.array(browser.look_at)
    assert np.allclose([right @ up, right @ out, up @ out, right[2]], 0.0, atol=1e-9)
    assert np.allclose([np.linalg.norm(right), np.linalg.norm(up)], 1.0)
    assert np.cross(right, up) @ out > 0.0
    assert up[2] > 0.0


def test_what_is_framed_lies_beside_a_window(browser: Browser, camera: SceneCamera) -> None:
    def places() -> np.ndarray:
        ahead = np.subtract(browser.look_at, browser.position)
        ahead = ahead / np.linalg.norm(ahead)
        right = np.cross(ahead, [0.0, 0.0, 1.0])
        way = POINTS - np.array(browser.position)
        edge = np.tan(FIELD_OF_VIEW / 2) * browser.image_width / browser.image_height
        return browser.image_width * (1.0 + way @ right / np.linalg.norm(right) / (way @ ahead) / edge) / 2

    assert places().min() < 640 < places().max()
    camera.cover(640)
    assert 640 < places().min() < places().max() < 1280
    # where next to nothing would be left, the window may lie over it
    camera.cover(1100)
    assert places().min() < 640 < places().max()
    camera.cover(0)
    assert places().min() < 640 < places().max()
    # once the user has the camera, no window takes it
    browser.report(np.array([0.9, -0.2, 0.7]), np.array([0.1, 0.0, 0.0]))
    camera.cover(640)
    assert np.allclose(browser.position, [0.9, -0.2, 0.7])


@pytest.mark.parametrize("x", [0.0, 0.3, 0.5, 1.0])
def test_a_place_is_seen_where_the_ray_to_it_goes_through_the_scene(camera: SceneCamera, x: float) -> None:
    ray = camera.ray(x, 0.2)
    assert camera.across(ray.origin + 1.7 * ray.direction) == pytest.approx(2 * x - 1)
