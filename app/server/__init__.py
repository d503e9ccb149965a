"""Serves browsers: listens, asks ``app.gui.access`` which requests to answer, gives each browser a session.

- ``server``: ``explore`` serves runs and ``replay_dump`` a failed simulation, both until Ctrl-C.
- ``drive_log``: ``replay_log`` serves the log of a drive.
- ``log``: what a server says on its terminal.
- ``warm_up``: the simulation compiled and loaded before the first click.
"""
