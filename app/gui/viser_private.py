"""The only file that touches viser's private parts.

Each of them is here because nothing public does it:

- ``start_server``: viser has no hook for checking who connects and what is sent, so the web-socket library's
  own ones are set (see ``web_socket``). The share tunnel can be hidden, but not be switched off.
- ``_Dispatcher``: viser runs what browsers set off on one pool of threads, in which one browser's clicks keep
  all others waiting.
- ``Gate``: viser writes what a browser sends into its widgets unchecked: any attribute, any value, files of
  any size.
- ``ModalHandle``: the type of what ``add_modal`` returns has no public name.
- ``inputs_of``: a client cannot be asked for its controls.
- ``_icon``: viser looks through the list of its 5,000 icons anew for every icon that it has not drawn lately,
  which took a third of the time until a page was there.
- ``put_arrays``: viser compares and copies every array three times, one message each; a replay sends five
  of them in every frame to every browser.
- ``uuid_of`` and ``selector``: a widget can only be found on the page by the id that viser gave it, and what
  is around it by how viser builds its elements, which ``marks.js`` knows.
- ``run_now``: scripts that come with HTML run when a browser finds the time.

All were written for viser 1.1.1, which ``constraints.txt`` pins; ``tests/browser/test_safety.py`` notices if
another one does not have them.
"""

from __future__ import annotations

import functools
import math
import threading
import time
import weakref
import zipfile
from collections.abc import Callable, Hashable, Sequence
from concurrent.futures import Future
from typing import Any, Final

import numpy as np
import viser
from viser import _gui_api, _gui_handles, _icons, _messages
from viser._gui_handles import GuiModalHandle as ModalHandle
from viser._gui_handles import GuiProgressBarHandle

from app.gui.access import Access
from app.gui.incoming import MAX_TEXT
from app.gui.web_socket import guarded_serving
from engine.errors import printable

__all__ = [
    "Gate",
    "ModalHandle",
    "acceptable",
    "inputs_of",
    "put_arrays",
    "run_now",
    "selector",
    "start_server",
    "uuid_of",
    "within",
]

MAX_PARTS: Final = 4096
"""Parts of the largest file."""
MAX_COMING: Final = 400_000_000
"""Bytes of all files that are on their way to a server; they are held in memory until they are there."""
STALLED: Final = 20.0
"""Seconds after which a file of which nothing comes makes room for others."""
_starting = threading.Lock()
_gates: weakref.WeakSet[Gate] = weakref.WeakSet()


Dispatch = Callable[[int, Hashable, Callable[[], None]], None]
"""Sees to it that something is done for a client, known by its number: what kind of thing, and what."""


def start_server(
    host: str, port: int, access: Access, dispatch: Dispatch, *, uploads: bool
) -> viser.ViserServer:
    """Start a viser server that answers only requests that the rules admit.

    Args:
        host: address to listen on.
        port: port to listen on.
        access: the rules.
        dispatch: called on the thread that serves all browsers with what one of them sets off; must be quick.
        uploads: whether browsers may send files.
    """
    ready = threading.Event()
    with _starting, guarded_serving(access, uploads=uploads, ready=ready.is_set):
        server = viser.ViserServer(host=host, port=port, label="TensAtlas", verbose=False)
    for module in (_gui_api, _gui_handles):
        module.svg_from_icon = _icon  # type: ignore[attr-defined]
    server._thread_executor = _Dispatcher(dispatch)  # type: ignore[assignment]
    handlers = server._websock_server
    # all widgets belong to a client; the share messages open a tunnel that shows the server to the world
    for kind in (
        _messages.ShareUrlRequest,
        _messages.ShareUrlDisconnect,
        _messages.GuiUpdateMessage,
        _messages.GuiFormDirtyMessage,
        _messages.FileTransferStartUpload,
        _messages.FileTransferPart,
    ):
        handlers.unregister_handler(kind)
    ready.set()
    return server


@functools.cache
def _all_icons() -> zipfile.ZipFile:
    return zipfile.ZipFile(_icons.ICONS_DIR / "tabler-icons.zip")


@functools.cache
def _icon(name: str) -> str:
    """Return an icon as SVG."""
    return _all_icons().read(f"{name}.svg").decode()


