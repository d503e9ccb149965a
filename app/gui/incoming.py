"""What a browser may send, checked before viser decodes it.

viser decodes whatever arrives into Python's objects, the smallest of which take a hundred times the bytes
that they came in, and prints a traceback where a part has the wrong type. So each message is first decoded
into one of the types below, those of the messages that the app uses. Parts, lengths and nesting are bounded
while it is decoded, and whatever is not as it should be is dropped.
"""

from __future__ import annotations

from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta, Struct

MAX_TEXT: Final = 20_000
"""Characters of the longest text in a field."""
LOOKING: Final = 100_000
"""Bytes of the longest message of a browser that may not upload: such a text, in any script."""
UPLOADING: Final = 1_000_000
"""The same for one that may: a file comes in parts of half a megabyte."""
FARTHEST: Final = 1e9
"""No coordinate and no other number of a camera is larger."""

Name = Annotated[str, Meta(max_length=100)]
Count = Annotated[int, Meta(ge=0, le=2**40)]
Number = Annotated[float, Meta(ge=-FARTHEST, le=FARTHEST)]
Pixels = Annotated[float, Meta(ge=0, le=100_000)]
Place = tuple[Number, Number, Number]
Value = None | bool | int | float | Annotated[str, Meta(max_length=MAX_TEXT)]
"""Of a widget; this app has none whose value is a list."""


class _Message(Struct, tag_field="type", tag=True, forbid_unknown_fields=True):
    """The name of each class below is that of a type of viser's, which has these fields."""


class GuiUpdateMessage(_Message):
    """A widget was used."""

    uuid: Name
    updates: Annotated[dict[Name, Value], Meta(max_length=1)]


class CommandTriggerMessage(_Message):
    """A command of the palette was chosen."""

    uuid: Name


class ViewerCameraMessage(_Message):
    """The camera was moved."""

    wxyz: tuple[Number, Number, Number, Number]
    position: Place
    fov: Number
    near: Number
    far: Number
    image_height: Pixels
    image_width: Pixels
    look_at: Place
    up_direction: Place


class ScenePointerMessage(_Message):
    """The scene was clicked."""

    event_type: Literal["click", "rect-select"]
    ray_origin: Place | None
    ray_direction: Place | None
    screen_pos: Annotated[list[tuple[Number, Number]], Meta(max_length=2)]
    modifier: Name | None


class FileTransferStartUpload(_Message):
    """A file is about to come."""

    source_component_uuid: Name
    transfer_uuid: Name
    filename: Annotated[str, Meta(max_length=1000)]
    mime_type: Annotated[str, Meta(max_length=1000)]
    part_count: Count
    size_bytes: Count


class FileTransferPart(_Message):
    """A part of a file."""

    source_component_uuid: Name
    transfer_uuid: Name
    part_index: Count
    content: bytes


_Looking = GuiUpdateMessage | CommandTriggerMessage | ViewerCameraMessage | ScenePointerMessage
_looking = msgspec.msgpack.Decoder(_Looking)
_uploading = msgspec.msgpack.Decoder(_Looking | FileTransferStartUpload | FileTransferPart)


def is_message(data: object, *, uploads: bool) -> bool:
    """Tell whether what a browser sent is one of the messages that it may send.

    Args:
        data: as it came from the web-socket.
        uploads: whether files may come.
    """
    if not isinstance(data, bytes) or len(data) > (UPLOADING if uploads else LOOKING):
        return False
    try:
        (_uploading if uploads else _looking).decode(data)
    except (msgspec.DecodeError, RecursionError):
        return False
    return True
