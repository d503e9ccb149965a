"""What a person runs: the command line and the browser app. Imports engine and viz; nothing imports it.

Read in this order; a room imports only rooms listed before it:

- ``archive/example.tsmr``: the run that an installation without ``saved_archives/`` shows.
- ``state``: what one browser looks at, and who alone changes each part.
- ``limits``: how much a visitor may simulate. ``worker_flags``: flags that choose the workers.
- ``gui``: additions to viser: access, clicks in pictures, values kept in the browser's page.
- ``runs``: run files: found, started, uploaded, compared.
- ``maps``: the left panel: which maps of a run, drawn how.
- ``replay``: a replay in the 3D scene, and its transport.
- ``pointing``: what is pointed at on a robot.
- ``robot``: the right panel: the chosen robot, and which trial of it is replayed.
- ``downloads``: files for download.
- ``session``: builds all of this for one browser and connects it.
- ``server``: serves browsers.
- ``cli``: the commands. ``__main__``: ``python -m app``.

A click on a cell goes from ``gui.click_channel`` to ``Session.pick``, to ``MapBoard.pick``, which
says whose cell it is, and on to ``ChosenRobot.choose``. That
loads what ``ReplaySource.replay`` returns into the player, which then calls ``ReplaySource.show`` for every
frame.
"""
