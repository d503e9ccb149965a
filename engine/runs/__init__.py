"""A run started, resumed and finished; an experiment of many.

Read in this order:

- ``evolve``: starts a run, or resumes an interrupted one.
- ``run_loop``: ask, evaluate, save, tell, close the generation; again until the budget is spent.
- ``described``: a run as a TOML file.
- ``breeding``: a run whose parents somebody chose, described by a few choices.
- ``campaign``: a grid of tasks, algorithms and seeds, described in one file.
"""
