"""The commands ``explore``, ``replay-dump`` and ``replay-log``: the app in a browser."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

import tyro
from rich.console import Console

if TYPE_CHECKING:  # the app's libraries take a second to import; other commands do not need them
    from app.server.server import Listening


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Serving:
    host: str = "127.0.0.1"
    """Address to listen on. Any other than this machine's own needs a token."""
    port: int = 8080
    """Port to listen on."""
    token: str | None = None
    """Secret that the address must carry; also TENSATLAS_TOKEN. Made up if others can reach the app."""
    origin: tuple[str, ...] = ()
    """Addresses that a reverse proxy shows the app under, such as https://atlas.example.org."""

    def _listening(self, *, open_browser: bool) -> Listening:
        from app.server.server import Listening

        return Listening(
            host=self.host, port=self.port, token=self.token, origins=self.origin, open_browser=open_browser
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Explore(_Serving):
    """Open the app in a browser: archives, live runs, replays.

    Without RUN it offers every run in saved_archives/ and runs/; without saved_archives/ an example.
    """

    paths: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Run files or folders to offer, the first one opened."""
    read_only: bool = False
    """Let visitors look: no runs, no uploads, few simulations for each."""
    browser: bool = True
    """Open a browser window, where there is a screen."""

    def run(self, _: Console) -> None:
        """Serve the app until interrupted.

        Raises:
            InvalidData: the token or an origin cannot be used.
            RunFileError: a run file named is missing or damaged.
            ServerError: the address cannot be listened on.
        """
        from app.server.server import explore

        explore(self.paths, self._listening(open_browser=self.browser), read_only=self.read_only)


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReplayDump(_Serving):
    """Look at a simulation that failed, in a browser: its last moments and the reason."""

    file: tyro.conf.Positional[Path]
    """Failure dump, *.tsdump; a run keeps its own in the folder NAME.failures beside it."""
    browser: bool = True
    """Open a browser window, where there is a screen."""

    def run(self, _: Console) -> None:
        """Serve the dump until interrupted.

        Raises:
            InvalidData: the token or an origin cannot be used.
            DumpError: the file cannot be read as a dump.
            ServerError: the address cannot be listened on.
        """
        from app.server.server import replay_dump

        replay_dump(self.file, self._listening(open_browser=self.browser))


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReplayLog(_Serving):
    """Look at the log of a drive in a browser, beside a simulation of the robot as it would be built."""

    file: tyro.conf.Positional[Path]
    """Log that drive wrote, *.jsonl."""
    path: tyro.conf.Positional[Path]
    """Run file of the robot."""
    materials: str = "latex-sheet"
    """What it is built from: latex-sheet, tpu-85a, silicone-sheet, or a TOML file of yours."""
    browser: bool = True
    """Open a browser window, where there is a screen."""

    def run(self, _: Console) -> None:
        """Serve the log until interrupted.

        Raises:
            InvalidData: the file is no log, or of another robot; the materials, the token or an origin cannot
                be used.
            RunFileError: the run cannot be read.
            ServerError: the address cannot be listened on.
        """
        from app.server.drive_log import replay_log

        replay_log(self.file, self.path, self.materials, self._listening(open_browser=self.browser))
