"""The command ``tensatlas``: one file per command, or per pair of commands that belong together.

A command is a frozen dataclass with a ``run()``. Its fields, and the lines below them, become its flags and
their help. A command calls the rooms that compute, read, write or draw, and says what came out. What takes
long to import is imported only when its command runs, so that all others start soon.

Read in this order:

- ``main``: the list of commands; parses a command line and turns errors into one line and an exit status.
- ``explore``: the app in a browser: ``explore``, ``replay-dump``, ``replay-log``.
- ``evolve``: one run: ``evolve``, ``resume``, and the configuration's flags. ``campaign``: many runs.
- ``info``: what a run file holds. ``tables``: its elites in another form: ``table``, ``project``.
- ``compare``: a report of runs. ``verify``: an elite simulated again. ``reevaluate``: all elites again.
- ``export``: a robot as a folder. ``record``: replays as files: ``record``, ``page``.
- ``doctor``: checks an installation and run files. ``repair``: ``recover``, ``migrate``, ``slim``.
- ``progress``: what a terminal shows while a command works.
"""
