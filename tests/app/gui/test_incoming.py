"""Which messages pass: all that viser understands and the app uses, and nothing else."""

from __future__ import annotations

import resource
import typing

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from viser import _messages

from app.gui import incoming
from app.gui.incoming import is_message
from benchmarks.synthetic_browser import CAMERA

UPDATE = {"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": 1}}
PART = {
    "type": "FileTransferPart",
    "source_component_uuid": "a",
    "transfer_uuid": "b",
    "part_index": 0,
    "content": b"x",
}
CLICK = {
    "type": "ScenePointerMessage",
    "event_type": "click",
    "ray_origin": (0, 0, 1.5),
    "ray_direction": (0, 0, -1),
    "screen_pos": ((0.5, 0.5),),
    "modifier": None,
}
UPLOAD = {
    "type": "FileTransferStartUpload",
    "source_component_uuid": "a",
    "transfer_uuid": "b",
    "filename": "../x.tsmr",
    "mime_type": "",
    "part_count": 3,
    "size_bytes": 1_500_000,
}
COMMAND = {"type": "CommandTriggerMessage", "uuid": "a"}


def sent(message: object, *, uploads: bool = False) -> bool:
    return is_message(msgspec.msgpack.encode(message), uploads=uploads)


@pytest.mark.parametrize("message", [UPDATE, CAMERA, CLICK, COMMAND, PART, UPLOAD])
def test_what_a_browser_sends_passes_and_is_understood(message: dict[str, object]) -> None:
    assert sent(message, uploads=True)
    assert sent(message) is not str(message["type"]).startswith("FileTransfer")
    read = _messages.Message.deserialize(msgspec.msgpack.encode(message))
    assert type(read).__name__ == message["type"]
    fields = typing.get_type_hints(getattr(incoming, str(message["type"])))
    assert set(fields) == set(_messages.Message.deserialize(msgspec.msgpack.encode(message)).__dict__)


@pytest.mark.parametrize(
    "message",
    [
        None,
        5,
        [],
        {},
        {"type": 5},
        {"type": "Message"},
        {"type": "ShareUrlRequest"},
        {"type": "GuiFormDirtyMessage", "uuid": "a"},
        {**UPDATE, "uuid": []},
        {**UPDATE, "uuid": "a" * 101},
        {**UPDATE, "updates": {}, "more": 1},
        {**UPDATE, "updates": {"value": 1, "visible": False}},
        {**UPDATE, "updates": {"value": {}}},
        {**UPDATE, "updates": {"value": [0.0, 1.0]}},
        {**UPDATE, "updates": {"value": "x" * 20_001}},
        {"type": "CommandTriggerMessage"},
        {**CAMERA, "position": (0, 0)},
        {**CAMERA, "position": ("0", 0, 0)},
        {**CAMERA, "position": (float("nan"), 0, 0)},
        {**CAMERA, "fov": float("inf")},
        {**CAMERA, "image_height": -1},
        {**CAMERA, "image_width": 10**18},
        {**CLICK, "screen_pos": [(0.5, 0.5)] * 3},
        {**CLICK, "ray_origin": "abc"},
        {**PART, "content": None},
        {**PART, "content": "x"},
        {**PART, "part_index": -1},
        {**PART, "source_component_uuid": None},
        {**UPLOAD, "size_bytes": "many"},
        {**UPLOAD, "filename": "x" * 1001},
    ],
)
def test_what_is_not_as_it_should_be_does_not(message: object) -> None:
    assert not sent(message, uploads=True)


def test_text_and_what_is_too_long_does_not() -> None:
    assert not is_message("text", uploads=True)
    long = {**PART, "content": bytes(600_000)}
    assert sent(long, uploads=True)
    assert not sent({**PART, "content": bytes(1_000_000)}, uploads=True)
    assert sent({**UPDATE, "updates": {"value": "𝟘" * 20_000}})  # in any script


@pytest.mark.parametrize("what", ["list", "map", "nested"])
def test_a_message_is_refused_before_it_takes_memory(what: str) -> None:
    n = 900_000
    head = msgspec.msgpack.encode(UPDATE)[:-1]
    data = {
        "list": head + b"\xdd" + n.to_bytes(4, "big") + b"\x80" * n,
        "map": b"\x81\xa4type\xdf" + n.to_bytes(4, "big") + b"\xa0\x80" * (n // 2),
        "nested": head + b"\x91" * n,
    }[what]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert not is_message(data, uploads=True)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 20_000  # kB; decoded, it takes 58 MB


anything = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**63) | st.floats() | st.text() | st.binary(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)
examples = st.sampled_from([UPDATE, CAMERA, CLICK, COMMAND, PART, UPLOAD])


@given(examples, st.data())
def test_whatever_passes_viser_can_read(message: dict[str, object], data: st.DataObject) -> None:
    field = data.draw(st.sampled_from(sorted(set(message) - {"type"})))
    changed = msgspec.msgpack.encode({**message, field: data.draw(anything)})
    if is_message(changed, uploads=True):
        _messages.Message.deserialize(changed)


@given(st.binary(max_size=200))
def test_bytes_never_raise(data: bytes) -> None:
    is_message(data, uploads=True)
