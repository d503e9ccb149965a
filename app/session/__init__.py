"""Wires one browser: builds its panels and connects them. Nothing here draws or simulates by itself.

Read in this order:

- ``session``: the panels, and what the user does with runs, generations and cells.
- ``chosen_robot``: from a click to a replay; connects the panels about a robot.
- ``greeting``: the best robot of a run, shown before anybody has chosen one.
- ``navigation``: goes where the browser's address points, and keeps the address true.
- ``address``: what an address says.
- ``commands``: the command palette.
- ``preferences``: what a browser remembers: light or dark.
- ``software_rendering``: tells who has no graphics card.
- ``lone_replay``: a browser that looks at one replay instead of runs.
- ``dump_session``: a browser that looks at a failed simulation.
- ``log_session``: a browser that looks at the log of a drive.
"""
