"""Serves browsers: listens, asks ``app.gui.access`` whom to answer, gives every browser a session of its own.

One file: ``server``. ``explore`` serves runs and ``replay_dump`` a failed simulation, both until Ctrl-C.
"""
