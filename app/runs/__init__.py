"""Run files: found, started, uploaded, compared. No maps, no robots.

Read in this order:

- ``library``: the run files on offer, opened once for all browsers, and a watch on those that are shown.
- ``time_limit``: work with files that may never end.
- ``run_names``: short names of runs, for lists and addresses.
- ``launcher``: starts, pauses, resumes and stops runs as separate processes.
- ``run_form``: the form of a new run. ``run_panel``: the windows of the shown run and of a new one.
- ``breed_panel``: runs from chosen robots, their children, and the next run from the best of them.
- ``run_notes``: notes on runs. ``run_files``: another name, the bin. ``run_care``: offers these.
- ``upload``: run files from browsers, checked before they are kept.
- ``compare_panel``: which runs are compared. ``comparison_window``: the report of a comparison over the app.
"""
