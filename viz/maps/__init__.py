"""The cells of archives as maps in SVG, and what they do in a browser.

A map becomes a picture here. Which maps a browser shows, and what a click on one does, is ``app/maps/``; the
maps of a comparison are ``viz/report/``.

Read in this order:

1. ``axis_labels``: how axes are labelled and cells are described.
2. ``contents``: what the archives of a run hold at one of its generations.
3. ``scale``: which value takes which colour, and the bar that says so; the colormaps are in ``viz.theme``.
4. ``coloring``: what the colours stand for: fitness, age, visits, robust fitness.
5. ``layouts``: which maps show an archive of two, three or four axes.
6. ``map_parts``: what plain and nested maps share.
7. ``heatmap``: a plain map.
8. ``nested``: a map of maps.
9. ``map_pictures``: contents, layout and colours put together. Begin here to follow a map from end to end.
10. ``interaction``, ``map.js``: hover card, keyboard, enlarged view and files.
11. ``elite_list``: the elites as a list.
"""
