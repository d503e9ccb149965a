"""Serves browsers: listens, asks ``app.gui.access`` which requests to answer, gives each browser a session.

One file: ``server``. ``explore`` serves runs and ``replay_dump`` a failed simulation, both until Ctrl-C.
"""
