"""What viser lacks, for any panel. Nothing here knows of runs, robots or replays.

Read in this order:

- ``viser_private``: every use of viser's private parts, and the gate that checks what widgets are set to.
- ``access``: who may use the app; decided before a request is answered.
- ``incoming``: which messages a browser may send.
- ``web_socket``: asks both for every request and every message.
- ``lanes``: who is served when, so that no browser keeps the others waiting.
- ``actions``: the user's actions: one at a time, and a notice when one fails.
- ``widgets``: small helpers: set a value once, inputs in one row.
- ``page_channel``: scripts in the page and their way to the app; the scripts are in ``page_channel.js``,
  and in ``marks.js`` one that lets styles find what viser draws without a name.
- ``click_channel``: clicks on pictures.
- ``top_bar``: the bar at the top of the page, and the windows that it opens.
- ``browser_value``: a value that lives in the page, such as its address.
- ``remembered_robots``: robots that a browser's tab remembers.
- ``file_maker``: a file made in the background, with progress and cancelling.
- ``field_docs``: the docstrings of a configuration's fields, for hints.
"""
