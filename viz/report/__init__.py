"""A comparison of runs as tables and figures: for one page that needs nothing else, and for the app.

The numbers come from ``engine/analysis/``; here they are drawn, with Plotly.

Read in this order:

1. ``report``: the sections in their order, and the page (``page.css``, ``report.css``).
2. ``style``: colours and type of all figures.
3. ``tables``: statistics, tests and runs.
4. ``trends``: what runs reach over their evaluations, and where they end.
5. ``maps``: the maps of all runs in the paper's arrangement.
6. ``nested``: 4-D maps.
7. ``images``: the figures as files, drawn by Chromium.
"""
