"""A browser as the explorer's server sees one: viser's protocol over a web-socket, nothing drawn."""

from __future__ import annotations

import collections
import itertools
import threading
import time
import urllib.parse
from collections.abc import Callable
from typing import Any, Self

import msgspec
import viser
import zstandard
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

RODS = "/rods"
"""How the name ends of the scene node that every frame of a replay moves."""
KEPT = 4000
"""Messages that are remembered."""
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (-0.5, -0.9, 0.7),
    "fov": 1.3,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 900,
    "image_width": 1600,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}

Message = dict[str, Any]


class SyntheticBrowser:
    """Connects, finds widgets by their labels, sends what a user would set off, times what arrives.

    Args:
        address: of the app, as it prints it.
        patience: seconds after which a wait fails.
        heard: called with every message, as it comes.
    """

    def __init__(
        self, address: str, patience: float = 120.0, heard: Callable[[Message], None] | None = None
    ) -> None:
        place = urllib.parse.urlsplit(address)
        query = f"?{place.query}" if place.query else ""
        self._patience = patience
        self._news = threading.Condition()
        self._messages: collections.deque[tuple[int, float, Message]] = collections.deque(maxlen=KEPT)
        self._n_messages = 0
        self._nonce = itertools.count(1)
        self._uuids: dict[str, str] = {}
        self._heard = heard
        self._closed = False
        self.broken = ""
        """Why the connection ended, if it was not closed here."""
        self.generation = -1
        """That the maps show; for whoever moves the slider to remember."""
        self.n_bytes = 0
        """Received so far."""
        self.n_frames = 0
        """Frames of replays received so far."""
        self._socket = connect(
            f"ws://{place.netloc}{place.path or '/'}{query}",
            origin=f"http://{place.netloc}",  # type: ignore[arg-type]
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
            compression=None,
            max_size=None,
            open_timeout=patience,
        )
        threading.Thread(target=self._receive, name="browser", daemon=True).start()
        self.send(CAMERA)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the page."""
        self._closed = True
        self._socket.close()

    def send(self, message: Message) -> None:
        """Send a message of viser's."""
        self.send_bytes(msgspec.msgpack.encode(message))

    def send_bytes(self, data: bytes) -> None:
        """Send what may be no message at all."""
        self._socket.send(data)

    def mark(self) -> int:
        """Return a point in what has been received, for ``wait`` to begin at."""
        with self._news:
            return self._n_messages

    def wait(self, wanted: Callable[[Message], bool], since: int) -> float:
        """Wait for a message received after a mark.

        Returns:
            When it came, by ``time.perf_counter``.

        Raises:
            TimeoutError: it did not come.
        """
        deadline = time.monotonic() + self._patience
        with self._news:
            while True:
                for k, moment, message in self._messages:
                    if k >= since and wanted(message):
                        return moment
                since = self._n_messages
                if not self._news.wait(deadline - time.monotonic()):
                    raise TimeoutError("the explorer did not answer in time")

    def uuid(self, label: str) -> str:
        """Return viser's name of the widget with a label, once it is there."""
        if label not in self._uuids:
            self.wait(lambda _: label in self._uuids, 0)
        return self._uuids[label]

    def set(self, label: str, value: object) -> None:
        """Set the value of a widget as a user's input does."""
        self.send({"type": "GuiUpdateMessage", "uuid": self.uuid(label), "updates": {"value": value}})

    def arrive(self) -> None:
        """Say that the page is there and its address asks for nothing, as a page's script does."""
        self.set("address", f"|{next(self._nonce)}")

    def click(self, what: str, channel: str = "clicks") -> None:
        """Click an element of a picture, such as ``morphology:3,7``."""
        self.set(channel, f"{what}|{next(self._nonce)}")

    def _receive(self) -> None:
        try:
            for data in self._socket:
                assert isinstance(data, bytes)
                self._take(data)
        except ConnectionClosed as e:
            self.broken = "" if self._closed else str(e)
        finally:
            self._closed = True

    def _take(self, data: bytes) -> None:
        moment, size = time.perf_counter(), int.from_bytes(data[8:16], "little")
        inner = zstandard.ZstdDecompressor().decompress(
            data[16 : 16 + size], max_output_size=int.from_bytes(data[:8], "little")
        )
        messages = msgspec.msgpack.decode(inner)["messages"]
        with self._news:
            self.n_bytes += len(data)
            self.n_frames += any(map(moves_robot, messages))
            for message in messages:
                label = (message.get("props") or {}).get("label")
                if isinstance(label, str) and "uuid" in message:
                    self._uuids[label] = message["uuid"]
                self._messages.append((self._n_messages, moment, message))
                self._n_messages += 1
                if self._heard is not None:
                    self._heard(message)
            self._news.notify_all()


def moves_robot(message: Message) -> bool:
    """Tell whether a message places the rods of a robot that is there already."""
    return message["type"] == "SceneNodeUpdateMessage" and message["name"].endswith(RODS)


def brings_robot(message: Message) -> bool:
    """Tell whether a message draws another robot, in its first pose."""
    return "Batched" in message["type"] and str(message.get("name", "")).endswith(RODS)


def html_with(text: str) -> Callable[[Message], bool]:
    """Return a test for a message that shows HTML with some text in it."""

    def wanted(message: Message) -> bool:
        shown = message.get("updates") or message.get("props") or {}
        return text in str(shown.get("content", ""))

    return wanted
