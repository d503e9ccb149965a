"""What a person runs: the command line and the browser app. It imports viz and engine.

From the door inwards; a room imports only those below it in this list. What is typed is handled in ``cli``;
where a click leads is decided in ``session``.

- ``__main__``: ``python -m app`` is ``tensatlas``.
- ``cli``: one file per command.
- ``server``: serves the app to browsers.
- ``session``: one browser: makes its panels and connects them to each other and to the page's address.
- ``downloads``: what one takes along: a robot as a folder, a replay as a file, tables, the basket.
- ``state``: what one browser looks at.
- ``robot``: panels about the chosen robot.
- ``maps``: which maps are shown, and how. ``replay``: a replay in the 3D scene, and its transport.
- ``runs``: run files: offered, started, uploaded, compared.
- ``gui``: what viser lacks. ``worker_flags``: who computes, as flags.
  ``limits``: how much a visitor may have simulated.
"""
