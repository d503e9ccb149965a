"""A small page on this computer that shows what the camera sees and what the board does."""

from __future__ import annotations

import http.server
import json
import threading
from typing import Any, Final

from engine.errors import InvalidData

HOST: Final = "127.0.0.1"
_PAGE: Final = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>TensAtlas: drive</title>
<style>body{font:16px system-ui,sans-serif;margin:1rem;background:#17212b;color:#e8edf2}
img{max-width:100%;max-height:80vh;border-radius:6px;background:#000}p{min-height:1.5em}</style>
<p id="state">waiting for the first picture</p><img id="picture" alt="what the camera sees">
<script>
const picture = document.getElementById("picture"), state = document.getElementById("state");
let n = 0;
async function next() {
  try {
    state.textContent = (await (await fetch("state")).json()).text;
    await new Promise((done) => {
      picture.onload = picture.onerror = done;
      picture.src = "picture.jpg?" + n++;
    });
    setTimeout(next, 60);
  } catch {
    state.textContent = "the drive has ended";
  }
}
next();
</script></html>
"""


class PicturePage:
    """Serves the page until it is closed, to this computer alone.

    Args:
        port: to listen on.

    Raises:
        InvalidData: it cannot be listened on.
    """

    def __init__(self, port: int) -> None:
        self._mutex = threading.Lock()
        self._picture, self._text = b"", "waiting for the first picture"
        page = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                page.answer(self)

            def log_message(self, *_: Any) -> None:
                """Say nothing."""

        try:
            self._server = http.server.ThreadingHTTPServer((HOST, port), Handler)
        except (OSError, OverflowError) as e:
            reason = getattr(e, "strerror", None) or "no such port"
            raise InvalidData(
                f"cannot listen on port {port} ({reason}); choose another with --page, 0 for none"
            ) from None
        self._server.daemon_threads = True
        self.address = f"http://{HOST}:{self._server.server_address[1]}"
        threading.Thread(target=self._server.serve_forever, name="picture", daemon=True).start()

    def show(self, picture: bytes, text: str) -> None:
        """Show a JPEG and a line of text."""
        with self._mutex:
            self._picture, self._text = picture, text

    def close(self) -> None:
        """Serve no longer."""
        self._server.shutdown()
        self._server.server_close()

    def answer(self, request: http.server.BaseHTTPRequestHandler) -> None:
        """Answer one request."""
        # a page elsewhere whose name was made to point here must not see the room
        if request.headers.get("Host", "").rsplit(":", 1)[0] not in (HOST, "localhost"):
            request.send_error(403)
            return
        with self._mutex:
            picture, text = self._picture, self._text
        path = request.path.split("?", 1)[0]
        known = {
            "/": ("text/html; charset=utf-8", _PAGE.encode()),
            "/state": ("application/json", json.dumps({"text": text}).encode()),
            "/picture.jpg": ("image/jpeg", picture),
        }
        if path not in known:
            request.send_error(404)
            return
        kind, content = known[path]
        request.send_response(200)
        for name, value in (
            ("Content-Type", kind),
            ("Content-Length", str(len(content))),
            ("Cache-Control", "no-store"),
            ("X-Content-Type-Options", "nosniff"),
        ):
            request.send_header(name, value)
        request.end_headers()
        request.wfile.write(content)
