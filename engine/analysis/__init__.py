"""Numbers about runs that exist. Nothing here changes a run or draws.

Read in this order:

- ``run_files``: files and folders of them.
- ``elite_maps``: archives seen along other axes.
- ``profile``: how many cells hold a robot that is good for something.
- ``steering``: which controllers tell left from right.
- ``comparison/``: runs side by side.
- ``elite_table``: a run's elites as a table with pyribs' column names. ``evaluation_table``: every evaluation
  as one, and genotypes read back. ``given_robots``: robots of other files, to start a run from.
- ``projection_run``: a projection as a new run file.
- ``verify``: one robot simulated again, with other noise or physics. ``as_built``: as it would be built.
- ``reevaluation``: a run's elites evaluated again. ``robustness``: how much of a map was luck.
"""
