"""The science of TensAtlas. It imports neither viz nor app and runs without a screen.

From the ground up; a room imports only rooms listed before it:

- ``errors``: errors with a message for the user. ``exact``: numbers that are the same on every machine.
  ``children``: how a process starts another. ``files``: CSV, JSON, TOML and ZIP.
- ``body``: what a robot is. ``control``: controller genes and their network.
- ``tasks``: what the world holds, what is sensed, how a trial scores.
- ``simulation``: genes in, evaluations out.
- ``search``: which robots to try, which keep a cell.
- ``config``: all that decides a run's outcome.
- ``workers``: who computes evaluations. ``replay``: a trial simulated again, to be looked at.
  ``storage``: the run file.
- ``runs``: a run started, resumed, finished.
- ``analysis``: numbers about runs that exist. ``fabrication``: a body as parts, lists and firmware.
- ``export``: a robot as a folder of data for other programs.
"""
