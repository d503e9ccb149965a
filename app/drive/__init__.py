"""Driving a robot: a camera sees where head and target are, a serial line tells the board.

Read in this order; nothing imports what stands below it:

- ``eyes``: what is seen of a robot at one moment.
- ``log``: what happened during a drive, as a file.
- ``path``: the measured path, as a trial of the simulation has it.
- ``sensing``: from where head and target are to what a task's controller senses.
- ``link``: the serial line to the board.
- ``camera``: finds the printed tags in a camera's pictures.
- ``simulated``: the robot as it would be built, its board behind a pseudo-terminal.
- ``page``: a small page that shows the picture.
- ``host``: starts the robot, tells it what it senses, stops it.
- ``command``: the command ``drive``.
"""