class _Dispatcher:
    """Takes the place of viser's pool of threads."""

    def __init__(self, dispatch: Dispatch) -> None:
        self._dispatch = dispatch

    def submit(self, callback: Callable[[Any], None], event: Any) -> Future[None]:
        """Pass on what calls a callback; events of one widget are of one kind."""
        client = event if isinstance(event, viser.ClientHandle) else event.client
        kind = (callback, id(getattr(event, "target", None)))
        self._dispatch(client.client_id, kind, functools.partial(callback, event))
        passed_on: Future[None] = Future()
        passed_on.set_result(None)
        return passed_on

    def shutdown(self, wait: bool = True) -> None:
        """Do nothing: the threads belong to others."""


def uuid_of(widget: Any) -> str:
    """Return the id of a widget, which its label on the page carries."""
    return str(widget._impl.uuid)


def selector(widget: Any) -> str:
    """Return the CSS selector of what viser draws around a button, or an input with a label."""
    if isinstance(widget, viser.GuiButtonHandle | viser.GuiUploadButtonHandle):
        return f'[data-ta-around="{uuid_of(widget)}"]'
    return f'[data-ta-box="{uuid_of(widget)}"]'


def run_now(client: viser.ClientHandle, code: str) -> None:
    """Run JavaScript in a browser before anything that is sent to it later is shown."""
    client.gui._websock_interface.queue_message(_messages.RunJavascriptMessage(source=code))


def inputs_of(gui: viser.GuiApi) -> list[Any]:
    """Return every control of a browser; progress bars, which viser counts among them, are left out."""
    found = gui._gui_input_handle_from_uuid.values()
    return [handle for handle in found if not isinstance(handle, GuiProgressBarHandle)]


def put_arrays(handle: viser.SceneNodeHandle, **arrays: np.ndarray) -> None:
    """Set properties of a node of the scene in one message, without a look at what they were.

    Args:
        handle: of the node; if it has been removed, nothing happens.
        arrays: by the names of the properties; of their types, and never changed afterwards.
    """
    implementation = handle._impl
    if implementation.removed:
        return
    for name, value in arrays.items():
        setattr(implementation.props, name, value)
    message = _messages.SceneNodeUpdateMessage(implementation.name, dict(arrays))
    implementation.api._queue_scene_message(message)


