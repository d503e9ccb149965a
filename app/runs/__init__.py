"""Run files: which there are, how one is started or brought, how several compare. No maps, no robots.

Read in this order:

- ``library``: the run files on offer, opened once for all browsers, and a watch on those that are shown.
- ``run_names``: short names of runs, for lists and addresses.
- ``launcher``: starts, pauses, resumes and stops runs as processes of their own.
- ``run_form``: the form of a new run. ``run_panel``: how the shown run fares, with the form below.
- ``upload``: run files that browsers bring, checked before they are kept.
- ``compare_panel``: which runs are compared. ``comparison_window``: the report of a comparison over the app.
"""
