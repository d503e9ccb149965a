"""A replay as a file: a picture, a video or a page. Needs no display and no graphics card.

The replay is simulated before (``engine/replay/``); the scene in the app is ``app/replay/``.

Read in this order:

1. ``primitives``: a look, a camera, and what is painted with.
2. ``render``: pictures of a replay.
3. ``video``: the pictures as an MP4 file.
4. ``standalone_replay``: a replay as one HTML file, whose viewer is ``standalone_replay.js``, ``.css`` and
   ``.html``.
"""
