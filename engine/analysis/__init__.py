"""Numbers about runs that exist. Nothing here changes a run or draws.

Read in this order:

- ``statistics``: descriptive statistics, rank-sum tests, trends.
- ``published``: the paper's results.
- ``elite_maps``: archives seen along other axes.
- ``run_result``: what a comparison takes from one run.
- ``comparison``, ``comparison_tables``: runs side by side, and their numbers as CSV.
- ``elite_table``: a run's elites as a table with pyribs' column names.
- ``projection_run``: a projection as a new run file.
- ``verify``: one robot simulated again, with other noise or physics.
- ``reevaluation``: a run's elites evaluated again. ``robustness``: how much of a map was luck.
"""
