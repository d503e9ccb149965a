"""The left panel: which run, which of its maps, drawn how. What a map looks like is in ``viz.maps``.

Read in this order:

- ``archives_panel``: the panel: maps, trends, generations; what it reports is in ``ArchivesEvents``.
- ``map_board``: what is drawn on it: run and generation, colours, the chosen robot's mark; what a click hits.
- ``elites_panel``: the list of elites, searched and filtered.
- ``color_controls``: by what the maps are coloured and on which scale.
- ``shared_scale``: one scale for all runs of a task.
- ``generation_player``: runs through the generations.
- ``run_picker``: the list of runs.
"""
