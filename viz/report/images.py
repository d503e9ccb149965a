"""The figures of a report as files, drawn by the system's Chromium.

A process of its own drives Chromium: a browser that hangs, as it may on a busy machine, then costs some
patience and not the whole command.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal

from engine.children import module_line
from engine.errors import ExportError
from viz.report.report import ReportFigure

ImageFormat = Literal["svg", "png"]
PATIENCE: Final = 90.0
"""Seconds that drawing may take, besides those for each figure."""
_PATIENCE_PER_FIGURE: Final = 6.0
_ATTEMPTS: Final = 2
_PIXELS: Final = {"svg": 1.0, "png": 2.0}
"""Pixels of the file for each of the figure's."""


def write_images(
    figures: Sequence[ReportFigure], folder: Path, kind: ImageFormat, patience: float = PATIENCE
) -> list[Path]:
    """Write figures into an existing folder, one file each, and return their paths.

    Raises:
        ExportError: there is no Chromium that could draw them, or it fails or hangs.
    """
    try:
        # files of an earlier report stay until these are whole
        with tempfile.TemporaryDirectory(prefix=".drawing-", dir=folder) as place:
            drawn = [Path(place).absolute() / f"{f.name}.{kind}" for f in figures]
            _draw_elsewhere(figures, drawn, kind, patience)
            return [path.replace(folder / path.name) for path in drawn]
    except OSError as e:
        raise ExportError(f"figures cannot be written to {folder}: {e.strerror or e}") from None


def _draw_elsewhere(
    figures: Sequence[ReportFigure], paths: Sequence[Path], kind: ImageFormat, patience: float
) -> None:
    job = json.dumps(
        {
            "figures": [f.figure.to_json() for f in figures],
            "paths": [str(p) for p in paths],
            "scale": _PIXELS[kind],
        }
    )
    limit = patience + _PATIENCE_PER_FIGURE * len(figures)
    for attempt in range(1, _ATTEMPTS + 1):
        try:
            status, error = _run(job, limit)
        except subprocess.TimeoutExpired:
            if attempt < _ATTEMPTS:
                continue
            why = f"it did not answer within {limit:.0f} s"
            raise ExportError(f"Chromium could not draw the figures as files: {why}") from None
        if status == 0:
            return
        why = (error.strip().splitlines() or ["it failed"])[-1]
        break
    raise ExportError(
        "no Chromium could draw the figures as files; install one (sudo apt install chromium) or name it in"
        f" BROWSER_PATH ({why})"
    )


def _run(job: str, limit: float) -> tuple[int, str]:
    """Draw in another process and return its status and what it said of an error."""
    with subprocess.Popen(
        module_line("viz.report.images"),
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            _, error = process.communicate(job, timeout=limit)
        except BaseException:
            # the browser runs in a session of its own and would outlive its parent
            for pid in (*_descendants(process.pid), process.pid):
                with contextlib.suppress(OSError):
                    os.kill(pid, signal.SIGKILL)
            raise
        return process.returncode, error


def _descendants(pid: int) -> list[int]:
    """Return the processes that a process has started, and those that they have; none without /proc."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            # the name, in parentheses, may hold anything
            parent = int(stat.read_text(errors="replace").rpartition(")")[2].split()[1])
            children.setdefault(parent, []).append(int(stat.parent.name))
    found = children.get(pid, [])
    for child in found:
        found += children.get(child, [])
    return found


def _draw(job: str) -> None:
    """Draw what ``write_images`` asks for."""
    import plotly.io

    logging.disable(logging.CRITICAL)
    data = json.loads(job)
    figures = [plotly.io.from_json(f) for f in data["figures"]]
    plotly.io.write_images(
        figures,
        data["paths"],
        scale=data["scale"],
        # without these every figure is pressed into one default size
        width=[f.layout.width for f in figures],
        height=[f.layout.height for f in figures],
    )


if __name__ == "__main__":
    try:
        _draw(sys.stdin.read())
    except Exception as e:  # whatever a browser may fail with becomes a line for the parent
        sys.exit((str(e).strip().splitlines() or [type(e).__name__])[0])
