"""A replay as a file: a picture, a video or a page. Needs no display and no graphics card.

The replay is simulated before (``engine/replay/``); the scene in the app is ``app/replay/``.

Read in this order:

1. ``primitives``: a look, a camera, and what is painted with.
2. ``render``: pictures of a replay.
3. ``video``: the pictures as an MP4 file.
4. ``motion``: a robot's motion as data for a page. ``packing``: the same as few bytes.
5. ``standalone_replay``: a replay as one HTML file. ``replay_view.js``, ``.css`` and ``.html`` draw and play
   it; the page of a whole run, ``viz/atlas/``, has them too.
"""
