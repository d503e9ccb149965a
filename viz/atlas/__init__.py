"""A run's archives as one HTML file that opens without a server: maps, and every elite that crawls.

The player is that of a single replay, ``viz/recording/``. Read in this order:

1. ``elites``: one robot as data: facts, gains, network, ancestors, its motion towards every target.
2. ``shown``: which maps, in which colours, and which robots a page shows.
3. ``page``: all of a run, simulated again and put together with ``page.html``, ``page.css`` and ``page.js``.
"""
