"""Runs as lists and trends, in HTML and SVG.

What shows a run without its maps (``viz/maps/``) and without comparing it to others (``viz/report/``).

* ``run_list``: runs to choose from, with what each is and how far it came.
* ``run_configuration``: all that decides its outcome.
* ``run_progress``: speed, time left, and what went wrong.
* ``trend``: best and mean f_s, QD scores, coverage and good cells over evaluations.
* ``basket_list``: the robots in a basket.
"""
