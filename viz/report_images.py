"""The figures of a report as files, drawn by the system's Chromium."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal

from engine.errors import ExportError
from viz.report import ReportFigure

ImageFormat = Literal["svg", "png"]
_PIXELS: Final = {"svg": 1.0, "png": 2.0}
"""Pixels of the file for each of the figure's."""


def write_images(figures: Sequence[ReportFigure], folder: Path, kind: ImageFormat) -> list[Path]:
    """Write figures into an existing folder, one file each, and return their paths.

    Raises:
        ExportError: there is no Chromium that could draw them, or it fails.
    """
    # takes a second to import, and only here
    import plotly.io
    from kaleido.errors import BrowserClosedError, BrowserFailedError, JavascriptError, KaleidoError

    paths = [folder / f"{f.name}.{kind}" for f in figures]
    quiet = logging.getLogger("choreographer"), logging.getLogger("kaleido")
    levels = [log.level for log in quiet]
    try:
        for log in quiet:
            log.setLevel(logging.CRITICAL)
        drawn = [f.figure for f in figures]
        plotly.io.write_images(
            drawn,
            paths,
            scale=_PIXELS[kind],
            # without these every figure is pressed into one default size
            width=[f.layout.width for f in drawn],
            height=[f.layout.height for f in drawn],
        )
    except (
        BrowserFailedError,
        BrowserClosedError,
        JavascriptError,
        KaleidoError,
        RuntimeError,
        OSError,
    ) as e:
        why = str(e).strip().splitlines()
        raise ExportError(
            "no Chromium could draw the figures as files; install one (sudo apt install chromium) or name"
            f" it in BROWSER_PATH ({why[0] if why else type(e).__name__})"
        ) from None
    finally:
        for log, level in zip(quiet, levels, strict=True):
            log.setLevel(level)
    return paths