class Gate:
    """Drops what a browser must not send to its widgets.

    A disabled widget takes nothing. A value must be of its widget's kind, finite or among the options. One
    beyond a slider becomes the slider's end, in the browser too. A number's limits are left to its reader:
    typing 12 passes through 1. Files come only through an upload button that was opened for them, one at a
    time, named as they must be, and none is larger than it said.

    Args:
        client: the browser, before it has any widgets.
    """

    def __init__(self, client: viser.ClientHandle) -> None:
        self._gui = gui = client.gui
        _gates.add(self)
        self._heard = 0.0
        """When a part of a file came last."""
        self._open: dict[str, tuple[str, int, Callable[[str], None]]] = {}
        handlers = gui._websock_interface
        replaced: tuple[tuple[Any, Any, Any], ...] = (
            (_messages.GuiUpdateMessage, gui._handle_gui_updates, self._update),
            (_messages.FileTransferStartUpload, gui._handle_file_transfer_start, self._start),
            (_messages.FileTransferPart, gui._handle_file_transfer_part, self._part),
        )
        for kind, old, new in replaced:
            handlers.unregister_handler(kind, old)
            handlers.register_handler(kind, new)

    def open(
        self, button: viser.GuiUploadButtonHandle, suffix: str, max_bytes: int, refused: Callable[[str], None]
    ) -> None:
        """Let files through an upload button.

        Args:
            button: of this client.
            suffix: that the name of a file has.
            max_bytes: of a file.
            refused: called with a line that says why a file was not taken; must be quick.
        """
        self._open[uuid_of(button)] = (suffix, max_bytes, refused)

    def taken(self, button: viser.GuiUploadButtonHandle) -> tuple[str, bytes]:
        """Return the name and the content of the file that came last; viser keeps it no longer."""
        file = button.value
        button._impl.value = viser.UploadedFile(name="", content=b"")
        return file.name, file.content

    async def _update(self, client_id: Any, message: _messages.GuiUpdateMessage) -> None:
        handle = self._gui._gui_input_handle_from_uuid.get(message.uuid)
        if handle is None or set(message.updates) != {"value"}:
            return
        impl, sent = handle._impl, message.updates["value"]
        if getattr(impl.props, "disabled", False):
            return
        value = within(impl.props, sent)
        if value != sent:  # the browser shows what it has sent
            message = _messages.GuiUpdateMessage(message.uuid, {"value": value})
            self._gui._websock_interface.queue_message(message)
        if acceptable(impl.props, impl.value, value):
            await self._gui._handle_gui_updates(client_id, message)

    def _start(self, client_id: Any, message: _messages.FileTransferStartUpload) -> None:
        opened = self._open.get(message.source_component_uuid)
        if opened is None:
            return
        suffix, limit, refused = opened
        if not message.filename.lower().endswith(suffix):
            self._refuse(message)
            refused(f"{printable(message.filename[-60:])} is no file of the kind *{suffix}")
            return
        if not 0 < message.size_bytes <= limit:
            self._refuse(message)
            refused(f"it has {message.size_bytes / 1e6:.1f} MB; from 0 to {limit / 1e6:.1f} MB are taken")
            return
        if not 0 < message.part_count <= MAX_PARTS:
            return
        self._gui._current_file_upload_states.clear()  # one at a time: the last one
        if sum(gate._coming() for gate in _gates) + message.size_bytes > MAX_COMING:
            self._refuse(message)
            refused("others send large files at this moment; try again in a minute")
            return
        self._heard = time.monotonic()
        self._gui._handle_file_transfer_start(client_id, message)

    def _refuse(self, message: _messages.FileTransferStartUpload) -> None:
        """Tell a browser that it has sent all: it waits for that, with its button disabled."""
        self._gui._websock_interface.queue_message(
            _messages.FileTransferPartAck(
                source_component_uuid=message.source_component_uuid,
                transfer_uuid=message.transfer_uuid,
                transferred_bytes=message.size_bytes,
                total_bytes=message.size_bytes,
            )
        )

    def _coming(self) -> int:
        """Return the bytes of the file that is on its way; viser forgets it when the browser leaves.

        One of which nothing has come for a while is given up: others need the room.
        """
        if time.monotonic() - self._heard > STALLED:
            self._gui._current_file_upload_states.clear()
        return sum(int(s["total_bytes"]) for s in self._gui._current_file_upload_states.values())

    def _part(self, client_id: Any, message: _messages.FileTransferPart) -> None:
        uploads = self._gui._current_file_upload_states
        state = uploads.get(message.transfer_uuid)
        if state is None:
            return
        if state["transferred_bytes"] + len(message.content) > state["total_bytes"]:
            del uploads[message.transfer_uuid]
            return
        self._heard = time.monotonic()
        self._gui._handle_file_transfer_part(client_id, message)


def within(props: Any, value: Any) -> Any:
    """Return a number for a slider as near as the slider lets it be; anything else as it is."""
    if isinstance(props, _messages.GuiSliderProps) and _is_number(value):
        return min(max(value, props.min), props.max)
    return value


def acceptable(props: Any, now: Any, value: Any) -> bool:
    """Tell whether a browser may give a widget a value.

    Args:
        props: the widget's, of one of viser's ``Gui...Props``.
        now: its value at this moment.
        value: what the browser sent.
    """
    match props:
        case _messages.GuiUploadButtonProps():
            return False
        case _messages.GuiButtonProps() | _messages.GuiCheckboxProps():
            return isinstance(value, bool)
        case _messages.GuiTextProps():
            return isinstance(value, str) and len(value) <= MAX_TEXT
        case _messages.GuiDropdownProps() | _messages.GuiButtonGroupProps():
            return isinstance(value, str) and value in props.options
        case _messages.GuiSliderProps():
            return _is_number(value) and props.min <= value <= props.max
        case _messages.GuiMultiSliderProps():
            return _are_numbers(value, len(now)) and all(props.min <= v <= props.max for v in value)
        case _messages.GuiNumberProps():
            return _is_number(value)
    if isinstance(now, tuple):  # vectors and colours
        return _are_numbers(value, len(now))
    return isinstance(value, type(now))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _are_numbers(value: Any, n: int) -> bool:
    return isinstance(value, Sequence) and len(value) == n and all(map(_is_number, value))
