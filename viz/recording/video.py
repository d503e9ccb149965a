"""A replay as an MP4 video, encoded on the processor through PyAV.

PyAV is BSD-licensed and an optional extra. Its wheels carry FFmpeg (LGPL) and many encoders, of which only
permissive ones are used: AV1 by SVT-AV1 (BSD), else VP9 by libvpx (BSD), else FFmpeg's own MPEG-4, which
browsers do not play. H.264 would need x264 (GPL) and is left out, although more old players know it.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from fractions import Fraction
from typing import Any, Final

from engine.errors import ExportError
from engine.replay.replay import Replay
from viz.recording.primitives import ReplayLook
from viz.recording.render import Renderer

FPS: Final = 30
ENCODERS: Final[dict[str, dict[str, str]]] = {
    "libsvtav1": {"preset": "8", "crf": "38"},
    "libvpx-vp9": {"deadline": "realtime", "cpu-used": "8", "crf": "45", "b": "0"},
    "mpeg4": {"q": "4"},
}
"""Encoders with their settings, the best first. A faster preset of AV1 blends the clock's digits with those
before them."""


def video(
    replay: Replay,
    *,
    look: ReplayLook | None = None,
    run: str = "",
    speed: float = 1.0,
    encoder: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> bytes:
    """Return a trial as an MP4 file, from the moment when the target is placed.

    Args:
        replay: simulated to the moment at which the video ends.
        look: size and colours.
        run: name of the run, for the caption.
        speed: seconds of the trial in a second of the video.
        encoder: one of ``ENCODERS``; None for the first that there is.
        progress: called after every frame with how many of how many are done; what it raises ends the
            work.

    Raises:
        ExportError: PyAV is missing or has no encoder, or there is nothing to show.
    """
    av = _av()
    name = encoder or _best(av)
    # SVT-AV1 otherwise tells its settings on the standard error stream
    os.environ.setdefault("SVT_LOG", "1")
    renderer = Renderer(replay, look, run=run)
    size = (look or ReplayLook()).size
    end = replay.frames[-1].time
    n_frames = max(1, round(FPS * end / speed))
    file = io.BytesIO()
    with av.open(file, "w", format="mp4") as container:
        stream = container.add_stream(name, rate=FPS, options=dict(ENCODERS[name]))
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        stream.time_base = Fraction(1, FPS)
        for k in range(n_frames):
            frame = av.VideoFrame.from_image(renderer.picture(min(k * speed / FPS, end)))
            frame.pts, frame.time_base = k, Fraction(1, FPS)
            container.mux(stream.encode(frame))
            if progress:
                progress(k + 1, n_frames)
        container.mux(stream.encode(None))
    return file.getvalue()


def _av() -> Any:
    try:
        import av
    except ImportError:
        raise ExportError("a video needs PyAV; install it with: pip install 'tensatlas[video]'") from None
    return av


def _best(av: Any) -> str:
    """Return the first encoder that this FFmpeg has."""
    for name in ENCODERS:
        try:
            av.codec.Codec(name, "w")
        except ValueError:  # av's UnknownCodecError is one
            continue
        return name
    raise ExportError("the installed FFmpeg can encode neither AV1 nor VP9 or MPEG-4")
