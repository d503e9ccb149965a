"""Finds the printed tags of head and target in the pictures of a camera that looks straight down."""

from __future__ import annotations

import math
import time
from typing import Any, Final

import numpy as np

from app.drive.eyes import HeadPose, Seen
from app.drive.link import INSTALL
from engine.errors import InvalidData
from engine.fabrication.markers import HEAD, TARGET, Marker

SIZE: Final = (1280, 720)
"""Width and height that the camera is asked for, in pixels."""
SHORTEST: Final = 1 / 30
"""Seconds between two pictures that are looked at."""
LARGER: Final = 2
"""Times that the part of a picture around a tag is enlarged."""
QUALITY: Final = 70
"""Of the JPEGs."""
_COLORS: Final = {HEAD.number: (235, 150, 30), TARGET.number: (30, 140, 250)}
"""Of the tags in the picture, blue first."""


class Camera:
    """A camera above the floor.

    Args:
        source: number of the camera, or name of a video or an address of one.
        scale: side of the tags as printed over that of the build sheet.
        ahead: how far the head point lies ahead of the tag's middle, in m.

    Raises:
        InvalidData: there is no such camera, or OpenCV is not installed.
    """

    def __init__(self, source: str, *, scale: float = 1.0, ahead: float = 0.0) -> None:
        try:
            import cv2
        except ImportError:
            raise InvalidData(f"a camera needs OpenCV; install it with: {INSTALL}") from None
        self._cv: Any = cv2
        # its own complaints would come besides our line
        self._cv.utils.logging.setLogLevel(0)
        self._source = source
        self._finder = TagFinder(scale=scale, ahead=ahead)
        self._capture: Any = cv2.VideoCapture(int(source) if source.isdigit() else source)
        if not self._capture.isOpened():
            raise InvalidData(
                f"camera {source} cannot be opened; is it plugged in, and does no other program use it?"
                " Another one: --camera 1"
            )
        self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, SIZE[0])
        self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, SIZE[1])
        # an old picture is worse than none
        self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        self._last = -math.inf

    def look(self) -> Seen:
        """Wait for the next picture and return what is seen in it.

        Raises:
            InvalidData: the camera gives no more pictures.
        """
        while True:
            good, picture = self._capture.read()
            now = time.monotonic()
            if not good:
                raise InvalidData(f"camera {self._source} gives no more pictures")
            if now - self._last >= 0.9 * SHORTEST:
                break
        self._last = now
        head, target, corners = self._finder.find(picture)
        return Seen(now, head, target, lambda: self._jpeg(picture, corners))

    def close(self) -> None:
        """Let the camera go."""
        self._capture.release()

    def _jpeg(self, picture: np.ndarray, corners: dict[int, np.ndarray]) -> bytes:
        shown = picture.copy()
        for number, points in corners.items():
            color = _COLORS[number]
            self._cv.polylines(shown, [np.rint(points).astype(np.int32)], True, color, 3)
            if number == HEAD.number:
                middle = points.mean(axis=0)
                tip = middle + 2.0 * (points[:2].mean(axis=0) - middle)
                ends = [tuple(int(v) for v in np.rint(p)) for p in (middle, tip)]
                self._cv.arrowedLine(shown, *ends, color, 3)
        return bytes(self._cv.imencode(".jpg", shown, [self._cv.IMWRITE_JPEG_QUALITY, QUALITY])[1])


class TagFinder:
    """Finds the tags in a picture.

    Each tag is its own scale: how large its side is in the picture says how far away it is. So the head may
    be higher than the target as long as the camera looks straight down.

    Args:
        scale: side of the tags as printed over that of the build sheet.
        ahead: how far the head point lies ahead of the tag's middle, in m.
    """

    def __init__(self, *, scale: float = 1.0, ahead: float = 0.0) -> None:
        import cv2

        self._scale, self._ahead = scale, ahead
        family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
        exact = cv2.aruco.DetectorParameters()
        exact.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
        self._cv: Any = cv2
        self._quick: Any = cv2.aruco.ArucoDetector(family)
        self._exact: Any = cv2.aruco.ArucoDetector(family, exact)

    def find(self, picture: np.ndarray) -> tuple[HeadPose | None, np.ndarray | None, dict[int, np.ndarray]]:
        """Return where head and target are, in m, and by number the (4, 2) corners in pixels.

        The origin is the middle of the picture, x to the right, y up.
        """
        corners = {
            number: self._refined(picture, number, points)
            for number, points in _corners(self._quick, picture).items()
            if number in _COLORS
        }
        middle = np.array([picture.shape[1], picture.shape[0]]) / 2.0
        head = target = None
        if HEAD.number in corners:
            points = corners[HEAD.number]
            x, y = self._place(points, HEAD, middle)
            # from the middle of the lower edge to that of the upper one
            along = points[:2].mean(axis=0) - points[2:].mean(axis=0)
            direction = math.atan2(-along[1], along[0])
            x += self._ahead * math.cos(direction)
            y += self._ahead * math.sin(direction)
            head = HeadPose(float(x), float(y), direction)
        if TARGET.number in corners:
            target = self._place(corners[TARGET.number], TARGET, middle)
        return head, target, corners

    def _refined(self, picture: np.ndarray, number: int, points: np.ndarray) -> np.ndarray:
        """Return the corners of a tag to a part of a pixel.

        The exact way takes a quarter of a second for a whole picture, and little for the part around a tag.
        """
        border = np.ptp(points, axis=0).max() / 2
        low = np.maximum(np.floor(points.min(axis=0) - border), 0).astype(int)
        high = np.ceil(points.max(axis=0) + border).astype(int)
        part = np.ascontiguousarray(picture[low[1] : high[1], low[0] : high[0]])
        # edges along the rows of pixels are found to a part of one only in a larger picture
        part = self._cv.resize(part, None, fx=LARGER, fy=LARGER, interpolation=self._cv.INTER_CUBIC)
        better = _corners(self._exact, part).get(number)
        return points if better is None else better / LARGER + low

    def _place(self, points: np.ndarray, marker: Marker, middle: np.ndarray) -> np.ndarray:
        """Return (2,) where a tag's middle is, in m."""
        across = points[[1, 2]].mean(axis=0) - points[[0, 3]].mean(axis=0)
        along = points[[0, 1]].mean(axis=0) - points[[2, 3]].mean(axis=0)
        # a tilted tag is foreshortened in one direction
        side = max(float(np.hypot(*across)), float(np.hypot(*along)), 1.0)
        offset = (points.mean(axis=0) - middle) * (self._scale * marker.side / side)
        return offset * np.array([1.0, -1.0])


def _corners(detector: Any, picture: np.ndarray) -> dict[int, np.ndarray]:
    """Return by its number the (4, 2) corners of every tag, the upper left one first, then clockwise."""
    found, numbers, _ = detector.detectMarkers(picture)
    numbers = [] if numbers is None else numbers.ravel()
    return {int(n): points.reshape(4, 2).astype(float) for n, points in zip(numbers, found, strict=True)}
