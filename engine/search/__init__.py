"""Which robots to try, and which keep a cell. Nothing here evaluates or stores.

Read in this order:

- ``algorithm``: the contract, on one page: ``ask``, ``tell``, ``state``, ``restore``.
- ``archive``: cells and their elites; where an elite is replaced.
- ``axes``: what an archive's axes mean; projections and sections of an archive.
- ``body_space``: the bodies that there are, and the map that they lie on.
- ``descriptors``: the cell of the way that a robot's head moves.
- ``variation``: random solutions and mutants.
- ``trajectory_archive``: an archive whose axes are fitted to the trajectories that it holds.
- ``elite_records``: how the children of each elite did, how it did itself under other noise, and which
  controllers do best for targets at either side of a body.
- ``map_search``: what DM-ME and MAP-Elites share. ``dm_me``, ``map_elites``: the two, the former with what
  it is compared with: random robots, and MAP-Elites on one 2-D map.
- ``viability``, ``neat_population``: the populations of bodies and of controllers that ``vie_neat`` pairs.
"""
