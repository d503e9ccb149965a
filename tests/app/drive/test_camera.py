"""Tags are found where they are, in pictures that are drawn with known places."""

import math

import numpy as np
import pytest

from app.drive.camera import Camera, TagFinder
from engine.errors import InvalidData
from engine.fabrication.markers import HEAD, N_CELLS, TARGET

cv2 = pytest.importorskip("cv2")

WIDE, HIGH = 1280, 720
FOCAL = WIDE / 2 / math.tan(math.radians(30))
"""Of a camera of 60 degrees, in pixels."""


def draw(picture, marker, x, y, direction, depth):
    """Draw a tag that lies at a place in m, so far below the camera, its arrow in a direction."""
    n = 40
    black = np.kron(marker.black(), np.ones((n, n), dtype=bool))
    tag = np.full((n * (N_CELLS + 2), n * (N_CELLS + 2)), 255, np.uint8)
    tag[n:-n, n:-n][black] = 0
    half = marker.side / 2 * (N_CELLS + 2) / N_CELLS
    # corners as printed: upper left, upper right, lower right, lower left; the upper edge is ahead
    ahead = np.array([math.cos(direction), math.sin(direction)])
    right = np.array([ahead[1], -ahead[0]])
    corners = [half * (a * ahead + r * right) for a, r in ((1, -1), (1, 1), (-1, 1), (-1, -1))]
    places = np.array(corners) + np.array([x, y])
    seen = places * (FOCAL / depth) * (1, -1) + np.array([WIDE, HIGH]) / 2 - 0.5
    size = len(tag)
    flat = np.array([(0, 0), (size, 0), (size, size), (0, size)], np.float32) - 0.5
    warp = cv2.getPerspectiveTransform(flat, seen.astype(np.float32))
    mask = cv2.warpPerspective(np.full_like(tag, 255), warp, (WIDE, HIGH))
    drawn = cv2.warpPerspective(tag, warp, (WIDE, HIGH), flags=cv2.INTER_AREA)
    picture[mask > 127] = drawn[mask > 127][:, None]


def scene(head=None, target=None):
    picture = np.full((HIGH, WIDE, 3), 150, np.uint8)
    if target is not None:
        draw(picture, TARGET, *target, 0.3, 1.5)
    if head is not None:
        # 10 cm above the floor
        draw(picture, HEAD, *head, 1.4)
    return cv2.GaussianBlur(picture, (3, 3), 0)


@pytest.mark.parametrize("direction", [0.0, 0.7, 1.9, -2.6])
def test_head_and_target_are_where_they_lie(direction):
    head, target, corners = TagFinder().find(scene((-0.45, 0.2, direction), (0.5, -0.3)))
    assert set(corners) == {HEAD.number, TARGET.number}
    assert (head.x, head.y) == pytest.approx((-0.45, 0.2), abs=0.002)
    assert math.remainder(head.direction - direction, math.tau) == pytest.approx(0.0, abs=math.radians(0.5))
    assert target == pytest.approx([0.5, -0.3], abs=0.002)


def test_a_tag_printed_smaller_or_behind_the_head_point_is_allowed_for():
    picture = scene((0.3, 0.1, math.pi / 2))
    plain, target, _ = TagFinder().find(picture)
    assert target is None
    small, _, _ = TagFinder(scale=0.9).find(picture)
    assert (small.x, small.y) == pytest.approx((0.9 * plain.x, 0.9 * plain.y))
    ahead, _, _ = TagFinder(ahead=0.05).find(picture)
    assert (ahead.x - plain.x, ahead.y - plain.y) == pytest.approx((0.0, 0.05), abs=0.002)


def test_nothing_is_seen_where_nothing_is():
    assert TagFinder().find(scene()) == (None, None, {})


@pytest.fixture
def video(tmp_path):
    path = tmp_path / "floor.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 25, (WIDE, HIGH))
    for k in range(3):
        writer.write(scene((0.1 * k, 0.0, 0.0), (0.5, 0.2)))
    writer.release()
    return path


def test_a_camera_gives_pictures_with_what_was_found(video, monkeypatch):
    monkeypatch.setattr("app.drive.camera.SHORTEST", 0.0)
    camera = Camera(str(video))
    seen = [camera.look() for _ in range(3)]
    assert [s.head.x for s in seen] == pytest.approx([0.0, 0.1, 0.2], abs=0.002)
    assert seen[0].time <= seen[1].time <= seen[2].time
    shown = cv2.imdecode(np.frombuffer(seen[2].picture(), np.uint8), cv2.IMREAD_COLOR)
    assert shown.shape == (HIGH, WIDE, 3)
    # the tags are framed in colour
    assert np.ptp(shown.astype(int), axis=2).max() > 100
    with pytest.raises(InvalidData, match="gives no more pictures"):
        camera.look()
    camera.close()


@pytest.mark.parametrize("source", ["63", "there-is-no-such-video.avi"])
def test_no_camera_gets_one_line(source, capfd):
    with pytest.raises(InvalidData, match=f"camera {source} cannot be opened"):
        Camera(source)
    assert capfd.readouterr().err == ""


def test_without_opencv_there_is_one_line(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "cv2", None)
    with pytest.raises(InvalidData, match=r"needs OpenCV; install it with: pip install 'tensatlas\[drive\]'"):
        Camera("0")
